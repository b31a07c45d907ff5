"""Timings of `mocap-skel fit`, side by side in one run: `make bench` or `python bench_fit.py [CLIP [MAP]]`.

Prints (a) the cold command against a bare read of the same file in a cold Python, (b) the fit alone
against ezc3d's read, both warm. Ratios are what counts: the machine's load moves the rest.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from timing import alternate

ROOT = Path(__file__).parent.parent
REAL = ROOT.parent / "shared" / "clips" / "cmu" / "01_01.c3d"
SAMPLE = ROOT / "sample_data" / "range_of_motion.c3d"
ROUNDS = 9


def cold(clip: Path, association: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        fit = [
            str(Path(sys.executable).parent / "mocap-skel"), "fit", str(clip), "--assoc",
            association, "-o", folder, "--overwrite",
        ]  # fmt: skip
        bare = [sys.executable, "-c", f"import ezc3d; ezc3d.c3d({str(clip)!r})"]
        whole, read = alternate(
            lambda: subprocess.run(fit, check=True, capture_output=True),
            lambda: subprocess.run(bare, check=True),
            rounds=ROUNDS,
        )
    print("cold, a new process each time, best of", ROUNDS)
    print(f"  mocap-skel fit (read, fit, two CSV files)   {1e3 * whole:7.0f} ms")
    print(f"  python -c 'import ezc3d; ezc3d.c3d(...)'    {1e3 * read:7.0f} ms")
    print(f"  ratio                                       {whole / read:7.2f}")


def warm(clip: Path, association: str) -> None:
    import ezc3d

    from mocap_skel import associate, fit_skeleton, read_association, read_clip

    known = read_association(association)
    recording = read_clip(clip)
    assignment = associate(recording, known)[0]
    fit, read = alternate(
        lambda: fit_skeleton(recording, assignment, known.skeleton),
        lambda: ezc3d.c3d(str(clip)),
        rounds=ROUNDS,
    )
    frames, markers = recording.points.shape[:2]
    print(f"warm, {frames} frames x {markers} markers, best of", ROUNDS)
    print(f"  fit_skeleton                                {1e3 * fit:7.0f} ms")
    print(f"  ezc3d.c3d(...)                              {1e3 * read:7.0f} ms")
    print(f"  ratio                                       {fit / read:7.2f}")


def main() -> None:
    clip = Path(sys.argv[1]) if len(sys.argv) > 1 else REAL if REAL.exists() else SAMPLE
    association = sys.argv[2] if len(sys.argv) > 2 else "cmu"
    print(clip)
    cold(clip, association)
    warm(clip, association)


if __name__ == "__main__":
    main()
