"""Joint angles against those that Plug-in Gait left in the same clips (POINT:ANGLES).

    python benchmarks/angles.py [--axes] [FOLDER or CLIP.c3d ...]

One line an angle: correlation, root mean square difference after the mean of both is taken off, the difference of the
means, and the range of Plug-in Gait's. Plug-in Gait's angles are themselves model outputs: they have its centres and its
axes. Signs are Plug-in Gait's turned into ours (its elbows, wrists, shoulders and trunk are by other definitions and are not
compared). With --axes, the axes on which joints turn in the clip count for anatomical axes, where they are surer than
landmarks; docs/angles.md says why they do not by default.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from validation.folder import clips_in
from validation.points import all_points

from mocap_skel.angles.joint_angles import joint_angles
from mocap_skel.clip import Clip
from mocap_skel.errors import MocapSkelError
from mocap_skel.pipeline.job import Job, fit_file
from mocap_skel.readers.units import metres_in
from mocap_skel.skeleton_fit import SkeletonFit

CLIPS = Path(os.environ.get("MOCAP_SKEL_CLIPS", Path(__file__).parents[2] / "shared" / "clips"))
# Plug-in Gait's point, ours, and the sign of each component by which it becomes ours; 0 = another definition.
# Its ankle has abduction third and inward rotation second, so only the first is the same.
PAIRS = tuple(
    (f"{s}{point}", ours.replace("*", side), signs)
    for s, side in (("L", "Left"), ("R", "Right"))
    for point, ours, signs in (
        ("HipAngles", "*Hip", (1, 1, 1)),
        ("KneeAngles", "*Knee", (1, 1, 1)),
        ("AnkleAngles", "*Ankle", (1, 0, 0)),
    )
)
# Frames that a line needs.
LEAST_FRAMES = 50


@dataclass(frozen=True)
class Line:
    """One angle of one clip against Plug-in Gait's: degrees."""

    clip: str
    name: str
    frames: int
    correlation: float
    rms: float
    offset: float
    span: float
    error: float

    def text(self) -> str:
        return (
            f"{self.clip:14} {self.name:22} {self.frames:5d}  {self.correlation:6.3f}  {self.rms:5.1f}  "
            f"{self.offset:6.1f}  {self.error:5.1f}  {self.span:5.1f}"
        )


HEAD = (
    "clip           angle                  frames      r    rms  offset   s.e.   range   (degrees)"
)


def lines_of(path: Path, axes: bool = False) -> Iterator[Line]:
    """The lines of one clip; none where it holds no such angles.

    Raises:
        MocapSkelError: it cannot be read or fitted.
    """
    found = fit_file(path, Job(None))
    for _, fit in found.subjects:
        yield from _lines(path, found.clip, fit, axes)


def _lines(path: Path, clip: Clip, fit: SkeletonFit, axes: bool) -> Iterator[Line]:
    scale = metres_in(clip.unit) or 1.0
    # Angles are stored as if they were lengths.
    theirs = {k: v / scale for k, v in all_points(path, clip).items()}
    shown = {joint.joint: joint.turns_on for joint in fit.joints if joint.turns_on is not None}
    angles = joint_angles(fit, hinges=shown if axes else None)
    ours = {joint.rule.name: joint for joint in angles.joints}
    for point, name, signs in PAIRS:
        track = theirs.get((fit.subject, point))
        if track is None or name not in ours:
            continue
        for column, sign in enumerate(signs):
            own, other = ours[name].degrees[:, column], sign * track[:, column]
            both = np.isfinite(own) & np.isfinite(other)
            if sign and both.sum() >= LEAST_FRAMES:
                title = ours[name].rule.titles[column]
                error = ours[name].typical_error[column]
                yield _line(path.stem, title, own[both], other[both], error)


def _line(
    clip: str, name: str, own: NDArray[np.float64], other: NDArray[np.float64], error: float
) -> Line:
    away = own - other
    return Line(
        clip, name, len(own), float(np.corrcoef(own, other)[0, 1]), float(away.std()),
        float(away.mean()), float(np.ptp(other)), float(error),
    )  # fmt: skip


def main() -> None:
    places = [word for word in sys.argv[1:] if word != "--axes"]
    print(HEAD)
    for start in map(Path, places or [str(CLIPS)]):
        for path in clips_in(start):
            try:
                for line in lines_of(path, axes="--axes" in sys.argv):
                    print(line.text())
            except MocapSkelError as error:
                print(f"{path}: {error}", file=sys.stderr)


if __name__ == "__main__":
    main()
