"""OpenSim against the model's own forward kinematics: `make opensim`, opt-in, for it needs opensim (0.3 GB).

Fits clips and writes them with `--format osim`. OpenSim loads the model and the motion and realises every frame; it
is compared where it puts joint centres and markers, and how far its markers are from the recorded ones. Then
OpenSim's own inverse kinematics finds the motion anew, from the model and the TRC, over the first 300 frames. Run by hand:

    python tests/opensim_check.py CLIP.c3d[:ASSOCIATION] ...

It ends with 1 where a joint is more than 1 mm off, or the markers of the inverse kinematics are more than 10 % farther
from the recorded ones than ours.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import opensim
from doc_blocks import python_of
from figures import CLIPS, MOST

from mocap_skel.clip import turn_between
from mocap_skel.errors import MocapSkelError
from mocap_skel.export.registry import Source, choose
from mocap_skel.export.trc_text import trc_text
from mocap_skel.fit import fit_skeleton
from mocap_skel.labels.association import associate, read_association
from mocap_skel.readers import read_clip
from mocap_skel.rig.animation import animate

# Frames for inverse kinematics.
SOLVED = 300
# How much larger its marker residual may be than ours.
LARGER = 1.1
MASS = 70.0


def written(calls: list[str], folder: Path) -> Iterator[tuple[str, Path, np.ndarray, list[str]]]:
    """Name, path without suffix, our joints (frames, n, 3) y up, and the bodies' names, of each clip, subject and rig."""
    for call in calls or CLIPS:
        path, _, association = call.partition(":")
        try:
            known = read_association(association or "cmu")
            clip = read_clip(Path(path))
            for subject in associate(clip, known):
                fit = fit_skeleton(clip, subject, known.skeleton)
                for rig in ("markers", "full"):
                    (chosen,) = choose("osim", mass=MASS, rig=rig)
                    stem = folder / f"{Path(path).stem}-{subject.subject}-{rig}"
                    made = chosen.render(fit, Source(clip, Path(path), subject))
                    source = Source(clip, Path(path), subject)
                    angles = [
                        chosen.render(fit, source).files
                        for chosen in choose(["sto", "mot"], rigid=True, rig=rig)
                    ]
                    for suffix, content in {**made.files, **angles[0], **angles[1]}.items():
                        stem.with_name(stem.name + suffix).write_text(str(content))
                    motion = animate(fit, chosen.options.choice).motion
                    start, stop = motion.stretches[0]
                    joints = motion.poses.joints(motion.model.bones).transpose(2, 1, 0)
                    turn = turn_between(fit.up, "y")
                    names = [segment.name for segment in motion.model.segments]
                    yield stem.name, stem, (joints @ turn.T)[start:stop], names
        except MocapSkelError as error:
            print(f"{call}: not compared: {error}")


def realised(
    model: opensim.Model, motion: Path, bodies: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, body origins (frames, n, 3) and markers (frames, m, 3), where OpenSim puts them."""
    state = model.initSystem()
    table = opensim.TimeSeriesTable(str(motion))
    coordinates = model.updCoordinateSet()
    columns = []
    for name in table.getColumnLabels():
        found = coordinates.get(name)
        # OpenSim's own results are as it says in their head, ours too.
        degrees = table.getTableMetaDataString("inDegrees") == "yes"
        turns = found.getMotionType() == opensim.Coordinate.Rotational
        columns.append((found, np.pi / 180.0 if turns and degrees else 1.0))
    values = table.getMatrix().to_numpy()
    frames = [model.getBodySet().get(name) for name in bodies]
    markers = [model.getMarkerSet().get(i) for i in range(model.getMarkerSet().getSize())]
    joints, places = [], []
    for row in values:
        for (coordinate, unit), value in zip(columns, row, strict=True):
            coordinate.setValue(state, float(value * unit), False)
        model.realizePosition(state)
        joints.append([frame.getPositionInGround(state).to_numpy() for frame in frames])
        places.append([marker.getLocationInGround(state).to_numpy() for marker in markers])
    return np.array(table.getIndependentColumn()), np.array(joints), np.array(places)


def recorded(path: Path) -> tuple[list[str], np.ndarray]:
    """Names and points (frames, m, 3) of a TRC, as OpenSim reads it."""
    table = opensim.TimeSeriesTableVec3(str(path))
    # A matrix is a view into its table, which has to live as long.
    flat = table.flatten()
    values = flat.getMatrix().to_numpy().copy()
    return list(table.getColumnLabels()), values.reshape(len(values), -1, 3)


def solved(model: Path, names: list[str], points: np.ndarray, rate: float) -> Path:
    """The motion that OpenSim's inverse kinematics finds for some frames of markers, by the recipe of docs/opensim.md."""
    folder = model.with_suffix("")
    folder.mkdir()
    (folder / "walk.osim").write_text(model.read_text())
    numbers = np.arange(1, len(points) + 1)
    tracks = [points.reshape(len(points), -1)]
    text = trc_text("walk.markers.trc", names, tracks, numbers, (numbers - 1) / rate, rate)
    (folder / "walk.markers.trc").write_text(str(text))
    call = [sys.executable, "-c", python_of("docs/opensim.md")]
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "walk.ik.mot"


def angles_read(stem: Path) -> tuple[int, int]:
    """Rows and columns of both files of joint angles, which both of OpenSim's readers have as they were written."""
    for end in (".angles.sto", ".angles.mot"):
        path = stem.with_name(stem.name + end)
        text = path.read_text().partition("endheader\n")[2].splitlines()
        wanted = np.array([line.split("\t") for line in text[1:]], dtype=float)
        table, storage = opensim.TimeSeriesTable(str(path)), opensim.Storage(str(path))
        assert ["time", *table.getColumnLabels()] == text[0].split("\t")
        assert storage.getSize() == len(wanted) and storage.isInDegrees()
        np.testing.assert_array_equal(table.getMatrix().to_numpy(), wanted[:, 1:])
        for i in range(0, len(wanted), 50):
            row = storage.getStateVector(i)
            values = [row.getData().get(k) for k in range(row.getSize())]
            np.testing.assert_allclose([row.getTime(), *values], wanted[i], rtol=1e-12)
    return len(wanted), wanted.shape[1] - 1


def root_mean_square(away: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean((away**2).sum(axis=2))))


def main(calls: list[str]) -> int:
    """Compare all, print a line each, and say whether one is off."""
    opensim.Logger.setLevelString("error")
    # Else it leaves opensim.log in the current folder.
    opensim.Logger.removeFileSink()
    failed, compared = False, 0
    print(f"OpenSim {opensim.GetVersion()}")
    with tempfile.TemporaryDirectory() as folder:
        for name, stem, ours, bodies in written(calls, Path(folder)):
            paths = [stem.with_name(stem.name + end) for end in (".osim", ".mot", ".markers.trc")]
            model = opensim.Model(str(paths[0]))
            time, joints, places = realised(model, paths[1], bodies)
            off = float(np.linalg.norm(joints - ours, axis=2).max())
            names, points = recorded(paths[2])
            assert names == [m.getName() for m in model.getMarkerSet()]
            mass = model.getTotalMass(model.initSystem())
            away = places - points
            print(
                f"{name}: {len(bodies)} bodies, {len(names)} markers, {mass:.3f} kg; joints {1e3 * off:.6f} mm "
                f"off at most over {len(time)} frames; markers {1e3 * root_mean_square(away):.3f} mm (rms)",
                flush=True,
            )
            rows, columns = angles_read(stem)
            print(
                f"{name}: {rows} rows of {columns} joint angles, read by TimeSeriesTable and Storage"
            )
            few = min(SOLVED, len(time))
            motion = solved(paths[0], names, points[:few], 1.0 / (time[1] - time[0]))
            _, there, found = realised(model, motion, bodies)
            assert len(found) == few, len(found)
            theirs, own = root_mean_square(found - points[:few]), root_mean_square(away[:few])
            apart = np.linalg.norm(there - ours[:few], axis=2)
            print(
                f"{name}: inverse kinematics of {few} frames: markers {1e3 * theirs:.3f} mm (rms), ours "
                f"{1e3 * own:.3f}, {theirs / own:.3f} times; joints {1e3 * np.median(apart):.2f} mm apart (median), "
                f"{1e3 * apart.max():.1f} at most",
                flush=True,
            )
            failed |= off > MOST or theirs > LARGER * own
            compared += 1
    return int(failed or not compared)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
