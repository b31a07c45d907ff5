"""Sentences about a fit: which joints to trust, which sides differ, what to film for the others."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.results.series import by_sides, sideless
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import counted, listed

# Metres: two standard errors in the direction that is known least. The former is what a lab would publish,
# beyond the latter a joint is somewhere in the limb.
SHARP, USABLE = 0.02, 0.05
# Bones of a person's two sides differ by less (Auerbach & Ruff 2006).
ASYMMETRY = 0.05
# So many movements to ask for at once.
MOST = 3


def verdict(fit: SkeletonFit, rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Which joints to trust, which bones differ between the sides, what to film.

    Args:
        fit: of one subject.
        rows: its `joint_rows`, which the caller has or makes.

    Returns:
        One sentence each. "Known to 2 cm (95 %)" is about the error of a joint's centre: two standard errors in
        the direction in which it is known least. A figure without joints has no sentence.

    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
    >>> from mocap_skel.results.tables import joint_rows
    >>> clip, association = read_clip("sample_data/range_of_motion.c3d"), read_association("cmu", "lower_body")
    >>> fit = fit_skeleton(clip, associate(clip, association)[0], association.skeleton)
    >>> verdict(fit, joint_rows(fit))
    ('Known to 2 cm (95 %): both hips, both knees, both ankles.',)
    """
    return (*_trust(fit), *_sides(rows), *_movements(fit))


def in_short(fit: SkeletonFit) -> str:
    """The one sentence to act on: which joints not to trust, and the movement that would help most.

    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip
    >>> clip, association = read_clip("sample_data/range_of_motion.c3d"), read_association("cmu")
    >>> fit = fit_skeleton(clip, associate(clip, association)[0], association.skeleton)
    >>> in_short(fit)
    'All 14 joints are known to 2 cm (95 %).'
    """
    if not fit.joints:
        return ""
    groups = levels(fit)
    poor = [*groups.get("poor", []), *groups.get("none", [])]
    if "doubt" in groups:
        # Nothing else is worth a thought before the labels are right.
        names = _joints(groups["doubt"], 4)
        return f"Check the labels first: markers at the {names} look exchanged."
    if poor:
        few = f"{len(poor)} of {counted(len(fit.joints), 'joint')}"
        words = f"{few} {'is' if len(poor) == 1 else 'are'} not to be trusted: {_joints(poor, 4)}"
    else:
        sharp = "usable" not in groups
        every = f"All {len(fit.joints)} joints are" if len(fit.joints) > 1 else "The joint is"
        words = f"{every} known to {100 * (SHARP if sharp else USABLE):g} cm (95 %)"
    asked = _asked(fit)
    return f"{words}. Film: {asked[0]}." if asked else f"{words}."


def error_95(joint: JointFit) -> float:
    """Two standard errors of a joint's centre in the direction in which it is known least.

    Metres; infinite for a joint that could not be fitted.
    """
    return 2.0 * joint.worst_error if joint.fitted else float("inf")


def levels(fit: SkeletonFit) -> dict[str, list[str]]:
    """The joints by how well they are known: "sharp", "usable", "poor", "doubt", or "none" for not fitted."""
    groups: dict[str, list[str]] = {}
    for joint in fit.joints:
        # Without a prior a joint that the movement does not show is a place holder.
        placed = joint.shown == "no" and not joint.landmarks
        error = float("inf") if placed else error_95(joint)
        level = "sharp" if error <= SHARP else "usable" if error <= USABLE else "poor"
        level = "doubt" if joint.doubt else level
        groups.setdefault(level if joint.fitted else "none", []).append(joint.joint)
    return groups


def _trust(fit: SkeletonFit) -> Iterator[str]:
    groups = levels(fit)
    words = {
        "sharp": f"Known to {100 * SHARP:g} cm (95 %)",
        "usable": f"known to {100 * USABLE:g} cm",
        "poor": "not to be trusted",
        "doubt": "in doubt, as markers look exchanged",
        "none": "not fitted",
    }
    parts = [f"{words[k]}: {_joints(groups[k])}" for k in words if k in groups]
    if parts:
        first = parts[0][0].upper() + parts[0][1:]
        yield "; ".join([first, *parts[1:]]) + "."
    anatomy = [j.joint for j in fit.joints if j.fitted and j.landmarks and j.share < 0.5]
    if anatomy:
        yield f"More from anatomy than from the movement: {_joints(anatomy)}."


def _joints(names: list[str], most: int = 20) -> str:
    """Names of joints as a list; both sides of one are named together: both knees."""
    groups = by_sides(names)
    return listed(
        [
            f"both {_several(name_in_words(name))}"
            if len(places) == 2
            else name_in_words(names[places[0]])
            for name, places in groups.items()
        ],
        most,
    )


def name_in_words(name: str) -> str:
    """The name of a joint or segment as words.

    >>> name_in_words("LeftKnee"), name_in_words("ThumbCMC")
    ('left knee', 'thumb CMC')
    """
    parts = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|_", " ", name).split()
    return " ".join(part if part.isupper() else part.lower() for part in parts)


def _several(noun: str) -> str:
    return f"{noun}es" if noun.endswith(("s", "x", "ch")) else f"{noun}s"


def _sides(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    found = {
        sideless(row["joint"]): row["side_difference"]
        for row in rows
        if row["side_difference"] is not None and abs(row["side_difference"]) > ASYMMETRY
    }
    if found:
        bones = listed(
            [f"{name_in_words(name)} {100 * abs(d):.0f} %" for name, d in found.items()], 12
        )
        yield f"Bones whose two sides differ in length, measured up to the joint: {bones}."


def _asked(fit: SkeletonFit) -> list[str]:
    """The movements that would show more of joints that are not known sharply, of the worst one first."""
    poor = sorted((j for j in fit.joints if error_95(j) > SHARP), key=error_95, reverse=True)
    asked: dict[str, None] = {}
    for joint in poor:
        movement = fit.skeleton[joint.child].movement
        # No movement shows a joint whose child has no marker.
        if movement and joint.samples:
            asked[movement] = None
    return list(asked)


def _movements(fit: SkeletonFit) -> Iterator[str]:
    chosen = _asked(fit)[:MOST]
    if chosen:
        yield f"To know more, film: {'; '.join(chosen)}."
