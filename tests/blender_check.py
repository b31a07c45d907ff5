"""Blender against the model's own forward kinematics: `make blender`, opt-in, for it needs bpy (0.4 GB).

Fits clips, writes them as BVH and GLB, and with the recipe of docs/blender.md makes FBX and USD of both.
Imports each into a Blender without a window and compares where Blender puts every joint and every end of a
limb at ten frames, and the body's surface of a GLB, in millimetres. Run by hand:

    python tests/blender_check.py CLIP.c3d[:ASSOCIATION] ...

It ends with 1 where a point is more than 1 mm off.
"""

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from doc_blocks import python_of
from figures import FRAMES, MOST, Figure, corners, figures, moving, resting

from mocap_skel.export.formats.bvh import bvh_text
from mocap_skel.export.gltf import glb

# Blender writes to standard output as it likes, so the answer goes to a file. It runs in a process of its own.
READ = """
import sys
import bpy
import numpy as np
source, target, rate, *frames = sys.argv[1:]
rate = float(rate)
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps, scene.render.fps_base = round(rate), round(rate) / rate
kind = source.rpartition(".")[2]
if kind == "bvh":
    bpy.ops.import_anim.bvh(filepath=source, rotate_mode="NATIVE", update_scene_fps=True)
elif kind == "glb":
    bpy.ops.import_scene.gltf(filepath=source, disable_bone_shape=True)
elif kind == "fbx":
    bpy.ops.import_scene.fbx(filepath=source)
else:
    bpy.ops.wm.usd_import(filepath=source)
figure, = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
body = [thing for thing in bpy.data.objects if thing.type == "MESH"]
turn = figure.matrix_world
names = [bone.name for bone in figure.data.bones]
rest = [[turn @ b.head_local, turn @ b.tail_local] for b in figure.data.bones]
moving, surface = [], []
first = int(bpy.data.actions[0].frame_range[0])
for frame in map(int, frames):
    scene.frame_set(first + frame)
    bones = [figure.pose.bones[name] for name in names]
    moving.append([[turn @ b.head, turn @ b.tail] for b in bones])
    for thing in body:
        made = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
        surface.append([made.matrix_world @ v.co for v in made.data.vertices])
fps = scene.render.fps / scene.render.fps_base
np.savez(target, names=names, rest=np.array(rest), moving=np.array(moving), surface=np.array(surface),
         fps=fps, version=bpy.app.version_string)
"""


def compare(figure: Figure, folder: Path) -> Iterator[tuple[str, float]]:
    """Rows of (what, largest distance in metres) for every format."""
    rig = figure.rig
    order = "ZXY" if figure.naming == "mocap" else "XYZ"
    paths = [folder / "clip.bvh", folder / "clip.glb"]
    paths[0].write_text(bvh_text(rig, figure.rate, order))
    paths[1].write_bytes(glb(rig, figure.rate, title=figure.name))
    for source in paths:
        yield from compare_file(figure, source, source)
        # Once for each figure; names with colons are the harder ones.
        for suffix in (".fbx", ".usdc") if figure.naming == "mixamo" else ():
            target = source.with_suffix(suffix)
            recipe = python_of("docs/blender.md")
            blender(recipe, source, target, figure.rate)
            yield from compare_file(figure, target, source)


def compare_file(figure: Figure, path: Path, source: Path) -> Iterator[tuple[str, float]]:
    """A row for a file, made directly or from `source`."""
    rig, frames, kind = figure.rig, figure.frames, path.suffix
    answer = path.with_suffix(".npz")
    blender(READ, path, answer, figure.rate, *frames)
    found = np.load(answer)
    names = [str(name) for name in found["names"]]
    # BVH has centimetres; the recipe makes metres of them.
    unit = 100.0 if kind == ".bvh" else 1.0
    # The names of USD have no colons.
    plain = (lambda name: re.sub(r"\W", "_", name)) if kind == ".usdc" else str
    tracks = {plain(name): track[frames] for name, track in moving(rig).items()}
    still = {plain(name): place for name, place in resting(rig).items()}
    away = []
    for i, name in enumerate(names):
        away.append(apart(found["moving"][:, i, 0] / unit, tracks[name]))
        end = f"{name}_end"
        if source.suffix == ".bvh" and kind != ".fbx" and end in tracks:
            away.append(apart(found["moving"][:, i, 1] / unit, tracks[end]))
        if path == source:
            away.append(apart(found["rest"][i, 0] / unit, still[name]))
            if kind == ".bvh" and end in still:
                away.append(apart(found["rest"][i, 1] / unit, still[end]))
    if source.suffix == ".glb":
        assert set(names) == set(tracks)
        chosen, places = corners(rig, frames)
        away.append(apart(found["surface"][:, chosen], places))
    else:
        assert set(names) == {plain(name) for name in rig.names}
    if kind == ".bvh":
        assert abs(float(found["fps"]) / figure.rate - 1) < 1e-3
    made = "" if path == source else f" from {source.suffix[1:]}"
    what = (
        f"{figure.name}, {figure.naming}: {kind[1:]}{made}, {len(names)} bones, {figure.rate:g} fps, "
        f"Blender {found['version']}"
    )
    yield what, max(away)


def blender(script: str, *words: object) -> None:
    """Run a script in a Blender without a window."""
    call = [sys.executable, "-c", script, *map(str, words)]
    done = subprocess.run(call, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


def apart(there: np.ndarray, ours: np.ndarray) -> float:
    """Largest distance; Blender's z is up."""
    x, y, z = np.moveaxis(there, -1, 0)
    return float(np.linalg.norm(np.stack([x, z, -y], axis=-1) - ours, axis=-1).max())


def main(calls: list[str]) -> int:
    """Compare all, print a line each, and say whether one is off."""
    worst, compared = 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        for figure in figures(calls, ("mocap", "mixamo", "unreal")):
            for what, most in compare(figure, Path(folder)):
                print(f"{what}: {1e3 * most:.4f} mm at most over {FRAMES} frames", flush=True)
                worst, compared = max(worst, most), compared + 1
    return int(worst > MOST or not compared)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
