"""The same result files whatever versions of the libraries: `python versions.py PYTHON PYTHON ...`.

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

# Degrees and centimetres. In a long gap the figure hangs on the last bits of LAPACK, and `rig/solver.py` ends when
# a segment turns by less than 1e-3 rad; the next step would be the square of that.
SOLVED = 5e-4
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


def differences(name: str, one: bytes, other: bytes) -> tuple[str, bool]:
    """How two files differ in words, "" for not at all, and whether that is wrong."""
    if one == other:
        return "", False
    words = [text.split() for text in (one, other)]
    if not name.endswith(".bvh") or len(words[0]) != len(words[1]):
        return name, True
    try:
        apart = [abs(float(a) - float(b)) for a, b in zip(*words, strict=True) if a != b]
    except ValueError:
        return name, True
    said = f"{name} in {len(apart)} of {len(words[0])} words, by {max(apart):.1e} at most"
    return said, max(apart) > SOLVED


def main() -> None:
    """Compare all with the first; the exit code is 1 where a file differs by more than the solver's last step."""
    first, *others = sys.argv[1:]
    expected = made(first)
    print(f"{len(expected)} files by {_versions(first)}")
    wrong = False
    for python in others:
        found = made(python)
        wrong |= set(found) != set(expected)
        compared = [differences(name, expected[name], found.get(name, b"")) for name in expected]
        said = ", ".join(words for words, _ in compared if words)
        print(f"{_versions(python)}: {f'differ: {said}' if said else 'the same bytes'}")
        wrong |= any(bad for _, bad in compared)
    sys.exit(wrong)


def _versions(python: str) -> str:
    return subprocess.run(
        [python, "-c", _TOLD], check=True, capture_output=True, text=True
    ).stdout.strip()


if __name__ == "__main__":
    main()
