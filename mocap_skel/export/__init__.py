"""Result formats: what each is called, which files it makes, and how.

Here belongs one module a format, and the writing of files whole or not at all. It may import `rig`,
`results` and what stands below them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError
from mocap_skel.export.bvh import CENTIMETRES, bvh
from mocap_skel.export.tables_csv import joints_csv, skeleton_csv
from mocap_skel.results.axes import turned
from mocap_skel.skeleton_fit import SkeletonFit


@dataclass(frozen=True)
class Options:
    """What a writer may be told.

    Attributes:
        up: the vertical axis; None = the format's own, or the clip's.
        trim: bvh: leave out frames at both ends that are not complete.
        rotation_order: bvh: of the rotation channels.
        scale: bvh: units of the file in a metre.
        names: bvh: how the joints are called, one of `joint_names.NAMINGS`.
        floor: bvh: put the figure's lowest point over the clip at zero.
        root_at_origin: bvh: root OFFSET zero, for readers that add it to the position.
        axes: c3d: also the segments' axes.
        markers: trc: also the markers.
        clip: what was fitted, for writers that give more of it than the fit has (c3d, trc).
        path: the clip's file, of which c3d makes a copy.
    """

    up: str | None = None
    trim: bool = False
    rotation_order: str = "ZXY"
    scale: float = CENTIMETRES
    names: str = "mocap"
    floor: bool = False
    root_at_origin: bool = False
    axes: bool = False
    markers: bool = False
    clip: Clip | None = None
    path: Path | None = None


@dataclass(frozen=True)
class Rendered:
    """A format's files, suffix → text, the main one first, and what there is to say about them."""

    files: dict[str, str | bytes]
    notes: tuple[str, ...] = ()


def _csv(fit: SkeletonFit, options: Options) -> Rendered:
    fit = turned(fit, options.up)
    return Rendered({".skeleton.csv": skeleton_csv(fit), ".joints.csv": joints_csv(fit)})


def _bvh(fit: SkeletonFit, options: Options) -> Rendered:
    text, notes = bvh(
        turned(fit, options.up or "y"),
        trim=options.trim,
        order=options.rotation_order,
        scale=options.scale,
        names=options.names,
        floor=options.floor,
        root_at_origin=options.root_at_origin,
    )
    return Rendered({".bvh": text}, notes)


def _c3d(fit: SkeletonFit, options: Options) -> Rendered:
    from mocap_skel.export.c3d_copy import c3d_copy

    if options.clip is None or options.path is None:
        raise CallError("a C3D is a copy of the clip's file", "give Options its clip and path")
    content, notes = c3d_copy(fit, options.clip, options.path, axes=options.axes)
    if options.up not in (None, fit.up):
        notes = (f"C3D: a copy keeps the file's axes, {fit.up} up", *notes)
    return Rendered({".skeleton.c3d": content}, notes)


def _trc(fit: SkeletonFit, options: Options) -> Rendered:
    from mocap_skel.export.trc import trc

    if options.markers and options.clip is None:
        raise CallError("the markers are not in the fit", "give Options its clip")
    suffix = ".skeleton.trc"
    name = f"{Path(fit.clip).stem}{suffix}"
    markers = options.clip if options.markers else None
    text, notes = trc(fit, name, options.up or "y", markers)
    return Rendered({suffix: text}, notes)


def _parquet(fit: SkeletonFit, options: Options) -> Rendered:
    from mocap_skel.export.parquet import joints_parquet, skeleton_parquet

    fit = turned(fit, options.up)
    files = {".skeleton.parquet": skeleton_parquet(fit), ".joints.parquet": joints_parquet(fit)}
    return Rendered({**files})


WRITERS: dict[str, Callable[[SkeletonFit, Options], Rendered]] = {
    "csv": _csv, "bvh": _bvh, "c3d": _c3d, "trc": _trc, "parquet": _parquet,
}  # fmt: skip
