"""Numbers and counts of frames: a C3D header has 16 bits for them, larger ones stand elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.readers.formats.c3d.contents import Groups, number

WORD = 0xFFFF
"""The largest number of 16 bits."""


def first_frame(header: int, groups: Groups) -> int:
    """The number of the first frame.

    Args:
        header: what the header says, counted from 1.
        groups: the file's parameters; TRIAL:ACTUAL_START_FIELD has 32 bits.
    """
    start = _long(groups.get("TRIAL", {}).get("ACTUAL_START_FIELD"))
    # A clip cut out of a longer take may keep the take's number: believed where the header's is the
    # same as far as 16 bits go, or at their end.
    return start if start > WORD and header in (start & WORD, WORD) else header


def frame_count(
    claims: list[int], first: int, groups: Groups, room: int, fills: Callable[[int], bool]
) -> int:
    """How many frames a file says it has, where counters of 16 bits may have cut the number short.

    Args:
        claims: frames by POINT:FRAMES and by the header, without those that say nothing.
        first: the number of the first frame.
        groups: the file's parameters; POINT:LONG_FRAMES and TRIAL:ACTUAL_…_FIELD are longer. PhaseSpace
            writes the right count there only.
        room: whole frames for which the file has the bytes.
        fills: whether so many frames end where the file does.

    Returns:
        More than `room` where no claim is that small. Where only the size of the file tells, the
        padding of its last block counts as frames: see `without_padding`.
    """
    longer = long_counts(groups)
    counted = claims[0] if claims else 0
    # A cut clip may keep the take's numbers here too: only a count that 16 bits cannot hold and
    # that the file has the bytes for is believed, or one that the short counters are the rest of.
    held = [n for n in longer if counted < n <= room and first + n - 1 > WORD]
    if held:
        return max(held)
    cut = [n for n in longer if n > WORD and all(c in (WORD, n & WORD) for c in claims)]
    if claims and cut:
        return max(cut)
    # Of the longer counts too, where no short one ends where the file does.
    exact = [n for n in claims if fills(n)] or [n for n in longer if fills(n)]
    if exact:
        return max(exact)
    # ezc3d writes a longer clip with -1 for its length and nothing beside it.
    if counted == WORD and (room >= WORD or len(claims) < 2):
        return max(room, WORD)
    fitting = [n for n in claims if n <= room]
    return fitting[0] if fitting else min(claims, default=room)


def long_counts(groups: Groups) -> list[int]:
    """Frames by the parameters of 32 bits: POINT:LONG_FRAMES, and the last number less the first.

    PhaseSpace has the numbers in POINT, all others in TRIAL.
    """
    found = [int(number(groups.get("POINT", {}).get("LONG_FRAMES")))]
    for name in ("TRIAL", "POINT"):
        group = groups.get(name, {})
        start, end = (group.get(f"ACTUAL_{at}_FIELD") for at in ("START", "END"))
        if start is not None and end is not None and _long(end) > 0:
            found.append(_long(end) - _long(start) + 1)
    return [n for n in found if n > 0]


def without_padding(data: NDArray[Any], said: int) -> int:
    """How many frames there are without the blank ones at the end, past those that are sure.

    Args:
        data: (frames, …), what is in each frame; nothing but zeros is blank, NaN is not.
        said: frames by the smallest counter that the file has.
    """
    past = data[said:]
    used = np.flatnonzero(past.any(axis=tuple(range(1, past.ndim))))
    return len(data) - len(past) + (int(used[-1]) + 1 if len(used) else 0)


def unsigned(value: Any) -> int:
    """A number of 16 bits that some write with a sign; larger ones as they are, 0 without one."""
    found = int(number(value))
    return found & WORD if found < 0 else found


def _long(value: Any) -> int:
    """A number in two words, the low one first, or in one value; 0 without it."""
    words = np.atleast_1d(value if value is not None else []).ravel()
    if len(words) != 2:
        return int(number(words))
    low, high = (int(number(word)) & WORD for word in words)
    return low + (high << 16)
