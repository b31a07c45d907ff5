"""The walk down the tree: a clip's markers and a skeleton become poses, joint centres and evidence.

The markers are prepared; each segment, parents first, gets its joint, then its pose; all is put together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import FitError, RootError
from mocap_skel.figure.measured import Measured, size_by, with_measures
from mocap_skel.figure.own_names import in_own_names
from mocap_skel.figure.skeleton import Segment, Skeleton
from mocap_skel.joints.calibration import Calibration, credited, digest_of
from mocap_skel.joints.centre import PriorKnowledge, fit_centre
from mocap_skel.joints.choices import BEST, POSES, PRIORS, Estimation, check_method
from mocap_skel.joints.joint_fit import CentreFit, JointFit, doubted, from_anatomy, unfitted
from mocap_skel.joints.knowledge import JointKnowledge, expected_in, joint_knowledge, turn_axis
from mocap_skel.joints.notes import fit_notes
from mocap_skel.joints.priors import subject_size
from mocap_skel.joints.samples import LEAST_SAMPLES, JointSamples
from mocap_skel.joints.segment_pose import Placed, placed_child, placed_root
from mocap_skel.joints.task import Task
from mocap_skel.labels.association import Assignment
from mocap_skel.segments.left_out import left_out, notes
from mocap_skel.segments.misplaced import checked_columns
from mocap_skel.segments.pose import Array
from mocap_skel.segments.prepare import Prepared, prepare
from mocap_skel.segments.trouble import off_sphere
from mocap_skel.skeleton_fit import SkeletonFit, segment_fit
from mocap_skel.spherefit import DegenerateSphereError
from mocap_skel.text import listed


def fit_skeleton(
    clip: Clip,
    assignment: Assignment,
    skeleton: Skeleton,
    *,
    sigma: float | Array | None = None,
    pose: str = "least-squares",
    method: str = BEST,
    noise: str = "rigid",
    search: bool = True,
    prior: str = "skeleton",
    calibration: Calibration | None = None,
    trust: bool = False,
    measures: Mapping[str, float] | None = None,
) -> SkeletonFit:
    """Fit a skeleton to one subject of a clip.

    Args:
        clip: the recording.
        assignment: which column of it is which marker.
        skeleton: the figure.
        sigma: noise standard deviation of a marker in metres, or its covariance (3, 3) along the
            clip's axes, m²; estimated if None.
        pose: "least-squares" (all visible markers) or "triad" (three-point frames, thesis case 1).
        method: the sphere fit, one of `spherefit.METHODS`; "best" is MGDK, with SGDK where a direction is
            not shown.
        noise: how it is estimated. "rigid": one level for the clip, from the rigidity of the segments.
            "matrix": a whole matrix for the clip, from the same residuals. "marker": a level for each
            marker, from its own radial residuals, and weights that go with it.
        trust: fit markers that look exchanged as they are named, and a mirrored body as it is; both are said.
        search: whether exchanged labels, swapped, ghost and jumping markers are looked for; not in frames that do not follow
            each other, where every step is a jump.
        prior: "skeleton": what the motion does not show is taken from the skeleton's priors, each direction
            by its information. "none": the motion alone, the thesis's pure fit.
        calibration: what other clips of the actor know of the joints; the clip itself, if it is among
            them, counts once.
        measures: of the person, full name (`measures.MEASURES`) → metres; they count before those of the clip's file.

    Raises:
        ValueError: no such pose, method, noise or prior, or two that do not go together.
        LabelError: the body is mirrored, or markers of the root look exchanged.
        RootError: the root segment has no three markers that are seen together off a line.
        FitError: no joint can be fitted.

    >>> from mocap_skel import associate, read_association, read_clip
    >>> clip, cmu = read_clip("sample_data/range_of_motion.c3d"), read_association("cmu")
    >>> fit = fit_skeleton(clip, associate(clip, cmu)[0], cmu.skeleton)
    >>> len(fit.joints), fit.joints[0].joint, fit.joints[0].shown
    (14, 'Waist', 'yes')
    """
    if pose not in POSES:
        raise ValueError(f"pose must be one of {POSES}, got {pose!r}")
    if prior not in PRIORS:
        raise ValueError(f"prior must be one of {PRIORS}, got {prior!r}")
    check_method(method, noise, sigma, calibrated=calibration is not None)
    skeleton = in_own_names(skeleton, assignment.landmarks)
    columns, misplaced, said = checked_columns(
        clip, assignment.columns, skeleton, search=search, trust=trust
    )
    prepared = prepare(clip, columns, sigma=sigma, noise=noise, search=search)
    anatomy = prior != "none"
    size, measured = 1.0, Measured(skeleton, ())
    if anatomy:
        person = {**clip.measures, **(measures or {})}
        size = subject_size(skeleton, prepared.distance, size_by(person))
        if person:
            measured = with_measures(skeleton, person, size, prepared.distance)
            skeleton = measured.skeleton
    if calibration is not None:
        calibration = calibration.without(digest_of(clip, assignment.subject))
    task = Task(
        skeleton,
        Estimation(method, prepared.noise.each),
        pose == "triad",
        search,
        anatomy,
        size,
        calibration,
    )
    walked = _walk(clip.name, prepared, task)
    tracks = {joint.child: joint.track for joint in walked.joints if joint.fitted}
    trouble = left_out(clip, walked.prepared, tracks)
    return SkeletonFit(
        clip=clip.name,
        subject=assignment.subject,
        skeleton=skeleton,
        frame_numbers=clip.frame_numbers,
        rate=clip.rate,
        up=clip.up,
        sigma=prepared.sigma,
        segments={n: segment_fit(p, skeleton, walked.prepared) for n, p in walked.placed.items()},
        joints=tuple(doubted(j, misplaced.doubt(j.parent, j.child)) for j in walked.joints),
        notes=(
            *said,
            *measured.notes,
            *fit_notes(walked.joints, walked.calibrated, prepared, task),
            *walked.notes,
            *notes(trouble, prepared.samples),
        ),
        left_out=trouble,
        zero_frame=clip.zero_frame,
    )


@dataclass(frozen=True, eq=False)
class _Walked:
    """What the walk has found.

    Attributes:
        placed: the segments with a pose, parents first.
        joints: one a joint of the figure, in its order.
        calibrated: joint → the calibration's share in it, in words.
        prepared: the markers, less the samples that are off their joint's sphere.
        notes: one sentence each.
    """

    placed: Mapping[str, Placed]
    joints: tuple[JointFit, ...]
    calibrated: Mapping[str, str]
    prepared: Prepared
    notes: tuple[str, ...]


def _walk(clip: str, prepared: Prepared, task: Task) -> _Walked:
    """Each segment, parents first: its joint in the parent's frame, then its own pose.

    Raises:
        RootError: the root has no pose.
        FitError: no joint can be fitted.
    """
    placed: dict[str, Placed] = {}
    joints: list[_Joined] = []
    said: list[str] = []
    for segment in task.skeleton.segments:
        if segment.parent is None:
            found, words = _root(clip, segment, prepared, task)
        else:
            parent = placed.get(segment.parent)
            joined = _joint(segment, parent, prepared, task)
            joints.append(joined)
            said += joined.notes
            prepared = joined.prepared
            found, words = _child(segment, joined.fit, parent, prepared, task)
        said += words
        if found is not None:
            placed[segment.name] = found
    fits = tuple(one.fit for one in joints)
    # What anatomy alone gives is no fit of this clip.
    if fits and not any(fit.fitted and fit.samples for fit in fits):
        reasons = "; ".join(dict.fromkeys(fit.reason for fit in fits))
        raise FitError(f"{clip}: no joint can be fitted: {reasons}")
    calibrated = {one.fit.joint: one.calibrated for one in joints if one.calibrated}
    # Each joint of a segment says again that another clip's markers on it have moved.
    return _Walked(placed, fits, calibrated, prepared, tuple(dict.fromkeys(said)))


# --- a segment's joint


@dataclass(frozen=True, eq=False)
class _Joined:
    """A joint, and what its fit leaves behind.

    Attributes:
        fit: the joint.
        prepared: the markers, less the samples that are off this joint's sphere.
        calibrated: the calibration's share in words, "" for none.
        notes: one sentence each.
    """

    fit: JointFit
    prepared: Prepared
    calibrated: str = ""
    notes: tuple[str, ...] = ()


def _joint(segment: Segment, parent: Placed | None, prepared: Prepared, task: Task) -> _Joined:
    """The joint towards the parent: by movement, else by anatomy alone, else not fitted."""
    if parent is None:
        return _Joined(_unfitted(segment, prepared, f"{segment.parent} has no pose"), prepared)
    inside = parent.pose.to_segment(prepared.of(segment.name))
    known, said = joint_knowledge(segment, parent, inside, prepared, task)
    if not prepared.markers(segment.name) and known.pooled is None:
        found: CentreFit | str = f"no marker on {segment.name}"
    else:
        found, prepared = _by_movement(inside, segment, parent, known, prepared, task)
    if isinstance(found, str):
        inside = parent.pose.to_segment(prepared.of(segment.name))
        expected = expected_in(segment, parent, inside, prepared, task)
        if expected is None:
            return _Joined(_unfitted(segment, prepared, found), prepared, notes=said)
        centre = from_anatomy(expected, found)
        return _Joined(_named(segment, parent, centre, prepared, task.size), prepared, notes=said)
    words = ""
    if known.pooled is not None:
        found, words = credited(found, known.pooled, len(prepared.markers(segment.name)))
    return _Joined(_named(segment, parent, found, prepared, task.size), prepared, words, said)


def _by_movement(
    inside: Array,
    segment: Segment,
    parent: Placed,
    known: JointKnowledge,
    prepared: Prepared,
    task: Task,
) -> tuple[CentreFit | str, Prepared]:
    """The centre, or why there is none; and the markers, less the samples that are off its sphere."""
    found = _centre(inside, segment, parent, known, prepared, task)
    if isinstance(found, str) or not task.search or not inside.shape[1]:
        return found, prepared
    left = off_sphere(inside, prepared.of(segment.name), found.motion)
    if left is None:
        return found, prepared
    inside = np.where(left[..., None], np.nan, inside)
    found = _centre(inside, segment, parent, known, prepared, task)
    return found, prepared.without(segment.name, left)


def _centre(
    inside: Array,
    segment: Segment,
    parent: Placed,
    known: JointKnowledge,
    prepared: Prepared,
    task: Task,
) -> CentreFit | str:
    """The centre of a segment's markers (frames, M, 3) in the parent's frame, or why there is none."""
    pooled, noise = known.pooled, prepared.noise
    if pooled is not None:
        more = len(pooled.markers) - inside.shape[1]
        inside = np.concatenate([inside, np.full((len(inside), more, 3), np.nan)], axis=1)
    own = prepared.shapes[segment.name][0].sigma if segment.name in prepared.shapes else 0.0
    samples = JointSamples(
        inside,
        noise.sigma,
        max(own, noise.sigma),
        parent.frame,
        noise.in_frame(parent.pose),
        known.shared,
    )
    before = PriorKnowledge(
        known.expected,
        segment.looseness,
        None if pooled is None else pooled.evidence,
        task.size,
    )
    try:
        found = fit_centre(samples, task.estimation, before)
    except DegenerateSphereError as error:
        return f"{task.estimation.method.upper()}: {error.message}"
    few = f"{segment.name} and {segment.parent} are seen together in fewer than {LEAST_SAMPLES} frames"
    return few if found is None else found


def _named(
    segment: Segment, parent: Placed, found: CentreFit, prepared: Prepared, size: float
) -> JointFit:
    """A centre as a joint: with its names, its track in the lab, and the markers that were used."""
    assert segment.parent is not None and segment.joint is not None
    used = np.isfinite(found.radius)
    names = prepared.markers(segment.name)
    found = replace(found, radius=found.radius[used])
    return JointFit(
        joint=segment.joint,
        parent=segment.parent,
        child=segment.name,
        markers=tuple(names[i] for i in np.flatnonzero(used)),
        track=parent.pose.to_lab(found.centre),
        turns_on=turn_axis(segment, parent, found.centre, prepared, size),
        **{f.name: getattr(found, f.name) for f in fields(CentreFit)},
    )


def _unfitted(segment: Segment, prepared: Prepared, reason: str) -> JointFit:
    assert segment.parent is not None and segment.joint is not None
    return unfitted(segment.joint, segment.parent, segment.name, prepared.frames, reason)


# --- a segment's pose


def _root(
    clip: str, segment: Segment, prepared: Prepared, task: Task
) -> tuple[Placed | None, tuple[str, ...]]:
    """The root's pose, and notes.

    Raises:
        RootError: its markers give none.
    """
    if segment.name not in prepared.shapes:
        raise RootError(
            f"{clip}: the root segment {segment.name} needs three markers that are seen "
            f"together off a line; the clip has {listed(prepared.markers(segment.name)) or 'none'}",
            f"its markers: {listed(segment.markers, 12)}",
            tuple(s.name for s in task.skeleton.segments if s.name in prepared.shapes),
        )
    return _with_a_pose(placed_root(segment, prepared, task))


def _child(
    segment: Segment, joint: JointFit, parent: Placed | None, prepared: Prepared, task: Task
) -> tuple[Placed | None, tuple[str, ...]]:
    """The pose of a segment below a fitted joint, and notes; none without a marker of its own."""
    if parent is None or not joint.fitted or not prepared.markers(segment.name):
        return None, ()
    found, note = placed_child(segment, joint, parent, prepared, task)
    return _with_a_pose(found, note)


def _with_a_pose(found: Placed, *said: str) -> tuple[Placed | None, tuple[str, ...]]:
    """A segment, or none if no frame determines its pose; and notes."""
    words = tuple(filter(None, said))
    if found.pose.known.any():
        return found, words
    if found.posed.shape is not None:
        words = (*words, f"{found.segment.name} has no pose in any frame")
    return None, words
