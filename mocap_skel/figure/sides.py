"""Left and right in the names of segments and joints."""

from __future__ import annotations

OTHER = {"Left": "Right", "Right": "Left"}


def other_side(name: str) -> str:
    """The same segment or joint of the other side; a name without a side is its own.

    Example:
        >>> other_side("UpperLeftArm"), other_side("Chest")
        ('UpperRightArm', 'Chest')
    """
    for side, other in OTHER.items():
        if side in name:
            return name.replace(side, other)
    return name
