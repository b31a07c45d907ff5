"""Damage among the points of a file that says nothing wrong of itself: a tail of zeros, lost bytes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.errors import ClipError
from mocap_skel.readers.formats.c3d.contents import Contents
from mocap_skel.readers.formats.c3d.layout import spread
from mocap_skel.readers.formats.c3d.survey import Survey
from mocap_skel.readers.raw import FARTHEST

# Blank frames at the end that no one has to explain: so many, or such a part of all.
_FEW, _PART = 10, 0.02
_CHUNK = 1 << 24
_POINTS = 24
_PROOFS = 8
# Steps that are so many usual ones are looked at, beside the widest.
_STEPS = 20.0
# A break is proved over so many frames by most values: they differ from where they
# were heading by no more than so many times what they did as many frames before, and by such a part
# less than those that stand at their places.
_APART, _MOST, _MORE, _BETTER = 3, 0.8, 4.0, 3.0
_GRID = 5e-3
# Of fewer points an exchange of two may look like lost bytes.
_ENOUGH = 4


def checked(raw: Contents, found: Survey, salvage: bool) -> Contents:
    """The clip, or what there is of it before the damage.

    Raises:
        ClipError: there is damage, and nobody asked for what is before it.
    """
    frames = min(len(raw.points), found.layout.frames)
    blank = _blank_from(found, frames)
    if frames - blank > max(_FEW, _PART * frames):
        said = f"nothing but zeros from frame {raw.first_frame + blank} on"
        if not blank or _writes_zeros(found, blank):
            raw = replace(raw, notes=(*raw.notes, f"{said}: is the file cut off there?"))
        else:
            # The last frame before them may be cut in the middle of a point.
            raw = _before(raw, blank - 1, f"{said}, as in a file that is cut off", salvage)
    with np.errstate(invalid="ignore"):
        at = _shifted_at(found, min(blank, len(raw.points)))
    if at is None:
        return raw
    why = f"damaged: bytes are lost or inserted at frame {raw.first_frame + at}"
    return _before(
        raw, at, f"{why}, from where on the points stand in each other's places", salvage
    )


def _before(raw: Contents, at: int, what: str, salvage: bool) -> Contents:
    """The frames before `at`."""
    if not salvage or not at:
        hint = f"--salvage reads the {at} frames before" if at else None
        raise ClipError(what, hint)
    note = f"{what}: the {at} frames before are read"
    return replace(
        raw,
        points=raw.points[:at],
        invalid=raw.invalid[:at],
        length=at,
        notes=(*raw.notes, note),
    )


def _blank_from(found: Survey, frames: int) -> int:
    """The frame from which on all is zero, points, residuals and analog values; `frames` if none."""
    step, end = 1, frames
    while end:
        start = max(0, end - step)
        used = np.flatnonzero(found.raw(start, end - start).any(axis=1))
        if len(used):
            return start + int(used[-1]) + 1
        step, end = min(2 * step, 1 + _CHUNK // found.layout.stride), start
    return 0


def _writes_zeros(found: Survey, blank: int) -> bool:
    """Whether zeros are how this file says that it did not see a point: then they tell nothing.

    Analog channels that are alive and stop with the points tell all the same; the last frame
    before the blank ones may be cut itself.
    """
    layout = found.layout
    count = min(blank - 1, max(1, _CHUNK // layout.stride))
    if count < 1:
        return False
    frames = found.raw(blank - 1 - count, count)
    points = 4 * layout.points * layout.width
    if frames[:, points:].any(axis=1).mean() > 0.5:
        return False
    return not frames[:, :points].reshape(count, layout.points, -1).any(axis=2).all()


def _shifted_at(found: Survey, frames: int) -> int | None:
    """The frame in which bytes are lost or inserted; None without.

    Such a place is one where most points jump at once, and where the values from there on are
    those from before, some places further on in the frame: no motion and no exchange of labels
    does that to all of them.
    """
    layout = found.layout
    if layout.points < _ENOUGH or frames < 10:
        return None
    some = found.read_some(spread(frames))
    seen = np.flatnonzero((some[..., :3] != 0).any(axis=2).mean(axis=0) > 0.5)
    if len(seen) < _ENOUGH:
        return None
    steps = _steps(found, frames, seen[:: 1 + (len(seen) - 1) // _POINTS])
    # Far from what is usual, for the clip or for the frames around.
    around = np.concatenate([steps[:2], steps[:-2]]) + np.concatenate([steps[2:], steps[-2:]])
    with np.errstate(invalid="ignore"):
        odd = np.nan_to_num(steps / (around + np.sort(steps)[len(steps) // 4]), nan=0.0)
    first = np.flatnonzero(steps > _STEPS * np.sort(steps)[len(steps) // 4])[:_PROOFS]
    places = {*first.tolist()}
    for order in (steps, odd):
        places |= {*np.argsort(-order, kind="stable")[:_PROOFS].tolist()}
    return next((at for at in sorted(places) if _is_shift(found, at, frames)), None)


def _steps(found: Survey, frames: int, seen: NDArray[np.intp]) -> NDArray[np.float64]:
    """(frames - 1,), the points' median step to the next frame, along all axes together."""
    size = max(2, _CHUNK // found.layout.stride)
    steps = []
    for start in range(0, frames - 1, size):
        points = found.read(start, min(size + 1, frames - start))[:, seen, :3].astype(np.float64)
        with np.errstate(invalid="ignore", over="ignore"):
            moved = np.abs(np.diff(points, axis=0)).sum(axis=2)
        moved[~np.isfinite(moved)] = np.inf
        steps.append(np.partition(moved, len(seen) // 2, axis=1)[:, len(seen) // 2])
    return np.concatenate(steps)


def _is_shift(found: Survey, at: int, frames: int) -> bool:
    """Whether the values before the step after frame `at` stand at other places after it."""
    layout = found.layout
    # The frame in which it happens is half before and half after: this one or the next.
    if at < 1 + 2 * _APART or at + 4 > frames:
        return False
    column = np.arange(4 * layout.points).reshape(-1, 4)[:, :3].ravel()
    last = np.array([at - 1 - 2 * _APART, at - 1 - _APART, at - 1])
    earliest, earlier, here = (found.values(found.raw(n, 1).ravel())[column] for n in last)
    seen = (earliest != 0) & (earlier != 0) & (here != 0)
    # Where points go on as they went.
    ahead = np.where(seen, 2 * here - earlier, 0)
    after = found.raw(at - 1 + _APART, 2).ravel()
    moved = _far(here, np.where(seen, 2 * earlier - earliest, 0))[0]
    stays = _far(ahead, found.values(after[: layout.stride])[column])[0]
    size = np.sort(np.abs(here))[int(len(here) * _MOST)]
    # Where nothing moved, some steps of the grid on which coordinates are written.
    limit = max(_MORE * moved, _GRID * size)
    # Neither where nothing can be compared, nor where the values before are no tracks.
    if not limit < stays < np.inf or limit >= size or size > FARTHEST:
        return False
    # A value stands `places` further on than it stood; the frame goes on in the next one.
    values = layout.stride // layout.width
    places = np.arange(values)[:, None] + column
    for skipped in range(layout.width):
        there = found.values(after[skipped : len(after) - layout.width + skipped])
        far = _far(ahead, there[np.minimum(places, len(there) - 1)])
        if far.min() <= min(stays / _BETTER, limit):
            return True
    return False


def _far(here: NDArray[np.float64], there: NDArray[np.float64]) -> NDArray[np.float64]:
    """By how much most values differ, zeros apart; infinite where too few are there.

    Args:
        here: (values,).
        there: (values,) or (ways, values).
    """
    there = np.atleast_2d(there)
    good = (here != 0) & (there != 0)
    with np.errstate(invalid="ignore", over="ignore"):
        far = np.where(good, np.abs(there - here), np.inf)
    far[np.isnan(far)] = np.inf
    count = good.sum(axis=1)
    found = np.sort(far, axis=1)[np.arange(len(far)), (count * _MOST).astype(int)]
    return np.where(count >= max(3 * _ENOUGH, len(here) // 3), found, np.inf)
