"""How good a rigid figure is: how far its markers are off, how fast it turns, how its feet stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.rig.animation import Animation
from mocap_skel.rig.bridging import steps
from mocap_skel.rig.feet import point_track
from mocap_skel.rig.motion import residuals


@dataclass(frozen=True)
class Quality:
    """Figures that say where to look.

    Attributes:
        residual: metres, root mean square distance of all markers from where the figure has them.
        worst: the segment with the largest, and its own, metres.
        fastest: the joint that turns fastest, degrees a second, and the file's number of the frame.
        floor: metres, mean distance of standing soles from the floor; None where none stands.
    """

    residual: float
    worst: tuple[str, float]
    fastest: tuple[str, float, int]
    floor: float | None

    def __str__(self) -> str:
        joint, speed, frame = self.fastest
        words = (
            f"the rigid figure's markers are {1e3 * self.residual:.1f} mm off (root mean square), most on "
            f"{self.worst[0]} ({1e3 * self.worst[1]:.1f} mm); {joint} turns fastest, {speed:.0f} degrees a second in "
            f"frame {frame}"
        )
        return (
            words
            if self.floor is None
            else f"{words}; soles {1e3 * self.floor:.0f} mm from the floor"
        )


def quality_of(animation: Animation) -> Quality:
    """Measure a figure against its markers, over the frames in which it is known."""
    motion, model = animation.motion, animation.motion.model
    names = [segment.joint or segment.name for segment in model.segments]
    # A fit without points has nothing to be measured against.
    squares = {"": np.array([np.nan])}
    for s, away in enumerate(residuals(model, motion.poses)):
        seen = away[np.isfinite(away) & ~motion.absent[s][:, None]]
        if len(seen):
            squares[model.segments[s].name] = seen**2
    if len(squares) > 1:
        del squares[""]
    every = np.concatenate(list(squares.values()))
    worst = max(squares, key=lambda name: float(squares[name].mean()))
    speeds = np.stack([steps(motion.poses.local(model.bones, s)) for s in range(len(names))])
    speeds[motion.absent[:, 1:] | motion.absent[:, :-1]] = 0.0
    joint, frame = np.unravel_index(int(speeds.argmax()), speeds.shape)
    heights = []
    for sole in animation.feet.soles:
        track = point_track(model.bones, motion.poses, sole.segment, sole.place)
        height = np.abs(animation.vertical @ track - animation.feet.floor)
        heights += [height[start:stop] for start, stop in sole.stands]
    return Quality(
        float(np.sqrt(every.mean())),
        (worst, float(np.sqrt(squares[worst].mean()))),
        (
            names[int(joint)],
            float(np.degrees(speeds.max()) * animation.rate),
            int(animation.frame_numbers[int(frame) + 1]),
        ),
        float(np.concatenate(heights).mean()) if heights else None,
    )
