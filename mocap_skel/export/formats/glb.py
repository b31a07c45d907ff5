"""Binary glTF (GLB): the moving figure with a simple body, for Blender, three.js and browsers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mocap_skel.export.animated import Animated, rigs_of
from mocap_skel.export.registry import Rendered, Source, option, register

if TYPE_CHECKING:
    from mocap_skel.skeleton_fit import SkeletonFit


@dataclass(frozen=True)
class GlbOptions(Animated):
    """What a GLB may be told, beside what every moving figure may. Its vertical is y, its unit the metre.

    Attributes:
        no_body: bones only.
    """

    no_body: bool = option(False, "bones only, no body of capsules around them.")


@register(
    "glb",
    suffixes=(".glb",),
    options=GlbOptions,
    makes="walk.glb, the moving figure with a body",
    lacks="a GLB cannot say that something is missing",
    needs=("pygltflib", "gltf"),
)
def write(fit: SkeletonFit, options: GlbOptions, source: Source) -> Rendered:
    """The figure at rest in a T-pose, skinned, and its animation.

    Raises:
        ExportError: there are no two frames in a row in which the figure is known.
        MissingExtraError: pygltflib is not installed.
    """
    from mocap_skel.export.gltf import glb
    from mocap_skel.text import stem

    rigs, notes = rigs_of(fit, options, "y")
    title = f"{stem(source.path)} {fit.subject}".strip()
    files: dict[str, str | bytes] = {
        f"{part}.glb": glb(rig, fit.rate, title=title, mesh=not options.no_body)
        for part, rig in rigs.items()
    }
    return Rendered(files, tuple(f"GLB: {note}" for note in notes))
