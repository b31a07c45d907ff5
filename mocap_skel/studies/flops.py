"""The thesis's counts of floating-point operations, for a frame (its (239) to (257)) and for a sample."""

from __future__ import annotations

# (239): one three-point coordinate system; (243): one rotation point carried to the lab.
FRAME = 39
POINT = 18
# Operations for each sample of a sphere fit (Table 4); the MLE's depend on its turns.
PER_SAMPLE = {"gdke": 26, "ugdk": 26, "igdk": 123, "lls": 236}


def frame_flops(markers: int, parent: int = 0) -> int:
    """Operations for one segment's coordinate system: (239) three markers, (247) two, (256) one.

    Args:
        markers: of the segment; more than three count as three.
        parent: what the parent's own system costs, where it has to be made for this one (FLOP_p).

    Raises:
        ValueError: no marker, for which the thesis has no case.

    Example:
        >>> from mocap_skel.studies.flops import frame_flops
        >>> frame_flops(3), frame_flops(2, parent=frame_flops(3))
        (39, 96)
    """
    if markers < 1:
        raise ValueError("a segment without a marker has no coordinate system")
    return FRAME if markers >= 3 else (57 if markers == 2 else 54) + parent


def figure_flops(segments: int, leaves: int, two: int = 0, one: int = 0) -> int:
    """Operations for a whole figure in one time frame: (240), (248) and (257) in one.

    (257) counts a segment of one marker like one of two, 39 + 18; (256) makes it 54, three less.

    Args:
        segments: N_s.
        leaves: N_L, the segments without a child, whose rotation points nobody needs.
        two, one: N_2 and N_1, segments of two markers and of one, which need their joint as well.

    Example:
        >>> from mocap_skel.studies.flops import figure_flops
        >>> figure_flops(segments=14, leaves=5)  # (241)
        708
    """
    return FRAME * segments + POINT * (segments - leaves + two + one)
