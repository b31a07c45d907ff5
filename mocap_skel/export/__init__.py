"""Result formats: what each is called, which files it makes, and how."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mocap_skel.axes import turned
from mocap_skel.export.bvh import bvh
from mocap_skel.export.tables_csv import joints_csv, skeleton_csv
from mocap_skel.fit import SkeletonFit


@dataclass(frozen=True)
class Options:
    """What a writer may be told: `up` the vertical axis, `trim` cut frames that are not complete."""

    up: str | None = None
    trim: bool = False


@dataclass(frozen=True)
class Rendered:
    """A format's files, suffix → text, the main one first, and what there is to say about them."""

    files: dict[str, str]
    notes: tuple[str, ...] = ()


def _csv(fit: SkeletonFit, options: Options) -> Rendered:
    fit = turned(fit, options.up)
    return Rendered({".skeleton.csv": skeleton_csv(fit), ".joints.csv": joints_csv(fit)})


def _bvh(fit: SkeletonFit, options: Options) -> Rendered:
    text, notes = bvh(turned(fit, options.up or "y"), trim=options.trim)
    return Rendered({".bvh": text}, notes)


WRITERS: dict[str, Callable[[SkeletonFit, Options], Rendered]] = {"csv": _csv, "bvh": _bvh}
