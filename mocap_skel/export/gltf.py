"""glTF 2.0, binary (GLB), by pygltflib: a rig as joints, their motion, and a body that moves with them.

A file holds one figure: a node for each joint, one more for each limb's end, all of them joints of one skin, so
that animation programs make an armature of them; one mesh, each corner of which moves with one joint; and
one animation. glTF has metres, y up, and the figure looks along z in its rest pose.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import AXES
from mocap_skel.export.body import Body, body, capsules
from mocap_skel.extras import extra
from mocap_skel.rig.kinematics import Rig, rest_places, shortest_turn
from mocap_skel.segments.pose import Array
from mocap_skel.version import __version__

# The material: linear red, green, blue, opacity; no metal, and rough, as skin and cloth are.
COLOUR = (0.25, 0.42, 0.6, 1.0)
ROUGHNESS = 0.7

# Names of glTF for what a component is and how many make an element.
_COMPONENTS = {"u1": 5121, "u2": 5123, "u4": 5125, "f4": 5126}
_ELEMENTS = {(): "SCALAR", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
_VERTICES, _INDICES = 34962, 34963


def glb(rig: Rig, rate: float, *, up: str = "y", title: str = "", mesh: bool = True) -> bytes:
    """A rig as the content of a .glb file.

    Joints keep their names, a limb's end is called as its joint with `_end` behind it. Without frames there is no
    animation. Numbers are single precision: a joint 3 m from the origin is right to a micrometre.

    Args:
        rig: lengths in metres.
        rate: frames a second; the first frame is at 0 s.
        up: the rig's vertical axis; it becomes y by the shortest turn.
        title: what figure and animation are called.
        mesh: also a body of capsules; without it there is nothing to see but joints.

    Raises:
        MissingExtraError: pygltflib is not installed.
        ValueError: `up` is no axis.

    >>> offsets = np.array([[0.0, 0.9, 0.0], [0.0, -0.4, 0.0]])
    >>> still = np.tile(np.eye(3), (2, 1, 1, 1))
    >>> leg = Rig(("Hip", "Knee"), (-1, 0), offsets, {1: offsets[1]}, offsets[:1], still)
    >>> glb(leg, rate=100.0)[:4]
    b'glTF'
    """
    rig = _y_up(rig, up)
    lib = extra("pygltflib", "gltf")
    file = _File(lib, lib.GLTF2(asset=lib.Asset(generator=f"mocap-skel {__version__}")))
    gltf = file.gltf
    joints = file.joints(rig)
    gltf.nodes.append(lib.Node(name=title or "Figure", children=[0]))
    gltf.scenes, gltf.scene = [lib.Scene(nodes=[len(joints)])], 0
    parts = capsules(rig) if mesh else []
    if parts:
        # Beside the figure, not below it: a skinned mesh follows its joints only.
        gltf.scenes[0].nodes.append(file.body(body(parts), rig))
    if len(rig.position):
        file.animation(rig, rate, title or "Motion")
    return file.content()


def _y_up(rig: Rig, up: str) -> Rig:
    """The rig in axes with y up."""
    if up not in AXES:
        raise ValueError(f"up must be one of {AXES}, got {up!r}")
    turn = shortest_turn(np.eye(3)[AXES.index(up)], np.array([0.0, 1.0, 0.0]))
    return replace(
        rig,
        offsets=rig.offsets @ turn.T,
        ends={i: end @ turn.T for i, end in rig.ends.items()},
        position=rig.position @ turn.T,
        rotation=turn @ rig.rotation @ turn.T,
    )


def quaternions(rotation: Array) -> Array:
    """Unit quaternions (frames, 4), x, y, z, w, of rotations (frames, 3, 3), without jumps of sign.

    A rotation has two quaternions, q and -q. Players interpolate between neighbours, so each is the one
    nearer to that before it; the first has w ≥ 0.

    >>> quaternions(np.diag([-1.0, -1.0, 1.0])[None])
    array([[0., 0., 1., 0.]])
    """
    # 4 q qᵀ; its column with the largest diagonal is q, well-conditioned.
    xx, yy, zz = np.moveaxis(np.diagonal(rotation, axis1=1, axis2=2), -1, 0)
    square = np.empty((len(rotation), 4, 4))
    square[:, :3, :3] = rotation + rotation.transpose(0, 2, 1)
    for k, value in enumerate((xx - yy - zz, yy - xx - zz, zz - xx - yy, xx + yy + zz)):
        square[:, k, k] = 1.0 + value
    for k, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):
        square[:, k, 3] = square[:, 3, k] = rotation[:, i, j] - rotation[:, j, i]
    best = np.diagonal(square, axis1=1, axis2=2).argmax(axis=1)
    found = square[np.arange(len(square)), best]
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    steps = (found[1:] * found[:-1]).sum(axis=1)
    signs = np.concatenate([found[:1, 3], steps])
    return np.asarray(found * np.cumprod(np.where(signs < 0, -1.0, 1.0))[:, None])


class _File:
    """A glTF document with its numbers, each array in a view of its own."""

    def __init__(self, lib: Any, gltf: Any):
        self.lib, self.gltf = lib, gltf
        self.data = bytearray()

    def joints(self, rig: Rig) -> list[int]:
        """Add the nodes and the skin; the joints first, in the rig's order, then the ends."""
        count = len(rig.names)
        places, ends = rest_places(rig)
        for i, name in enumerate(rig.names):
            node = self.lib.Node(name=name, translation=rig.offsets[i].tolist())
            node.children = rig.children(i)
            self.gltf.nodes.append(node)
        for k, (i, end) in enumerate(rig.ends.items()):
            self.gltf.nodes[i].children.append(count + k)
            self.gltf.nodes.append(
                self.lib.Node(name=f"{rig.names[i]}_end", translation=end.tolist())
            )
        joints = list(range(len(self.gltf.nodes)))
        # Column by column: from the rest pose's places to the joint's own axes.
        still = np.tile(np.eye(4), (len(joints), 1, 1))
        still[:, 3, :3] = -np.concatenate([places, *([end] for end in ends.values())])
        skin = self.lib.Skin(inverseBindMatrices=self.add(still, "f4"), joints=joints, skeleton=0)
        self.gltf.skins.append(skin)
        return joints

    def body(self, shape: Body, rig: Rig) -> int:
        """Add the mesh, its material and its node, whose index it gives."""
        lib, few = self.lib, "u1" if len(rig.names) <= 256 else "u2"
        moved_by, weights = np.zeros((2, len(shape.points), 4), np.int64)
        moved_by[:, 0], weights[:, 0] = shape.joints, 255
        attributes = lib.Attributes(
            POSITION=self.add(shape.points, "f4", _VERTICES, bounds=True),
            NORMAL=self.add(shape.normals, "f4", _VERTICES),
            JOINTS_0=self.add(moved_by, few, _VERTICES),
            WEIGHTS_0=self.add(weights, "u1", _VERTICES, normalized=True),
        )
        short = "u2" if len(shape.points) < 65535 else "u4"
        indices = self.add(shape.triangles.ravel(), short, _INDICES)
        look = lib.PbrMetallicRoughness(
            baseColorFactor=list(COLOUR), metallicFactor=0.0, roughnessFactor=ROUGHNESS
        )
        self.gltf.materials.append(lib.Material(name="Body", pbrMetallicRoughness=look))
        part = lib.Primitive(attributes=attributes, indices=indices, material=0)
        self.gltf.meshes.append(lib.Mesh(name="Body", primitives=[part]))
        self.gltf.nodes.append(lib.Node(name="Body", mesh=0, skin=0))
        return len(self.gltf.nodes) - 1

    def animation(self, rig: Rig, rate: float, name: str) -> None:
        """Add the motion: where the root is, and how each joint is turned."""
        lib, motion = self.lib, self.lib.Animation(name=name)
        times = self.add(np.arange(len(rig.position)) / rate, "f4", bounds=True)
        tracks = [(0, "translation", rig.position)]
        tracks += [(i, "rotation", quaternions(turn)) for i, turn in enumerate(rig.rotation)]
        for k, (node, path, values) in enumerate(tracks):
            target = lib.AnimationChannelTarget(node=node, path=path)
            motion.channels.append(lib.AnimationChannel(sampler=k, target=target))
            motion.samplers.append(lib.AnimationSampler(input=times, output=self.add(values, "f4")))
        self.gltf.animations.append(motion)

    def add(
        self,
        values: NDArray[Any],
        kind: str,
        target: int | None = None,
        *,
        bounds: bool = False,
        normalized: bool = False,
    ) -> int:
        """Add an array (elements, ...) and give the index of its accessor."""
        lib = self.lib
        array = np.ascontiguousarray(values, f"<{kind}")
        view = lib.BufferView(
            buffer=0, byteOffset=len(self.data), byteLength=array.nbytes, target=target
        )
        self.data += array.tobytes() + bytes(-array.nbytes % 4)
        accessor = lib.Accessor(
            bufferView=len(self.gltf.bufferViews),
            componentType=_COMPONENTS[kind],
            count=len(array),
            type=_ELEMENTS[array.shape[1:]],
            normalized=normalized,
        )
        if bounds:
            rows = array.reshape(len(array), -1)
            accessor.min, accessor.max = rows.min(axis=0).tolist(), rows.max(axis=0).tolist()
        self.gltf.bufferViews.append(view)
        self.gltf.accessors.append(accessor)
        return len(self.gltf.accessors) - 1

    def content(self) -> bytes:
        self.gltf.buffers = [self.lib.Buffer(byteLength=len(self.data))]
        self.gltf.set_binary_blob(bytes(self.data))
        return b"".join(self.gltf.save_to_bytes())
