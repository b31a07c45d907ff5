"""What several clips of one actor know of the joints, and how another clip takes it over.

Each clip keeps its evidence in its own segments' coordinates, with the segments' markers beside it. Where it
is used, the common markers of the parent say how the two clips' coordinates lie to each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import MocapSkelError
from mocap_skel.joints.evidence import Evidence, information, merged, moved, placed
from mocap_skel.joints.joint_fit import CentreFit, JointFit
from mocap_skel.joints.pooling import by_skin
from mocap_skel.segments.pose import Array, least_squares_pose
from mocap_skel.segments.shape import Shape, median
from mocap_skel.text import listed

# Metres by which the distance of two markers of a segment may differ between clips: skin shifts the median
# places of another movement by less (Leardini et al. 2005: 1 to 3 cm from one extreme to the other), and no
# one puts a marker back more exactly.
REATTACHED = 0.015
# A trunk bends: so many standard deviations about the templates, of both clips, are no re-attachment either.
SPREADS = 3.0
# A joint tells how a segment turns about a line of two markers, and nothing that markers tell.
JOINT_WEIGHT = 1e-3
# Standard deviation, metres, of a joint of which nothing is known; for shares only.
ANYWHERE = 1.0


@dataclass(frozen=True, eq=False)
class Template:
    """The points of a segment in its own coordinates, metres.

    Attributes:
        markers: name → (3,).
        joint: (3,) the joint towards the parent; None for the root.
        rigid: standard deviation of its markers about these places, skin included.
    """

    markers: Mapping[str, Array]
    joint: Array | None
    rigid: float = 0.0


@dataclass(frozen=True, eq=False)
class JointEvidence:
    """What one clip knows of a joint, in its own coordinates of the parent.

    Attributes:
        parent, child: segments.
        markers: of the child, those that `evidence` is of.
        evidence: see `Evidence`.
    """

    parent: str
    child: str
    markers: tuple[str, ...]
    evidence: Evidence


@dataclass(frozen=True, eq=False)
class ClipEvidence:
    """What one clip knows of an actor.

    Attributes:
        clip, subject: names.
        frames, rate: of the clip.
        digest: of its points, which tells the clip when it comes again.
        segments: name → its points.
        joints: name → what is known of it.
    """

    clip: str
    subject: str
    frames: int
    rate: float
    digest: str
    segments: Mapping[str, Template]
    joints: Mapping[str, JointEvidence]


@dataclass(frozen=True)
class Labels:
    """Which label was which marker in the clips of a calibration: what an association file says, or was guessed.

    Attributes:
        source: the association file, or that it was guessed.
        figure: the skeleton as `@skeleton` names it.
        markers: label → (marker, segment).
        ignored: shell patterns of the labels that were left out.
    """

    source: str
    figure: str
    markers: Mapping[str, tuple[str, str]]
    ignored: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Calibration:
    """What several clips know of one actor.

    Attributes:
        skeleton: the figure's name.
        clips: one entry a clip.
        labels: how the clips' markers were named; None where nobody says.
    """

    skeleton: str
    clips: tuple[ClipEvidence, ...]
    labels: Labels | None = None

    def without(self, digest: str) -> Calibration:
        """Less a clip: what a clip knows itself counts once."""
        return replace(self, clips=tuple(c for c in self.clips if c.digest != digest))


@dataclass(frozen=True, eq=False)
class Pooled:
    """What other clips know of a joint, in a clip's own coordinates.

    Attributes:
        evidence: of `markers`, each clip's samples counted by what its skin leaves it to know.
        markers: the child's that the clip has, then others: of other clips only, or re-attached.
        clips: whose it is.
        samples: how many there are, each counted once.
    """

    evidence: Evidence
    markers: tuple[str, ...]
    clips: tuple[str, ...]
    samples: int


@dataclass(frozen=True, eq=False)
class CalibratedJoint:
    """A joint as all clips together have it.

    Attributes:
        joint: in the frame of the clip `clip`, the one that knows most of it.
        clip: its name.
        shares: clip → how much of what the movements tell it gave, 0 to 1, adding up to 1.
    """

    joint: JointFit
    clip: str
    shares: dict[str, float]


@dataclass(frozen=True, eq=False)
class Calibrated:
    """What came of the clips.

    Attributes:
        calibration: to be kept.
        joints: one a joint of the figure that at least one clip shows, in the figure's order.
        notes: what was decided, one sentence each.
        failed: the clips that could not be used, and why.
    """

    calibration: Calibration
    joints: tuple[CalibratedJoint, ...]
    notes: tuple[str, ...]
    failed: tuple[MocapSkelError, ...]


def digest_of(clip: Clip, subject: str) -> str:
    """A clip's points of one subject as a short word, whichever of them an association knows."""
    columns = [i for i, name in enumerate(clip.subjects) if name == subject]
    return sha256(np.ascontiguousarray(clip.points[:, columns]).tobytes()).hexdigest()[:16]


def template_of(markers: Sequence[str], points: Array, shape: Shape | None) -> Template:
    """A segment's markers as `pooled_evidence` compares them with other clips'.

    Args:
        markers: their names.
        points: (frames, M, 3), metres, NaN = missing.
        shape: their rigid shape; without one, two markers have their distance, which is all that counts.
    """
    places: dict[str, Array] = {}
    if shape is not None:
        places = dict(zip(markers, shape.template, strict=True))
    elif len(markers) == 2:
        length = float(median(np.linalg.norm(points[:, 0] - points[:, 1], axis=1)))
        places = {m: np.array([i * length, 0.0, 0.0]) for i, m in enumerate(markers)}
    known = {marker: place for marker, place in places.items() if np.isfinite(place).all()}
    return Template(known, None, shape.sigma if shape else 0.0)


def pooled_evidence(
    calibration: Calibration,
    joint: str,
    parent: Template,
    child: Template,
    markers: Sequence[str],
    looseness: float = 1.0,
) -> tuple[Pooled | None, tuple[str, ...]]:
    """What other clips know of a joint, and a note for each segment that is not the same any more.

    Args:
        calibration: the other clips.
        joint: its name.
        parent: the parent's points in the clip that asks.
        child: the child's; their own coordinates do not matter.
        markers: the child's in that clip, in the order of its columns.
        looseness: how far the joint is from a ball, as `Segment.looseness`.
    """
    found: list[tuple[ClipEvidence, JointEvidence, Evidence, list[str]]] = []
    notes = []
    for clip in calibration.clips:
        known = clip.joints.get(joint)
        if known is None:
            continue
        place, note = aligned(clip.segments[known.parent], parent)
        if note:
            notes.append(f"{known.parent} of {clip.clip} is not used: {note}")
        if place is None:
            continue
        rotation, shift = place
        names = list(known.markers)
        other = clip.segments.get(known.child)
        note = _reattached(other, child) if other else ""
        if note:
            # The joint is still in the same place, but a marker that moved has another distance from it.
            notes.append(f"{known.child} of {clip.clip} has radii of its own: {note}")
            names = [f"{name} ({clip.clip})" for name in names]
        found.append((clip, known, moved(known.evidence, rotation, shift), names))
    if not found:
        return None, tuple(notes)
    every = list(dict.fromkeys([*markers, *(n for *_, names in found for n in names)]))
    shares = by_skin([evidence for _, _, evidence, _ in found], looseness)
    total: Evidence | None = None
    for (_, _, evidence, names), share in zip(found, shares, strict=True):
        one = placed(evidence.counted(share), [every.index(n) for n in names], len(every))
        total = one if total is None else merged(total, one)
    assert total is not None
    samples = int(sum(evidence.count.sum() for _, _, evidence, _ in found))
    return Pooled(total, tuple(every), tuple(c.clip for c, *_ in found), samples), tuple(notes)


def aligned(theirs: Template, ours: Template) -> tuple[tuple[Array, Array] | None, str]:
    """Rotation and shift from their coordinates to ours; or None, and why if markers have moved.

    Least squares over the common markers; where they are fewer than three, or on a line, the joint
    tells the turn about it.
    """
    note = _reattached(theirs, ours)
    if note:
        return None, note
    common = [m for m in ours.markers if m in theirs.markers]
    sides = [[t.markers[m] for m in common] for t in (theirs, ours)]
    weights = [1.0] * len(common)
    if theirs.joint is not None and ours.joint is not None and len(common) < 3:
        for side, template in zip(sides, (theirs, ours), strict=True):
            assert template.joint is not None
            side.append(template.joint)
        weights.append(JOINT_WEIGHT)
    if len(weights) < 3:
        return None, ""
    before, after = (np.array(side) for side in sides)
    pose = least_squares_pose(after[None], before, np.array(weights))
    if not pose.known[0]:
        return None, ""
    return (pose.rotation[0], pose.origin[0]), ""


def _reattached(theirs: Template, ours: Template) -> str:
    """Which markers have moved on their segment, and by how much; "" for none."""
    common = [m for m in ours.markers if m in theirs.markers]
    if len(common) < 2:
        return ""
    limit = max(REATTACHED, SPREADS * float(np.hypot(theirs.rigid, ours.rigid)))
    before, after = (np.array([t.markers[m] for m in common]) for t in (theirs, ours))
    change = np.abs(_distances(before) - _distances(after))
    if change.max() <= limit:
        return ""
    bad = change > limit
    votes = bad.sum(axis=1)
    worst = [common[i] for i in np.flatnonzero(votes == votes.max())]
    return f"{listed(worst)} re-attached, distances differ by {1e3 * change.max():.0f} mm"


def _distances(points: Array) -> Array:
    return np.asarray(np.linalg.norm(points[:, None] - points[None], axis=2))


def share_of(pooled: Evidence, own: Evidence | None, centre: Array) -> float:
    """How much of a centre the pooled evidence gives, beside a clip's own: mean over the directions."""
    theirs = information(pooled, centre)
    total = theirs + (0.0 if own is None else information(own, centre)) + np.eye(3) / ANYWHERE**2
    gain = np.linalg.solve(total, theirs)
    known = (
        np.trace(gain) if own is None else np.trace(np.eye(3) - np.linalg.inv(total) / ANYWHERE**2)
    )
    return float(np.clip(np.trace(gain) / max(float(known), 1e-12), 0.0, 1.0))


def credited(found: CentreFit, pooled: Pooled, own: int) -> tuple[CentreFit, str]:
    """A centre that says how much of it the calibration gives, and those words alone.

    Args:
        found: the centre by the clip's own evidence and the pooled one.
        pooled: what the calibration knows of it.
        own: how many of the markers are in the clip itself: those whose radius is kept.
    """
    share = share_of(pooled.evidence, found.evidence, found.centre)
    count = len(pooled.clips)
    words = f"calibration ({count} clip{'s' if count > 1 else ''}) {100 * share:.0f} %"
    reason = "; ".join(filter(None, [found.reason, words]))
    samples = pooled.samples + (0 if found.evidence is None else int(found.evidence.count.sum()))
    return replace(found, reason=reason, radius=found.radius[:own], samples=samples), words


def calibration_note(used: Mapping[str, str]) -> str:
    """The note of a fit with a calibration: joint → what the calibration gives of it, or that it gives nothing."""
    if used:
        said = [f"{joint}: {words}" for joint, words in used.items()]
        return f"from the calibration: {listed(said, 20)}"
    return "nothing of the calibration could be used: another actor, other markers, or this clip alone?"
