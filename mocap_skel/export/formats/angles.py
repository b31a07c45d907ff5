"""Angles: joint angles in every frame, in degrees, as CSV."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocap_skel.export.angled import LACKS, AngleOptions
from mocap_skel.export.registry import Rendered, Source, register

if TYPE_CHECKING:
    from mocap_skel.skeleton_fit import SkeletonFit

SUFFIX = ".angles.csv"


@register(
    "angles",
    suffixes=(SUFFIX,),
    options=AngleOptions,
    makes=f"walk{SUFFIX}, the joint angles in every frame, in degrees",
    lacks=f"a table of angles has no places, {LACKS}",
)
def write(fit: SkeletonFit, options: AngleOptions, source: Source) -> Rendered:
    """The angles of a fit; the static clip's mean pose is neutral, where there is one.

    Raises:
        ExportError: the figure has no joint whose angles are defined.
    """
    from mocap_skel.export.tables_csv import angles_csv

    angles, notes = options.angles_of(fit, source)
    return Rendered({SUFFIX: angles_csv(angles)}, notes)
