"""Many clips of one actor, calibrated together.

Three rounds: each clip alone; then twice each clip with what the others knew the round before. A frame below
a joint stands on that joint, so each round's evidence is taken in frames that the round before made better;
no clip goes before another, and the order of the clips does not matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError, ClipError, FitError, MocapSkelError
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.joints.calibration import (
    Calibrated,
    CalibratedJoint,
    Calibration,
    ClipEvidence,
    JointEvidence,
    Template,
    digest_of,
)
from mocap_skel.joints.evidence import information
from mocap_skel.joints.strangers import Body, strangers
from mocap_skel.labels.association import Assignment, Association, associate
from mocap_skel.labels.calibrated import labels_of
from mocap_skel.pipeline.job import Job
from mocap_skel.pipeline.limits import limited
from mocap_skel.pipeline.naming import Named
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import listed

ROUNDS = 2
# Metres: a bone that is known less, or shorter, tells nothing of a person's size.
UNKNOWN, SHORTEST = 0.04, 0.1


def calibrate(paths: Sequence[Path], job: Job) -> Calibrated:
    """Read the clips and calibrate the one actor that they show.

    Raises:
        CallError: a clip of several subjects, and none was chosen; one clip twice; clips of several people.
        MocapSkelError: no clip can be used.
    """
    clips: list[tuple[Clip, Assignment]] = []
    failed: list[MocapSkelError] = []
    notes: list[str] = []
    associations: list[Association] = []
    figure: Skeleton | None = None
    for path in paths:
        try:
            with limited(path):
                found = job.named(job.read(path))
            figure = figure or found.association.skeleton
            assignment = _only_subject(path, found, figure, job.subject)
        except CallError:
            raise
        except MocapSkelError as error:
            failed.append(error)
            continue
        notes += [f"{path}: {note}" for note in found.notes]
        if rest := [other.skeleton.name for other in found.associations[1:]]:
            notes.append(
                f"{path}: only {figure.name} is calibrated: --skeleton takes {listed(rest)}"
            )
        associations.append(found.association)
        clips.append((found.whole, assignment))
    if not clips:
        raise failed[0]
    labels, against = labels_of(associations)
    done = _calibrated(clips, replace(job, association=associations[0]), notes, failed)
    return replace(
        done, calibration=replace(done.calibration, labels=labels), notes=(*against, *done.notes)
    )


def _only_subject(path: Path, named: Named, figure: Skeleton, subject: str | None) -> Assignment:
    own = named.association.skeleton
    if own.name != figure.name:
        raise CallError(
            f"{path}: guessed to show {own.name}, the first clip {figure.name}",
            "a calibration is of one figure: give --assoc, or --skeleton",
        )
    found = associate(named.whole, named.association, subject)
    if len(found) > 1:
        raise CallError(
            f"{path}: holds several subjects: {listed([a.subject for a in found])}",
            "a calibration is of one: choose with --subject",
        )
    return found[0]


def _calibrated(
    clips: list[tuple[Clip, Assignment]],
    job: Job,
    notes: list[str],
    failed: list[MocapSkelError],
) -> Calibrated:
    fits: dict[str, SkeletonFit] = {}
    evidence: dict[str, ClipEvidence] = {}
    called: dict[str, str] = {}
    usable: list[tuple[str, Clip, Assignment]] = []
    first: MocapSkelError | None = None
    names = _short_names([clip.name for clip, _ in clips])
    for clip, assignment in clips:
        digest = digest_of(clip, assignment.subject)
        if digest in evidence:
            raise CallError(f"{clip.name} is the same recording as {called[digest]}")
        called[digest] = names[clip.name]
        try:
            fits[digest] = _fitted(job, clip, assignment)
        except (ClipError, FitError) as error:
            failed.append(error)
            first = first or error
            continue
        evidence[digest] = _known(fits[digest], digest, called)
        usable.append((digest, clip, assignment))
    if not usable:
        raise first or failed[0]
    _check_one_person([_body(fits[digest], called[digest]) for digest, _, _ in usable])
    skeleton = job.known.skeleton.name
    for _ in range(ROUNDS if len(usable) > 1 else 0):
        # By digest, so that sums over clips round alike whatever their order in the call.
        together = Calibration(skeleton, tuple(evidence[d] for d in sorted(evidence)))
        for digest, clip, assignment in usable:
            fits[digest] = _fitted(replace(job, calibration=together), clip, assignment)
        evidence = {d: _known(fits[d], d, called) for d, _, _ in usable}
    for digest, _, _ in usable:
        notes += [f"{called[digest]}: {note}" for note in fits[digest].notes]
    calibration = Calibration(skeleton, tuple(evidence[d] for d, _, _ in usable))
    joints = [
        found
        for segment in job.known.skeleton.segments
        if segment.joint and (found := _joint(segment.joint, fits, called)) is not None
    ]
    return Calibrated(calibration, tuple(joints), tuple(dict.fromkeys(notes)), tuple(failed))


def _fitted(job: Job, clip: Clip, assignment: Assignment) -> SkeletonFit:
    """The clip's fit, in no more memory than the clip may take."""
    with limited(Path(clip.name)):
        return job.fit(clip, assignment)


def _check_one_person(bodies: list[Body]) -> None:
    """Refuse clips of several people.

    Raises:
        CallError: they are; it says whose clips are whose.
    """
    groups, why = strangers(bodies)
    if len(groups) > 1:
        people = " | ".join(listed(group) for group in groups)
        raise CallError(
            f"these clips show {len(groups)} people, not one: {people}: {why}",
            "a calibration is of one actor: calibrate each by itself",
        )


def _body(fit: SkeletonFit, name: str) -> Body:
    """What a clip's own fit tells of the size and shape of its actor."""
    # Without a prior, a joint that the movement does not show is a place holder.
    joints = {j.joint: j for j in fit.joints if j.fitted and (j.shown != "no" or j.landmarks)}
    above = {j.child: j for j in joints.values()}
    bones = {}
    for joint in joints.values():
        segment = fit.segments.get(joint.parent)
        upper = above.get(joint.parent)
        if segment is None or segment.joint is None or upper is None:
            continue
        bone = joint.centre - segment.joint
        length = float(np.linalg.norm(bone))
        if length < SHORTEST:
            continue
        # Where the bone lies as each joint's own frame sees it: a hinge is not known along its axis only.
        along = bone / length
        parent = fit.segments[upper.parent].pose.rotation
        seen = parent.swapaxes(1, 2) @ segment.pose.rotation @ along
        above_along = np.nan_to_num(seen[np.isfinite(seen).all(axis=1)].mean(axis=0))
        error = float(
            np.sqrt(along @ joint.covariance @ along + above_along @ upper.covariance @ above_along)
        )
        if error < UNKNOWN:
            bones[f"{joint.parent} to {joint.joint}"] = length, error
    segments = {
        name: Template(segment.template, segment.joint, segment.rigid)
        for name, segment in fit.segments.items()
    }
    return Body(name, segments, bones)


def _short_names(paths: list[str]) -> dict[str, str]:
    """Clip → its file's name, where no other clip has the same."""
    files = [Path(path).name for path in paths]
    return {p: f if files.count(f) == 1 else p for p, f in zip(paths, files, strict=True)}


def _known(fit: SkeletonFit, digest: str, called: dict[str, str]) -> ClipEvidence:
    return replace(evidence_of(fit, digest), clip=called[digest])


def _joint(
    name: str, fits: dict[str, SkeletonFit], called: dict[str, str]
) -> CalibratedJoint | None:
    """A joint from the clip that knows most of it, which has the others' evidence too."""
    known = {
        digest: joint
        for digest, fit in fits.items()
        for joint in fit.joints
        if joint.joint == name and joint.fitted
    }
    if not known:
        return None
    told = {}
    for digest, joint in known.items():
        own = joint.evidence
        told[digest] = 0.0 if own is None else float(information(own, joint.motion).trace())
    total = sum(told.values())
    best = max(known, key=lambda d: (told[d], d))
    shares = {called[d]: told[d] / total if total > 0 else 0.0 for d in known}
    return CalibratedJoint(known[best], called[best], shares)


def evidence_of(fit: SkeletonFit, digest: str) -> ClipEvidence:
    """What a fitted clip knows: its own evidence for every joint in a frame of three points or more."""
    joints = {}
    for joint in fit.joints:
        own = joint.evidence
        parent = fit.segments.get(joint.parent)
        if own is None or parent is None or not parent.drawn_through:
            continue
        if own.count.sum() > 0:
            seen = own.count > 0
            # Behind the clip's own markers come those of other clips only, without a sample here.
            names = tuple(m for m, s in zip(joint.markers, seen, strict=False) if s)
            joints[joint.joint] = JointEvidence(joint.parent, joint.child, names, own[seen])
    segments = {
        name: Template(segment.template, segment.joint, segment.rigid)
        for name, segment in fit.segments.items()
        if segment.drawn_through
    }
    return ClipEvidence(
        fit.clip, fit.subject, len(fit.frame_numbers), fit.rate, digest, segments, joints
    )
