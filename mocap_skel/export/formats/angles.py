"""Angles: joint angles in every frame, in degrees, as CSV."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mocap_skel.errors import ExportError
from mocap_skel.export.animated import Tracks
from mocap_skel.export.registry import Rendered, Source, register

if TYPE_CHECKING:
    from mocap_skel.skeleton_fit import SkeletonFit

SUFFIX = ".angles.csv"


@dataclass(frozen=True)
class AngleOptions(Tracks):
    """What angles may be told: as tracks, those of the rigid figure."""


@register(
    "angles",
    suffixes=(SUFFIX,),
    options=AngleOptions,
    makes=f"walk{SUFFIX}, the joint angles in every frame, in degrees",
    lacks="a table of angles has no places, so it cannot be turned back into a moving figure",
)
def write(fit: SkeletonFit, options: AngleOptions, source: Source) -> Rendered:
    """The angles of a fit; the static clip's mean pose is neutral, where there is one.

    Raises:
        ExportError: the figure has no joint whose angles are defined.
    """
    from mocap_skel.angles.joint_angles import joint_angles
    from mocap_skel.export.tables_csv import angles_csv

    fit, made = options.fit_of(fit)
    angles = joint_angles(fit, source.static)
    if not angles.joints:
        raise ExportError(
            f"{fit.clip}: no joint of the figure {fit.skeleton.name} has angles that are defined",
            "docs/angles.md lists those that are, and the landmarks that they need",
        )
    notes = tuple(f"angles: {note}" for note in (*made, *angles.notes))
    return Rendered({SUFFIX: angles_csv(angles)}, notes)
