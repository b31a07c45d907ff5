"""Result formats: what each is called, which files it makes, and how."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mocap_skel.axes import turned
from mocap_skel.export.bvh import CENTIMETRES, bvh
from mocap_skel.export.tables_csv import joints_csv, skeleton_csv
from mocap_skel.fit import SkeletonFit


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
    """

    up: str | None = None
    trim: bool = False
    rotation_order: str = "ZXY"
    scale: float = CENTIMETRES
    names: str = "mocap"
    floor: bool = False
    root_at_origin: bool = False


@dataclass(frozen=True)
class Rendered:
    """A format's files, suffix → text, the main one first, and what there is to say about them."""

    files: dict[str, str]
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


WRITERS: dict[str, Callable[[SkeletonFit, Options], Rendered]] = {"csv": _csv, "bvh": _bvh}
