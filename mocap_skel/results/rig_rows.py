"""The quality of a rigid figure as rows, the one source of its JSON and its tables."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocap_skel.rig.quality import Quality

# What a line of JSON that is about a segment of a rigid figure says of itself: others are `tables.JOINT_TABLE`.
RIG_TABLE = "rig quality"


def rig_rows(quality: Quality) -> list[dict[str, Any]]:
    """One row a segment of a rigid figure: how far its markers are off, how fast it turns, how it stands.

    Returns:
        The attributes of `rig.quality.SegmentQuality` → value, metres and degrees to six and one decimals; None =
        nothing to measure it by. `look_at` has the names of those that a person should look at.
    """
    digits = {"turn_speed": 1}
    return [
        {
            key: round(value, digits.get(key, 6)) if isinstance(value, float) else value
            for key, value in asdict(one).items()
        }
        for one in quality.segments
    ]
