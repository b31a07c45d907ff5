"""three.js against the model's own forward kinematics: `make three`, opt-in, for it needs node, npm and Chromium.

Fits clips, writes them as GLB, loads each with three.js's own GLTFLoader in a Chromium without a window, and
compares where every joint, every end of a limb and the body's surface are at ten frames, in millimetres. Run by
hand, with `--pictures FOLDER` to look at them:

    python tests/three_check.py [--pictures FOLDER] CLIP.c3d[:ASSOCIATION] ...

It ends with 1 where a point is more than 1 mm off.
"""

import argparse
import base64
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from browser import Browser
from figures import FRAMES, MOST, Figure, corners, figures, moving

from mocap_skel.export.gltf import glb

WEB = Path(__file__).parent.parent / "web"
PAGE = """
import * as three from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

async function load() {
  const bytes = Uint8Array.from(atob(document.getElementById('glb').textContent), (c) => c.charCodeAt(0));
  const gltf = await new GLTFLoader().parseAsync(bytes.buffer, '');
  const mixer = new three.AnimationMixer(gltf.scene);
  const action = mixer.clipAction(gltf.animations[0]);
  // At its last frame it stays there; a loop would be at the first again.
  action.setLoop(three.LoopOnce);
  action.clampWhenFinished = true;
  const meshes = [];
  gltf.scene.traverse((node) => node.isSkinnedMesh && meshes.push(node));
  const [mesh] = meshes;
  mesh.frustumCulled = false;
  const scene = new three.Scene();
  scene.background = new three.Color(0xf2f2f2);
  const sun = new three.DirectionalLight(0xffffff, 2.2);
  sun.position.set(2, 4, 3);
  const grid = new three.GridHelper(8, 16, 0x999999, 0xcccccc);
  scene.add(new three.HemisphereLight(0xffffff, 0x888888, 1.6), sun, gltf.scene, grid);
  const renderer = new three.WebGLRenderer({ antialias: true });
  renderer.setSize(innerWidth, innerHeight);
  document.body.append(renderer.domElement);
  const camera = new three.PerspectiveCamera(35, innerWidth / innerHeight, 0.05, 100);
  const at = new three.Vector3();
  const go = (time) => { action.reset().play(); mixer.setTime(time); scene.updateMatrixWorld(true); };
  window.check = {
    names: mesh.skeleton.bones.map((bone) => bone.name),
    duration: gltf.animations[0].duration,
    meshes: meshes.length,
    bones(time) {
      go(time);
      return mesh.skeleton.bones.map((bone) => bone.getWorldPosition(at).toArray());
    },
    corners(time, indices) {
      go(time);
      mesh.skeleton.update();
      return indices.map((i) => mesh.localToWorld(mesh.getVertexPosition(i, at)).toArray());
    },
    draw(time, from, size) {
      if (time < 0) { action.stop(); mesh.skeleton.pose(); } else { go(time); }
      scene.updateMatrixWorld(true);
      mesh.skeleton.bones[0].getWorldPosition(at);
      camera.position.set(...from).normalize().multiplyScalar(size).add(at);
      camera.lookAt(at);
      renderer.render(scene, camera);
    },
  };
}
load().catch((error) => { window.check = { error: String(error) }; });
"""


def page(content: bytes, script: str) -> str:
    """A page that loads nothing and holds one GLB."""
    shown = base64.b64encode(content).decode()
    return (
        '<!doctype html><meta charset="utf-8"><style>body { margin: 0 }</style><body>'
        f'<script type="text/plain" id="glb">{shown}</script>'
        f"<script>{script.replace('</script', '<' + chr(92) + '/script')}</script>"
    )


def bundle() -> str:
    """The page's script with three.js in it, from web/node_modules."""
    call = [
        "node",
        "node_modules/esbuild/bin/esbuild",
        "--bundle",
        "--format=iife",
        "--charset=utf8",
    ]
    done = subprocess.run(call, cwd=WEB, input=PAGE, capture_output=True, text=True, check=True)
    return done.stdout


def compare(
    browser: Browser, figure: Figure, script: str, folder: Path, pictures: Path | None
) -> tuple[str, float]:
    """A row of (what, largest distance in metres)."""
    content = glb(figure.rig, figure.rate, title=figure.name)
    path = folder / "figure.html"
    path.write_text(page(content, script))
    browser.call("Page.navigate", url=f"{path.resolve().as_uri()}?{figure.name}")
    here = f"location.search.slice(1) === encodeURI({json.dumps(figure.name)})"
    browser.wait(f"{here} && window.check")
    assert browser.run("check.error ?? null") is None, browser.run("check.error")
    frames, last = figure.frames, len(figure.rig.position) - 1
    tracks = np.stack(list(moving(figure.rig).values()))
    chosen, surface = corners(figure.rig, frames)
    away = []
    for k, frame in enumerate(frames):
        seconds = float(frame / figure.rate)
        bones = np.array(browser.run(f"check.bones({seconds})"))
        there = np.array(browser.run(f"check.corners({seconds}, {json.dumps(chosen.tolist())})"))
        away += [bones - tracks[:, frame], there - surface[k]]
    if pictures is not None:
        views = {"front": (0, 0.15, 1), "side": (1, 0.15, 0.05), "corner": (1, 0.5, 1)}
        for name, time in {"rest": -1.0, "middle": last / figure.rate / 2}.items():
            for view, way in views.items():
                browser.run(f"check.draw({time}, {list(way)}, 3.6)")
                browser.picture(pictures / f"{figure.name}_{name}_{view}.png")
    assert browser.run("check.meshes") == 1
    assert browser.run("check.duration") * figure.rate - last < 1e-3
    loud = [said for said in browser.messages if said[0] in ("warning", "error", "exception")]
    assert not loud, loud
    what = (
        f"{figure.name}: {len(tracks)} joints and ends, {len(chosen)} corners, {len(content)} bytes"
    )
    return what, float(max(np.linalg.norm(each, axis=1).max() for each in away))


def main() -> int:
    """Compare all, print a line each, and say whether one is off."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("clips", nargs="*")
    call = parser.parse_args()
    worst, compared, script = 0.0, 0, bundle()
    if call.pictures:
        call.pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, Browser(folder, 700, 800) as browser:
        for figure in figures(call.clips, ("mocap", "unreal")):
            what, most = compare(browser, figure, script, Path(folder), call.pictures)
            print(f"{what}: {1e3 * most:.4f} mm at most over {FRAMES} frames")
            worst, compared = max(worst, most), compared + 1
    return int(worst > MOST or not compared)


if __name__ == "__main__":
    sys.exit(main())
