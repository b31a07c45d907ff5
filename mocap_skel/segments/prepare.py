"""A clip's markers made ready for the fit: bad samples left out, the rigid shapes and the noise found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.segments.noise import ClipNoise, clip_noise
from mocap_skel.segments.pose import Array, Pose, by_rows
from mocap_skel.segments.shape import Shape, find_shape, median
from mocap_skel.segments.spikes import spikes
from mocap_skel.segments.trouble import Mask, out_of_shape


@dataclass(frozen=True, eq=False)
class Prepared:
    """The markers of one subject by segment, as the fit of its joints takes them.

    Attributes:
        columns: segment → marker → its column in the clip; only markers that are seen at all.
        points: segment → its markers (frames, M, 3), metres, NaN = missing or left out.
        masks: segment → samples (frames, M) that were left out; segments without any have no entry.
        shapes: segment → its rigid shape and pose; only segments that have one.
        noise: the measurement noise of a marker.
        frames: how many the clip has.
        lost: segment → its markers that are missing in every frame; only segments with some.
        samples: how many marker samples were seen, those that were left out among them.
    """

    columns: Mapping[str, Mapping[str, int]]
    points: Mapping[str, Array]
    masks: Mapping[str, Mask]
    shapes: Mapping[str, tuple[Shape, Pose]]
    noise: ClipNoise
    frames: int
    lost: Mapping[str, tuple[str, ...]]
    samples: int

    @property
    def sigma(self) -> float:
        """Noise standard deviation of a marker, metres."""
        return self.noise.sigma

    def markers(self, segment: str) -> tuple[str, ...]:
        """A segment's markers that are seen, in the order of its points."""
        return tuple(self.columns.get(segment, ()))

    def of(self, segment: str) -> Array:
        """A segment's points (frames, M, 3), metres; M = 0 where none of its markers is seen."""
        return self.points.get(segment, np.empty((self.frames, 0, 3)))

    def track(self, marker: str) -> Array | None:
        """A marker's points (frames, 3); None for a marker that is never seen."""
        for segment, columns in self.columns.items():
            if marker in columns:
                return self.points[segment][:, list(columns).index(marker)]
        return None

    def distance(self, first: str, second: str) -> float | None:
        """Median distance of two markers, metres; None where they are never seen together."""
        a, b = self.track(first), self.track(second)
        if a is None or b is None:
            return None
        found = float(median(np.linalg.norm(a - b, axis=1)))
        return found if np.isfinite(found) else None

    def without(self, segment: str, left: Mask | None) -> Prepared:
        """The same with more samples (frames, M) of a segment left out; shapes and noise stay."""
        if left is None:
            return self
        points = np.where(left[..., None], np.nan, self.points[segment])
        return replace(
            self,
            points={**self.points, segment: points},
            masks={**self.masks, segment: left | self.masks.get(segment, False)},
        )


def prepare(
    clip: Clip,
    columns: Mapping[str, Mapping[str, int]],
    *,
    sigma: float | Array | None = None,
    noise: str = "rigid",
    search: bool = True,
) -> Prepared:
    """Get a subject's markers ready: leave out bad samples, then find rigid shapes and the noise.

    Args:
        clip: the recording; it is not changed.
        columns: segment → marker → its column in the clip.
        sigma: noise standard deviation in metres, or covariance (3, 3), m²; estimated if None.
        noise: how it is estimated, one of `noise.NOISES`.
        search: whether samples at which a marker left its segment are looked for.

    Raises:
        ValueError: sigma is a matrix and no covariance.

    Example:
        A box of four markers that turns about the vertical; one marker jumps by half a metre.

        >>> import numpy as np
        >>> from mocap_skel.clip import Clip
        >>> angle = np.linspace(0.0, 2.0, 200)
        >>> cos, sin, zero, one = np.cos(angle), np.sin(angle), 0 * angle, 0 * angle + 1
        >>> turn = np.array([[cos, -sin, zero], [sin, cos, zero], [zero, zero, one]])
        >>> box = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.1]])
        >>> points = np.einsum("ijf,mj->fmi", turn, box)
        >>> points[50:60, 1] += 0.5
        >>> names = ("A", "B", "C", "D")
        >>> clip = Clip("box", points, names, ("",) * 4, 100.0, 1, "m", "z", {}, ())
        >>> found = prepare(clip, {"Box": {name: i for i, name in enumerate(names)}})
        >>> found.samples, int(found.masks["Box"].sum())
        (800, 10)
        >>> round(found.distance("A", "B"), 3)
        0.3
    """
    seen = {name: _seen(clip, of) for name, of in columns.items()}
    points, masks, shapes = {}, {}, {}
    samples = 0
    for name, of in seen.items():
        own = clip.points[:, list(of.values())]
        samples += int(np.isfinite(own[..., 0]).sum())
        points[name], left, shape = _rigid(own, search)
        if left is not None:
            masks[name] = left
        if shape is not None:
            shapes[name] = shape
    lost = {name: tuple(m for m in of if m not in seen[name]) for name, of in columns.items()}
    return Prepared(
        columns=seen,
        points=points,
        masks=masks,
        shapes=shapes,
        noise=clip_noise(points, shapes, sigma, noise),
        frames=clip.frames,
        lost={name: markers for name, markers in lost.items() if markers},
        samples=samples,
    )


def _seen(clip: Clip, columns: Mapping[str, int]) -> dict[str, int]:
    """The markers that at least one frame has."""
    return {m: i for m, i in columns.items() if np.isfinite(clip.points[:, i, 0]).any()}


def _rigid(points: Array, search: bool) -> tuple[Array, Mask | None, tuple[Shape, Pose] | None]:
    """A segment's markers (frames, M, 3) without those out of shape, which those are, and the shape."""
    squares = left = None
    if search and 1 <= points.shape[1] <= 2:
        points, left = _less(points, left, spikes(by_rows(points)))
    if search and points.shape[1] >= 2:
        squares, out = out_of_shape(by_rows(points))
        points, left = _less(points, left, out)
    return points, left, find_shape(points, squares) if points.shape[1] >= 3 else None


def _less(points: Array, left: Mask | None, out: Mask | None) -> tuple[Array, Mask | None]:
    """Points (frames, M, 3) less the samples `out` (M, frames), and which are left out now, (frames, M)."""
    if out is None:
        return points, left
    points = np.where(out.T[..., None], np.nan, points)
    return points, out.T if left is None else left | out.T
