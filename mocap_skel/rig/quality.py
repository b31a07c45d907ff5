"""How good a rigid figure is: how far its markers are off, how fast it turns, how its feet stand, what is filled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mocap_skel.rig.animation import KEPT, Animation
from mocap_skel.rig.bridging import MEMORY, steps
from mocap_skel.rig.feet import Sole, point_track, speed
from mocap_skel.rig.motion import Limits, residuals
from mocap_skel.segments.pose import Array

# What is beyond these limits a person should look at.
# Metres, root mean square over a segment's markers: skin carries a marker by 1 to 3 cm from one extreme of a movement
# to the other (Leardini et al. 2005, Gait & Posture 21): the middle of that.
MARKERS = 0.02
# Metres, one marker in one frame: the most of that, and 1 cm for what rigid bones cannot follow (by eye).
MARKER = 0.04
# Degrees a second: no joint of a person turns faster. The motion is held to it, but what `held_feet` does comes later.
TURN = Limits.speed
# Metres a second that a standing sole is faster along the floor than its markers: 1.2 cm in a walker's stand of
# 0.6 s, as much as FLOOR allows upwards.
SKATING = 0.02
# Metres between a standing sole and the floor: a figure of life size is then seen to float, or to sink in.
FLOOR = 0.01
# Seconds of a turn filled in that no marker tells of: after so long the speed before and after a gap says a quarter of
# what it says over a short one, and the turn is a guess.
GUESSED = MEMORY


@dataclass(frozen=True)
class SegmentQuality:
    """One segment of a rigid figure. None = nothing to measure it by.

    Attributes:
        segment: its name.
        joint: that it turns about; None for the root.
        marker_rms: metres, root mean square distance of its markers, as they were recorded, from where the figure
            has them. Samples that the fit left out do not count.
        filtered_rms: the same of the markers after the filter, to which the figure was fitted; None without a filter.
        worst: metres, the largest distance of those of `marker_rms`.
        worst_marker, worst_frame: which marker that is, and the file's number of the frame.
        turn_speed: degrees a second, the fastest turn against its parent; of the root against the lab.
        turn_frame: the file's number of the frame in which that turn ends.
        skating: metres a second along the floor, median over the frames in which its soles stand.
        marker_skating: the same of the markers above them, to which the figure was fitted.
        floor_distance: metres, mean distance of its soles from the floor while they stand.
        filled: frames in which its pose was filled in.
        guessed: seconds, the longest stretch of them in which no marker tells of its turn.
        repaired: frames in which it turned too fast, replaced.
        absent: frames in which the figure is without it.
        look_at: the attributes above that are beyond their limit, which a person should look at.
    """

    segment: str
    joint: str | None
    marker_rms: float | None
    filtered_rms: float | None
    worst: float | None
    worst_marker: str
    worst_frame: int | None
    turn_speed: float | None
    turn_frame: int | None
    skating: float | None
    marker_skating: float | None
    floor_distance: float | None
    filled: int
    guessed: float
    repaired: int
    absent: int
    look_at: tuple[str, ...] = ()


@dataclass(frozen=True)
class Quality:
    """A rigid figure measured against its markers, over the frames in which it is known.

    Attributes:
        segments: one each, parents first.
        marker_rms: metres, root mean square distance of all markers, as they were recorded, from where the figure
            has them; None without markers.
        filtered_rms: the same after the filter; None without markers or filter.
        floor_distance: metres, mean distance of standing soles from the floor; None where none stands.
        frames: of the clip.
        figure: frames in which the whole figure is known.
    """

    segments: tuple[SegmentQuality, ...]
    marker_rms: float | None
    filtered_rms: float | None
    floor_distance: float | None
    frames: int
    figure: int

    @property
    def look_at(self) -> tuple[SegmentQuality, ...]:
        """The segments that a person should look at."""
        return tuple(one for one in self.segments if one.look_at)


@lru_cache(maxsize=KEPT)
def quality_of(animation: Animation) -> Quality:
    """Measure a figure against its markers, segment by segment, over the frames in which it is known."""
    motion, model = animation.motion, animation.motion.model
    known = ~motion.absent
    recorded = _known(residuals(replace(model, points=animation.recorded), motion.poses), known)
    filtered = _known(residuals(model, motion.poses), known)
    feet = [_Stand.of(animation, s, known[s]) for s in range(len(known))]
    segments = []
    for s, segment in enumerate(model.segments):
        worst, frame, marker = _largest(recorded[s])
        turn, after = _fastest(animation, s)
        numbers = animation.frame_numbers
        bridges = [b for b in motion.bridges if b.segment == s and b.by]
        guesses = [b.stop - b.start for b in bridges if b.by != "markers"]
        one = SegmentQuality(
            segment.name,
            segment.joint,
            _root_mean_square(recorded[s]),
            _root_mean_square(filtered[s]) if animation.cutoff else None,
            worst,
            model.markers[s][marker] if worst is not None else "",
            int(numbers[frame]) if worst is not None else None,
            turn,
            int(numbers[after]) if turn is not None else None,
            _median(feet[s].skating),
            _median(feet[s].marker_skating),
            _mean(feet[s].heights),
            sum(b.stop - b.start for b in bridges),
            max(guesses, default=0) / animation.rate,
            int(motion.repaired[s].sum()),
            int(motion.absent[s].sum()),
        )
        segments.append(replace(one, look_at=tuple(_beyond(one))))
    every = np.concatenate([foot.heights for foot in feet])
    return Quality(
        tuple(segments),
        _root_mean_square(*recorded),
        _root_mean_square(*filtered) if animation.cutoff else None,
        _mean(every),
        motion.poses.frames,
        int(known.all(axis=0).sum()),
    )


def _beyond(one: SegmentQuality) -> list[str]:
    """The attributes of a segment that are beyond their limits."""
    beyond = {
        "marker_rms": (one.marker_rms or 0.0) > MARKERS,
        "worst": (one.worst or 0.0) > MARKER,
        # A turn eased to the limit is at it but for rounding.
        "turn_speed": (one.turn_speed or 0.0) > TURN * (1.0 + 1e-6),
        "skating": (one.skating or 0.0) - (one.marker_skating or 0.0) > SKATING,
        "floor_distance": (one.floor_distance or 0.0) > FLOOR,
        "guessed": one.guessed > GUESSED,
        "repaired": one.repaired > 0,
        "absent": one.absent > 0,
    }
    return [name for name, is_beyond in beyond.items() if is_beyond]


@dataclass(frozen=True, eq=False)
class _Stand:
    """The soles of a segment while they stand: distances from the floor, speeds along it, their markers' speeds."""

    heights: Array
    skating: Array
    marker_skating: Array

    @staticmethod
    def of(animation: Animation, segment: int, known: NDArray[np.bool_]) -> _Stand:
        heights, skating, markers = ([np.empty(0)] for _ in range(3))
        motion, up = animation.motion, animation.vertical
        level = np.eye(3) - np.outer(up, up)
        for sole in animation.feet.soles:
            if sole.segment != segment:
                continue
            track = point_track(motion.model.bones, motion.poses, segment, sole.place)
            above = motion.model.points[segment][
                :, motion.model.markers[segment].index(sole.marker)
            ]
            stands, inner = _standing(sole, known)
            heights.append(np.abs(up @ track - animation.feet.floor)[stands])
            skating.append(speed(level @ track, animation.rate)[inner])
            markers.append(speed(level @ above.T, animation.rate)[inner])
        found = np.concatenate(markers)
        return _Stand(np.concatenate(heights), np.concatenate(skating), found[np.isfinite(found)])


def _standing(sole: Sole, known: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(F,) each: where a sole stands, and where it also does in the frames beside, which its speed is taken from."""
    stands, inner = np.zeros_like(known), np.zeros_like(known)
    for start, stop in sole.stands:
        stands[start:stop] = True
        inner[start + 1 : stop - 1] = True
    return stands & known, inner & known


def _fastest(animation: Animation, segment: int) -> tuple[float | None, int]:
    """Degrees a second, and the index of the frame that the fastest turn ends in."""
    motion, bones = animation.motion, animation.motion.model.bones
    gone = motion.absent[segment] | (
        motion.absent[bones.parents[segment]] if bones.parents[segment] >= 0 else False
    )
    angles = np.where(gone[1:] | gone[:-1], -1.0, steps(motion.poses.local(bones, segment)))
    if not (angles >= 0.0).any():
        return None, 0
    at = int(angles.argmax())
    return float(np.degrees(angles[at]) * animation.rate), at + 1


def _known(away: list[Array], known: NDArray[np.bool_]) -> list[Array]:
    return [np.where(here[:, None], own, np.nan) for own, here in zip(away, known, strict=True)]


def _largest(away: Array) -> tuple[float | None, int, int]:
    """The largest of (F, M), its frame and its marker."""
    if not np.isfinite(away).any():
        return None, 0, 0
    frame, marker = np.unravel_index(int(np.nanargmax(away)), away.shape)
    return float(away[frame, marker]), int(frame), int(marker)


def _root_mean_square(*away: Array) -> float | None:
    every = np.concatenate([own[np.isfinite(own)] for own in away])
    return float(np.sqrt((every**2).mean())) if len(every) else None


def _median(values: Array) -> float | None:
    return float(np.median(values)) if len(values) else None


def _mean(values: Array) -> float | None:
    return float(values.mean()) if len(values) else None
