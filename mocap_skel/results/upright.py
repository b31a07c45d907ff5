"""Which way is up? The body tells it, where the file does not say or contradicts it: head over pelvis over feet.

A body along another axis than the file's vertical stands there, or it lies. It stands if its feet keep one height along
that axis and carry it from place to place, or if they stand on the lab's zero and it cannot lie on the floor. What
is neither stays as the file has it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap_skel.clip import UPS, Clip, vertical
from mocap_skel.figure.skeleton import STANDARD, Skeleton, shipped_skeletons
from mocap_skel.labels.association import Assignment
from mocap_skel.labels.guess.columns import Columns, columns_by_names

Array = NDArray[np.float64]

# Cosine of the angle to the vertical of a body that stands, from the feet to the top (37 degrees), and of its trunk and
# its legs, which bow and sit.
_STANDS, _BENDS = 0.8, 0.3
# Share of the frames in which a body stands that has something to say: where the file does not say what is up, and
# where it says otherwise or the body goes nowhere.
_MOST, _NEARLY_ALL = 0.6, 0.8
# Share in which it may stand along the file's own vertical all the same.
_SELDOM = 0.1
# In lengths of the body: how far the height of the lowest foot varies on a floor (5th to 80th of a hundred
# frames, for it may jump); how far a body goes at least that has gone somewhere; its speed, per second, while it goes.
_LEVEL, _GONE, _GOES = 0.07, 0.3, 0.15
# Speed of the slower foot, as a share of the pelvis's: of a walker's feet one stands.
_STANCE = 0.5
# Metres over the lab's zero of the lowest foot marker of one who stands there.
_ON_ZERO = (-0.05, 0.15)
# Metres over the lab's zero of the lowest marker of one who lies, on the floor or on a table; and lengths of the
# body by which that may vary.
_LYING, _LIES = (-0.05, 1.1), 0.25
# Seconds between the two places that give a speed; a foot stands longer than that in a quick step.
_MOMENT = 0.1
# Frames that tell it well enough.
_FRAMES = 200
# Cosine to the vertical of a bone that the T-pose has upright.
_ALONG = 0.9


@dataclass(frozen=True)
class Found:
    """The axis along which a body is upright.

    Attributes:
        up: it, one of `clip.UPS`.
        sure: whether the body stands there; otherwise it may lie.
        words: the evidence, "" where it is the clip's own vertical.
    """

    up: str
    sure: bool
    words: str = ""


def upright(clip: Clip, assignments: Sequence[Assignment], skeleton: Skeleton) -> Clip:
    """The clip with the vertical axis that its bodies show; a note says if that is not the file's, and why.

    Where somebody has stated it (`read_clip(up=...)`), and where bodies disagree, it stays.

    Args:
        clip: as it was read. Its coordinates stay as they are.
        assignments: which column is which marker, of every subject.
        skeleton: their figure; its T-pose tells which segments are over one another.

    >>> from mocap_skel import associate, read_association, read_clip
    >>> clip, cmu = read_clip("sample_data/range_of_motion.c3d"), read_association("cmu")
    >>> found = upright(clip, associate(clip, cmu), cmu.skeleton)
    >>> found.up, found is clip
    ('z', True)
    """
    return _turned(clip, [one.columns for one in assignments], skeleton)


def upright_by_names(clip: Clip, subject: str | None = None) -> Clip:
    """As `upright`, before it is known which label is which marker: by labels whose meaning is clear.

    Args:
        clip: as it was read.
        subject: only this one is looked at.
    """
    bodies = [columns for _, columns in columns_by_names(clip, subject)]
    return _turned(clip, bodies, shipped_skeletons()[STANDARD])


def _turned(clip: Clip, bodies: Iterable[Columns], skeleton: Skeleton) -> Clip:
    if clip.up_by == "call":
        return clip
    found = [one for columns in bodies if (one := _look(clip, columns, skeleton)) is not None]
    # A body that stands along the clip's own vertical is a word too.
    ups = {one.up for one in found}
    if len(ups) != 1 or ups == {clip.up}:
        return clip
    (up,) = ups
    sure = next((one for one in found if one.sure), None)
    if sure is None:
        note = (
            f"{clip.up} is taken to point up, {found[0].words}; if it stands there, --clip-up {up}"
        )
        return replace(clip, notes=(*clip.notes, note))
    against = f", not {clip.up} as the file says" if clip.up_by == "file" else ""
    note = f"{up} is taken to point up{against}: {sure.words}; --clip-up {clip.up} keeps {clip.up}"
    return replace(clip, up=up, up_by="body", notes=(*clip.notes, note))


@dataclass(frozen=True)
class _Body:
    """A body in some frames, and a moment later: what stands over what. Metres, NaN = missing.

    Attributes:
        vectors: (frames, 3) each, from pelvis to the top and from the feet to the pelvis, as far as they are there.
        pelvis: (2, frames, 3), now and a moment later.
        feet: (2, feet, frames, 3), the middle of each.
        soles: (frames, M, 3), the markers of the feet.
        markers: (frames, M, 3), all.
        moment: seconds between now and then.
    """

    vectors: tuple[Array, ...]
    pelvis: Array
    feet: Array
    soles: Array
    markers: Array
    moment: float

    @property
    def length(self) -> float:
        """Metres, from the feet to the top as far as they are there."""
        return float(sum(np.nanmedian(_length(vector)) for vector in self.vectors))


def _look(clip: Clip, columns: Columns, skeleton: Skeleton) -> Found | None:
    """Along which axis a body is upright; None where it is not, or too little of it is there."""
    body = _body(clip, columns, skeleton)
    if body is None:
        return None
    share = {up: _share_upright(body, vertical(up)) for up in UPS}
    best = max(UPS, key=share.__getitem__)
    if share[clip.up] > _SELDOM:
        return Found(clip.up, True)
    if best == clip.up or share[best] < _MOST:
        return None
    percent = f"in {100 * share[best]:.0f} % of the frames"
    nearly_all, said = share[best] >= _NEARLY_ALL, clip.up_by != ""
    level = _level(body, vertical(best))
    if (nearly_all or not said) and level and _walks(body, vertical(best)):
        how = "and walks with its feet at one height"
        return Found(best, True, f"the body is upright along it {percent}, {how}")
    if nearly_all and not said and level and _on_zero(body, vertical(best), clip.up):
        how = "and its feet are near zero there"
        return Found(best, True, f"the body is upright along it {percent}, {how}")
    if not nearly_all:
        return None
    return Found(best, False, f"though the body is straight along {best} {percent}")


def _body(clip: Clip, columns: Columns, skeleton: Skeleton) -> _Body | None:
    """The parts that are over one another, or None where there are no two."""
    top, root, low = _parts(columns, skeleton)
    if not root or not (top or low):
        return None
    step = max(1, round(_MOMENT * clip.rate))
    if clip.frames <= step:
        return None
    starts = np.arange(0, clip.frames - step, 1 + clip.frames // _FRAMES)

    def points(segment: str, frames: NDArray[np.int64] = starts) -> Array:
        return clip.points[frames][:, list(columns[segment].values())]

    def middles(segment: str) -> Array:
        return np.stack([_middle(points(segment)), _middle(points(segment, starts + step))])

    pelvis = middles(root)
    feet = np.stack([middles(name) for name in low], axis=1) if low else np.empty((2, 0, 1, 3))
    vectors = []
    if top:
        vectors.append(_middle(points(top)) - pelvis[0])
    if low:
        vectors.append(pelvis[0] - _middle(feet[0].swapaxes(0, 1)))
    if not np.isfinite(sum(vectors)).any():
        # They are never seen together: one of them speaks.
        vectors = [v for v in vectors if np.isfinite(v).any()][:1]
    if not vectors:
        return None
    soles = np.concatenate([points(s) for s in low], axis=1) if low else np.empty((1, 0, 3))
    markers = np.concatenate([points(name) for name in columns if columns[name]], axis=1)
    return _Body(tuple(vectors), pelvis, feet, soles, markers, step / clip.rate)


def _parts(columns: Columns, skeleton: Skeleton) -> tuple[str, str, list[str]]:
    """The highest segment in the T-pose, the root, and the lowest ones of the legs, of those with markers; "" for none.

    The root is the figure's, or where that has no markers the lowest of all else that points up.
    """
    depth: dict[str, int] = {}
    above: list[str] = []
    below: list[str] = []
    for segment in skeleton.segments:
        high = 0.0 if segment.rest is None else segment.rest[1]
        parent = segment.parent or ""
        if high > _ALONG and (not parent or parent in above):
            above.append(segment.name)
        elif parent and (high < -_ALONG or (segment.sole and parent in below)):
            below.append(segment.name)
        depth[segment.name] = depth.get(parent, 0) + 1
    root = skeleton.root.name
    seen = [name for name in above if columns.get(name) and name != root]
    legs = [name for name in below if columns.get(name)]
    if not columns.get(root):
        root, seen = (seen[0], seen[1:]) if seen else ("", [])
    lowest = max((depth[name] for name in legs), default=0)
    return (seen[-1] if seen else ""), root, [name for name in legs if depth[name] == lowest]


def _share_upright(body: _Body, up: Array) -> float:
    """The share of the frames that show the body in which it is upright."""
    seen = np.logical_and.reduce([np.isfinite(v[:, 0]) for v in body.vectors])
    parts = [v[seen] for v in body.vectors]
    whole = np.asarray(sum(parts))
    stands = [v @ up > _BENDS * _length(v) for v in parts]
    return float(np.logical_and.reduce([whole @ up > _STANDS * _length(whole), *stands]).mean())


def _level(body: _Body, up: Array) -> bool:
    """Whether the lowest foot keeps its height; of a body without feet, whether the pelvis does."""
    heights = _lowest(body.soles if body.soles.shape[1] else body.pelvis[0][:, None], up)
    if not len(heights):
        return False
    low, high = np.quantile(heights, [0.05, 0.8])
    return bool(high - low < _LEVEL * body.length)


def _walks(body: _Body, up: Array) -> bool:
    """Whether it goes from place to place, straight across, on feet of which one stands."""
    places = body.pelvis[0][np.isfinite(body.pelvis[0][:, 0])]
    across = places - np.outer(places @ up, up)
    low, high = np.quantile(across, [0.05, 0.95], axis=0)
    if (high - low).max() < _GONE * body.length:
        return False
    if not body.feet.shape[1]:
        return True
    speed = _length(body.pelvis[1] - body.pelvis[0]) / body.moment
    feet = _length(body.feet[1] - body.feet[0]) / body.moment
    slower = np.where(np.isfinite(feet).all(axis=0), np.fmin.reduce(feet, axis=0), np.nan)
    going = (speed > _GOES * body.length) & np.isfinite(slower)
    return bool(going.any() and np.median(slower[going] / speed[going]) < _STANCE)


def _on_zero(body: _Body, up: Array, other: str) -> bool:
    """Whether its feet are at the lab's zero along `up`, and it cannot lie on a floor that `other` points up from."""
    if not body.soles.shape[1]:
        return False
    floor = float(np.median(_lowest(body.soles, up)))
    low, lying, high = np.quantile(_lowest(body.markers, vertical(other)), [0.05, 0.5, 0.95])
    lies = _LYING[0] <= lying <= _LYING[1] and high - low < _LIES * body.length
    return bool(_ON_ZERO[0] <= floor <= _ON_ZERO[1] and not lies)


def _lowest(points: Array, up: Array) -> Array:
    """The height of the lowest of (frames, M, 3) in each frame that shows any."""
    heights = np.fmin.reduce(points @ up, axis=1)
    return np.asarray(heights[np.isfinite(heights)])


def _middle(points: Array) -> Array:
    """(frames, 3) the mean of the markers that are seen, of (frames, M, 3)."""
    seen = np.isfinite(points[..., :1])
    total = np.where(seen, points, 0.0).sum(axis=1)
    count = seen.sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _length(vectors: Array) -> Array:
    return np.asarray(np.sqrt((vectors**2).sum(axis=-1)))
