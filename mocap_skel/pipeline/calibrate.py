"""Many clips of one actor, calibrated together.

Three rounds: each clip alone; then twice each clip with what the others knew the round before. A frame below
a joint stands on that joint, so each round's evidence is taken in frames that the round before made better;
no clip goes before another, and the order of the clips does not matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError, FitError, MocapSkelError
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
from mocap_skel.labels.association import Assignment, associate
from mocap_skel.pipeline.job import Job
from mocap_skel.readers import read_clip
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import listed

ROUNDS = 2


def calibrate(paths: Sequence[Path], job: Job) -> Calibrated:
    """Read the clips and calibrate the one actor that they show.

    Raises:
        CallError: a clip of several subjects, and none was chosen; one clip twice.
        MocapSkelError: no clip can be used.
    """
    clips: list[tuple[Clip, Assignment]] = []
    failed: list[MocapSkelError] = []
    notes: list[str] = []
    for path in paths:
        try:
            clip = read_clip(
                path, unit=job.unit, rate=job.rate, salvage=job.salvage, mirror=job.mirror
            )
            assignment = _only_subject(path, clip, job)
        except CallError:
            raise
        except MocapSkelError as error:
            failed.append(error)
            continue
        notes += [f"{path}: {note}" for note in clip.notes]
        clips.append((clip, assignment))
    if not clips:
        raise failed[0]
    return _calibrated(clips, job, notes, failed)


def _only_subject(path: Path, clip: Clip, job: Job) -> Assignment:
    found = associate(clip, job.known, job.subject)
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
    first: FitError | None = None
    names = _short_names([clip.name for clip, _ in clips])
    for clip, assignment in clips:
        digest = digest_of(clip, assignment.subject)
        if digest in evidence:
            raise CallError(f"{clip.name} is the same recording as {called[digest]}")
        called[digest] = names[clip.name]
        try:
            fits[digest] = job.fit(clip, assignment)
        except FitError as error:
            failed.append(error)
            first = first or error
            continue
        evidence[digest] = _known(fits[digest], digest, called)
        usable.append((digest, clip, assignment))
    if not usable:
        raise first or failed[0]
    skeleton = job.known.skeleton.name
    for _ in range(ROUNDS if len(usable) > 1 else 0):
        # By digest, so that sums over clips round alike whatever their order in the call.
        together = Calibration(skeleton, tuple(evidence[d] for d in sorted(evidence)))
        for digest, clip, assignment in usable:
            fits[digest] = replace(job, calibration=together).fit(clip, assignment)
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
