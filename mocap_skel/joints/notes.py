"""What there is to say of a fit as a whole, in plain sentences: its joints, its markers, its choices."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from mocap_skel.joints.calibration import calibration_note
from mocap_skel.joints.choices import SHAPED
from mocap_skel.joints.joint_fit import PRIOR, JointFit
from mocap_skel.joints.task import Task
from mocap_skel.segments.prepare import Prepared
from mocap_skel.text import listed

# Sizes beside a person of 1.75 m that no one has who stands before cameras: then it is the unit.
SMALLEST, LARGEST = 0.3, 1.6


def fit_notes(
    joints: Sequence[JointFit], calibrated: Mapping[str, str], prepared: Prepared, task: Task
) -> Iterator[str]:
    """One sentence a kind, however many joints: a leg-only clip of the standard human has many of some.

    Args:
        joints: all of the fit.
        calibrated: joint → the calibration's share in it, in words.
        prepared: the clip's markers.
        task: what was fitted, and how.
    """
    lost = [f"{listed(markers)} ({name})" for name, markers in prepared.lost.items()]
    if lost:
        yield f"markers missing in every frame: {'; '.join(lost)}"
    unfitted = [f"{j.joint} ({j.reason})" for j in joints if not j.fitted]
    if unfitted:
        yield f"joints not fitted: {listed(unfitted, 20)}"
    guessed = [f"{j.joint} ({j.reason})" for j in joints if j.method == PRIOR]
    if guessed:
        yield f"joints from anatomy alone: {listed(guessed, 20)}"
    unknown = [j.joint for j in joints if j.fitted and j.shown == "no" and not j.landmarks]
    if unknown:
        yield f"place holders, no joint centres (shown: no): {listed(unknown, 20)}"
    if task.calibration is not None:
        yield calibration_note(calibrated)
    if not SMALLEST < task.size < LARGEST:
        yield (
            f"the subject measures as {175 * task.size:.0f} cm tall: is the clip's unit right? "
            "(--unit says it)"
        )
    if prepared.noise.note:
        yield prepared.noise.note
    if task.estimation.method not in SHAPED:
        yield (
            f"{task.estimation.method.upper()} leaves in the noise of the segments' frames: elbows and knees may be off "
            "by more than their standard errors"
        )
