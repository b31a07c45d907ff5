"""CSV: skeleton.csv, the joints in every frame, and joints.csv, each joint with its evidence."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocap_skel.export.animated import Tracks
from mocap_skel.export.registry import Rendered, Source, register

if TYPE_CHECKING:
    from mocap_skel.skeleton_fit import SkeletonFit


@register(
    "csv",
    suffixes=(".skeleton.csv", ".joints.csv"),
    options=Tracks,
    makes="walk.skeleton.csv (the joints in every frame) and walk.joints.csv (each joint with its evidence)",
    lacks="a CSV has points only, not how the segments turn; it does not say its unit, which is the metre",
)
def write(fit: SkeletonFit, options: Tracks, source: Source) -> Rendered:
    """Both tables of a fit."""
    from mocap_skel.export.tables_csv import joints_csv, skeleton_csv
    from mocap_skel.results.axes import turned

    del source
    fit, notes = options.fit_of(fit)
    fit = turned(fit, options.up)
    return Rendered(
        {".skeleton.csv": skeleton_csv(fit), ".joints.csv": joints_csv(fit)},
        tuple(f"CSV: {note}" for note in notes),
    )
