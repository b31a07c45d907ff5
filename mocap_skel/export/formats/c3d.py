"""C3D: a copy of the recording with the skeleton's points behind its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mocap_skel.export.animated import Tracks
from mocap_skel.export.registry import Rendered, Source, option, register

if TYPE_CHECKING:
    from mocap_skel.skeleton_fit import SkeletonFit


@dataclass(frozen=True)
class C3dOptions(Tracks):
    """What a C3D may be told.

    Attributes:
        axes: whether it has the segments' axes too.
    """

    axes: bool = option(
        False,
        "also each segment's origin and the tips of its anatomical axes (x forward, y up, z right), and the axes on "
        "which joints turn.",
    )


@register(
    "c3d",
    suffixes=(".skeleton.c3d",),
    options=C3dOptions,
    makes="walk.skeleton.c3d, a copy of the clip with the skeleton's points behind its own",
    lacks="a C3D keeps the axes and the rounding of the file that it is a copy of",
)
def write(fit: SkeletonFit, options: C3dOptions, source: Source) -> Rendered:
    """The copy, read again before it is given away."""
    from mocap_skel.export.c3d_copy import c3d_copy

    fit, made = options.fit_of(fit)
    content, notes = c3d_copy(
        fit, source.clip, source.path, axes=options.axes, static=source.static
    )
    if options.up not in (None, fit.up):
        notes = (f"C3D: a copy keeps the file's axes, {fit.up} up", *notes)
    return Rendered({".skeleton.c3d": content}, (*notes, *(f"C3D: {note}" for note in made)))
