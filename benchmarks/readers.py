"""One generated clip as every kind of file that is read, plain and packed: how far its joint centres are from the C3D's.

    python benchmarks/readers.py

The clip has noise of 1 mm and gaps. The tables have as many decimals of a millimetre as the programs write that make such
files; a C3D has 32-bit floats. `times` says whether the results have the times of the C3D's.
"""

from __future__ import annotations

import gzip
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from mocap_skel.artificial import Faults, human, marker_set, record, walk, write_c3d
from mocap_skel.fit import fit_skeleton
from mocap_skel.labels.association import associate, read_association
from mocap_skel.readers import read_clip
from mocap_skel.skeleton_fit import SkeletonFit

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from table_files import Marked, motive, nexus, plain, qualisys, trc

# Decimals of a millimetre: OpenSim and Cortex, Motive, Qualisys Track Manager, Nexus.
DECIMALS = {"trc": 5, "motive": 6, "qualisys": 3, "nexus": 3, "plain": 6}


def fitted(path: Path) -> SkeletonFit:
    """The fit of a file with the markers of the CMU."""
    known = read_association("cmu")
    clip = read_clip(path)
    return fit_skeleton(clip, associate(clip, known)[0], known.skeleton)


def texts(file: Marked) -> dict[str, str]:
    """The clip as a text of each kind, by what the kind is called and the name of its file."""

    def as_(kind: str, unit: str = "mm", sep: str = ",") -> Marked:
        return file.but(decimals=DECIMALS[kind], unit=unit, sep=sep)

    found = {"TRC, y up|y.trc": trc(as_("trc", sep="\t").but(points=file.points[..., [1, 2, 0]]))}
    found["TRC|walk.trc"] = trc(as_("trc", sep="\t"))
    for version in ("1.21", "1.22", "1.23", "1.24", "1.25"):
        found[f"Motive {version}|{version}.csv"] = motive(
            as_("motive", "Millimeters").but(first=0), version=version, parent=version >= "1.24"
        )
    found["QTM TSV|bare.tsv"] = qualisys(as_("qualisys", sep="\t"))
    found["QTM TSV, frame, time|full.tsv"] = qualisys(
        as_("qualisys", sep="\t"), frame=True, time=True, titles=True
    )
    found["Nexus CSV|nexus.csv"] = nexus(as_("nexus"))
    found["plain CSV|plain.csv"] = plain(as_("plain"), spell="{label}_{axis} [mm]")
    return found


def main() -> None:
    """Print the table."""
    faults = Faults(sigma=0.001, dropout=0.02)
    recording = record(human(), marker_set("cmu"), walk(6, 100, seed=3), faults, seed=3)
    with TemporaryDirectory() as name:
        folder = Path(name)
        write_c3d(recording, folder / "walk.c3d")
        clip = read_clip(folder / "walk.c3d")
        expected = fitted(folder / "walk.c3d")
        truth = np.stack([joint.track for joint in expected.joints])
        kinds = {"C3D|walk.c3d": (folder / "walk.c3d").read_bytes()}
        kinds |= {
            kind: text.encode()
            for kind, text in texts(Marked(clip.points * 1000, clip.labels)).items()
        }
        print(f"{len(expected.joints)} joints, {clip.frames} frames; seed 3")
        print("kind of file            median mm     most mm  as .gz  times")
        for title, content in kinds.items():
            kind, _, called = title.partition("|")
            path, packed = folder / called, folder / f"{called}.gz"
            path.write_bytes(content)
            packed.write_bytes(gzip.compress(content, 1))
            fit, again = fitted(path), fitted(packed)
            tracks, unpacked = (np.stack([j.track for j in one.joints]) for one in (fit, again))
            same = "same" if np.array_equal(tracks, unpacked, equal_nan=True) else "OTHER"
            if called == "y.trc":
                tracks = tracks[..., [2, 0, 1]]
            away = 1e3 * np.linalg.norm(tracks - truth, axis=2)
            times = "same" if np.array_equal(fit.time, expected.time) else "OTHER"
            assert (np.isnan(tracks) == np.isnan(truth)).all()
            print(
                f"{kind:22} {np.nanmedian(away):10.6f}  {np.nanmax(away):10.6f}  {same:6}  {times}",
                flush=True,
            )


if __name__ == "__main__":
    main()
