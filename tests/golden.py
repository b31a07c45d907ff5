"""What the command line makes of the bundled clips, in short: `make golden` writes it to tests/golden.

Of each clip and subject it keeps the whole joints.csv and every 100th row of skeleton.csv. A person
reviews the diff before it is committed; `test_golden.py` compares.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

HERE = Path(__file__).parent
FOLDER = HERE / "golden"
SAMPLES = HERE.parent / "sample_data"
# Association file → clips that are fitted in one call.
CALLS = {"cmu": ("range_of_motion", "two_dancers", "nearly_still"), "plug_in_gait": ("gaps",)}
EVERY = 100


def results() -> dict[str, str]:
    """File name → its text, of a fresh run of `mocap-skel fit` on all clips."""
    found = {}
    with TemporaryDirectory() as folder:
        for association, clips in CALLS.items():
            paths = [str(SAMPLES / f"{clip}.c3d") for clip in clips]
            call = ["fit", *paths, "--assoc", association, "-o", folder, "--quiet"]
            subprocess.run(
                [sys.executable, "-m", "mocap_skel", *call],
                check=True,
                stdout=subprocess.DEVNULL,
                timeout=300,
            )
        for path in sorted(Path(folder).iterdir()):
            text = path.read_text(encoding="utf-8")
            found[path.name] = thinned(text) if path.name.endswith(".skeleton.csv") else text
    return found


def thinned(table: str) -> str:
    """The header and every 100th row from the first on."""
    head, *rows = table.splitlines(keepends=True)
    return "".join([head, *rows[::EVERY]])


def main() -> None:
    """Write them anew; what is no longer made goes away."""
    found = results()
    FOLDER.mkdir(exist_ok=True)
    for path in FOLDER.glob("*.csv"):
        if path.name not in found:
            path.unlink()
    for name, text in found.items():
        (FOLDER / name).write_text(text, encoding="utf-8", newline="")
    print(f"wrote {len(found)} files to {FOLDER}; review the diff before committing it")


if __name__ == "__main__":
    main()
