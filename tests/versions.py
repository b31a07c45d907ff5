"""The same result files, byte for byte, whatever versions of the libraries: `python versions.py PYTHON PYTHON ...`.

Each Python has the package and its libraries installed. All fit the bundled clips on this machine; on another one the last
digits may be others, which hang on its processor. GLB, OpenSim and Parquet name the versions of what wrote them, or are
packed by them.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import golden

FORMATS = ("csv", "bvh", "trc", "c3d")
LIBRARIES = ("numpy", "ezc3d", "c3d", "pandas", "scipy", "click")
_TOLD = (
    "import sys; from importlib.metadata import version;"
    f"print(sys.version.split()[0], *(f'{{n}} {{version(n)}}' for n in {LIBRARIES}), sep=', ')"
)


def made(python: str) -> dict[str, bytes]:
    """File name → content, of all bundled clips in all formats, and of a table of text."""
    found = {}
    options = [word for name in FORMATS for word in ("--format", name)]
    root = str(Path(__file__).parent.parent)
    with TemporaryDirectory() as folder:
        calls = [
            ([str(golden.SAMPLES / f"{clip}.c3d") for clip in clips], association, options)
            for association, clips in golden.CALLS.items()
        ]
        # A clip that pandas reads: what the first call writes of markers as TRC.
        table = Path(folder) / "table.trc"
        calls.append(([str(table)], "cmu", options[:6]))
        for clips, association, wanted in calls:
            if clips == [str(table)]:
                marks = ["--format", "trc", "--markers"]
                clip = str(golden.SAMPLES / "nearly_still.c3d")
                _fit(python, [clip], association, marks, f"{folder}/t", root)
                (Path(folder) / "t" / "nearly_still.skeleton.trc").rename(table)
            _fit(python, clips, association, wanted, f"{folder}/out", root)
        for path in sorted((Path(folder) / "out").iterdir()):
            found[path.name] = path.read_bytes()
    return found


def _fit(
    python: str, clips: list[str], association: str, options: list[str], folder: str, root: str
) -> None:
    call = [
        python,
        "-m",
        "mocap_skel",
        "fit",
        *clips,
        "--assoc",
        association,
        *options,
        "-q",
        "-o",
        folder,
    ]
    subprocess.run(call, check=True, stdout=subprocess.DEVNULL, cwd=root, timeout=300)


def main() -> None:
    """Compare all with the first; the exit code is 1 where a file differs."""
    first, *others = sys.argv[1:]
    expected = made(first)
    print(f"{len(expected)} files by {_versions(first)}")
    wrong = []
    for python in others:
        found = made(python)
        different = [name for name in expected if found.get(name) != expected[name]]
        different += sorted(set(found) - set(expected))
        said = f"differ: {', '.join(different)}" if different else "the same bytes"
        print(f"{_versions(python)}: {said}")
        wrong += different
    sys.exit(bool(wrong))


def _versions(python: str) -> str:
    return subprocess.run(
        [python, "-c", _TOLD], check=True, capture_output=True, text=True
    ).stdout.strip()


if __name__ == "__main__":
    main()
