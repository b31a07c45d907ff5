"""Blender against the model's own forward kinematics: `make blender`, opt-in, for it needs bpy (0.4 GB).

Fits clips, writes them as BVH, imports each into a Blender without a window and compares where Blender puts
every joint and every end of a limb at ten frames, in millimetres. Run by hand:

    python tests/blender_check.py CLIP.c3d[:ASSOCIATION] ...

It ends with 1 where a joint is more than 1 mm off.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from mocap_skel.errors import MocapSkelError
from mocap_skel.export.formats.bvh import bvh_text
from mocap_skel.export.joint_names import joint_names
from mocap_skel.fit import fit_skeleton
from mocap_skel.labels.association import associate, read_association
from mocap_skel.readers import read_clip
from mocap_skel.results.axes import turned
from mocap_skel.rig.kinematics import forward, rest_places
from mocap_skel.rig.rigging import rig_of

SAMPLES = Path(__file__).parent.parent / "sample_data"
CLIPS = [f"{SAMPLES}/{name}.c3d:cmu" for name in ("range_of_motion", "two_dancers", "nearly_still")]
FRAMES = 10
MOST = 1e-3

# Blender writes to standard output as it likes, so the answer goes to a file. It runs in a process of its own.
BLENDER = """
import sys
import bpy
import numpy as np
source, target, *frames = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_anim.bvh(filepath=source, rotate_mode="NATIVE", update_scene_fps=True)
figure = bpy.context.object
names = [bone.name for bone in figure.data.bones]
turn = figure.matrix_world
rest = [[turn @ b.head_local, turn @ b.tail_local] for b in figure.data.bones]
moving = []
for frame in map(int, frames):
    bpy.context.scene.frame_set(frame + 1)
    bones = [figure.pose.bones[name] for name in names]
    moving.append([[turn @ b.head, turn @ b.tail] for b in bones])
scene = bpy.context.scene
fps = scene.render.fps / scene.render.fps_base
np.savez(target, names=names, rest=np.array(rest), moving=np.array(moving), fps=fps,
         version=bpy.app.version_string)
"""


def compare(call: str, folder: Path) -> list[tuple[str, float]]:
    """Rows of (what, largest distance in metres) for a clip and its association."""
    path, _, association = call.partition(":")
    known = read_association(association or "cmu")
    clip = read_clip(Path(path))
    rows = []
    for subject in associate(clip, known):
        fit = turned(fit_skeleton(clip, subject, known.skeleton), "y")
        for order, names in (("ZXY", "mocap"), ("XYZ", "mixamo")):
            rig, segments, _ = rig_of(fit, trim=True)
            called, _ = joint_names(segments, names)
            rig = type(rig)(**{**vars(rig), "names": called})
            source, target = folder / "clip.bvh", folder / "answer.npz"
            source.write_text(bvh_text(rig, fit.rate, order))
            frames = np.linspace(0, len(rig.position) - 1, FRAMES).astype(int)
            subprocess.run(
                [sys.executable, "-c", BLENDER, str(source), str(target), *map(str, frames)],
                check=True,
                stdout=subprocess.DEVNULL,
                timeout=300,
            )
            found = np.load(target)
            where = [called.index(name) for name in found["names"]]
            joints, ends = forward(rig)
            still, still_ends = rest_places(rig)
            away = [apart(found["moving"][..., 0, :], joints[where][:, frames].swapaxes(0, 1))]
            away.append(apart(found["rest"][:, 0], still[where]))
            for i, name in enumerate(where):
                if name in ends:
                    away.append(apart(found["moving"][:, i, 1], ends[name][frames]))
                    away.append(apart(found["rest"][i, 1], still_ends[name]))
            what = (
                f"{Path(path).name} {subject.subject or '-'}: {len(where)} joints, {len(ends)} ends, "
                f"{order}, {names}, {float(found['fps']):.4f} fps (clip {fit.rate:g}), "
                f"Blender {found['version']}"
            )
            rows.append((what, max(away)))
    return rows


def apart(blender: np.ndarray, ours: np.ndarray) -> float:
    """Largest distance; Blender's z is up, and centimetres are its units."""
    x, y, z = np.moveaxis(blender / 100.0, -1, 0)
    return float(np.linalg.norm(np.stack([x, z, -y], axis=-1) - ours, axis=-1).max())


def main(calls: list[str]) -> int:
    """Compare all, print a line each, and say whether one is off."""
    worst, compared = 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        for call in calls or CLIPS:
            try:
                rows = compare(call, Path(folder))
            except MocapSkelError as error:
                print(f"{call}: not compared: {error}")
                continue
            for what, most in rows:
                print(f"{what}: {1e3 * most:.4f} mm at most over {FRAMES} frames and the rest pose")
                worst, compared = max(worst, most), compared + 1
    return int(worst > MOST or not compared)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
