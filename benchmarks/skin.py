"""What skin does to joints whose bones were seen: `python benchmarks/skin.py [FOLDER]`.

Prints each number that carries the standard errors of `fit`: what the code has, what the papers say, and what
the clips in FOLDER (skin markers over bones that were seen, `NAME.truth.csv` beside `NAME.c3d`) ask for.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from validation.folder import choose
from validation.references import TRUTH, find_references

from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.fit import fit_skeleton
from mocap_skel.joints.choices import Estimation
from mocap_skel.joints.samples import Frame, JointSamples, gather
from mocap_skel.joints.skin import COMMON, SLIDE, USUAL, skin_error
from mocap_skel.joints.sphere import fit_markers
from mocap_skel.readers import read_clip
from mocap_skel.report.terminal import table

ROOT = Path(__file__).parent.parent
CLIPS = Path(os.environ.get("MOCAP_SKEL_CLIPS", ROOT.parent / "shared" / "clips")) / "pins"
# Mean and standard deviation over people of the distance from the true hip, mm: functional on skin, Harrington on
# skin (dual fluoroscopy, Fiorentino 2016, Ann Biomed Eng 44, 2168), Harrington on bone landmarks (CT, Mantovani 2016,
# Gait Posture 44, 48). Thickness of skin over the landmarks, the latter.
FUNCTIONAL, HARRINGTON, ON_BONE = (11.0, 3.3), (13.2, 6.5), (12.3, 5.9)
ASIS, PSIS = (9.7, 7.0), (19.6, 10.9)
# Millimetres, from where one person puts a marker on an iliac spine to where another does (Della Croce 2005, Gait
# Posture 21, 226): the middle of 15 to 20. It is a person's habit, alike on both sides.
PLACED = 17.5
# Harrington's share of the pelvis' depth, and those of its width outwards and down.
DEPTH, OUT, DOWN = 0.24, 0.33, 0.30


def each_axis(mean: float, sd: float) -> float:
    """Standard deviation along an axis of errors whose length has this mean and standard deviation.

    >>> round(each_axis(11.0, 3.3), 1)
    6.6
    """
    return float(np.sqrt((mean**2 + sd**2) / 3.0))


def skin_of_depth() -> float:
    """Millimetres: what skin over the pelvis' landmarks adds along its depth, for each is off by itself."""
    return float(np.hypot((1.0 - DEPTH) * ASIS[1], DEPTH * PSIS[1]))


def placing() -> tuple[float, float, float]:
    """Millimetres outwards, to the front and up: what a person's habit of placing the markers adds to Harrington's hip.

    Between the front and the back markers the pelvis has its share of both habits; outwards, both sides go apart, and
    the width goes with them.
    """
    habit = PLACED / np.sqrt(3.0)
    between = habit * np.hypot(1.0 - DEPTH, DEPTH)
    return 2.0 * OUT * habit, float(between), float(np.hypot(between, 2.0 * DOWN * habit))


@dataclass(frozen=True)
class Seen:
    """A joint whose bones were seen.

    Attributes:
        name: of the clip and the joint.
        looseness: of the joint.
        skin: millimetres, smooth residual, root mean square.
        places: that the markers' directions cover.
        slide: metres a radian of slide for each metre of skin, for a looseness of 1, with which the motion's centre
            would be off as much as its covariance says; 0 where it is off by less without any.
        wobble: radians by which the child turns about the axis that it turns about least.
    """

    name: str
    looseness: float
    skin: float
    places: float
    slide: float
    wobble: float


def joints_seen(path: Path) -> list[Seen]:
    """The joints of one clip whose bones were seen."""
    clip = read_clip(path)
    seen = {r.joint: r for r in find_references(path, clip).found if r.kind == TRUTH}
    known, assignments = choose(clip, str(path.with_name(f"{path.stem}.map.txt")))
    loose = {s.joint: s.looseness for s in known.skeleton.segments}
    columns = assignments[0].columns
    fit = fit_skeleton(clip, assignments[0], known.skeleton)
    found = []
    for joint in fit.joints:
        if joint.joint not in seen or joint.evidence is None:
            continue
        pose = fit.segments[joint.parent].pose
        points = pose.to_segment(clip.points[:, [columns[joint.child][m] for m in joint.markers]])
        samples = JointSamples(points, fit.sigma, fit.sigma, Frame(None))
        sphere = fit_markers(gather(samples, None), Estimation())
        truth = np.nanmean(pose.to_segment(seen[joint.joint].track[:, None])[:, 0], axis=0)
        looseness = loose[joint.joint]
        skin = skin_error(sphere, looseness)
        rest = skin.covariance - skin.slide * np.eye(3) + sphere.covariance(shown=True)
        slide = needed(sphere.fit.centre - truth, rest)
        rate = slide / np.sqrt(skin.taken * skin.smooth / skin.places) / looseness
        shared = joint.evidence.shared
        wobble = np.nan if shared is None else np.sqrt(max(np.linalg.eigvalsh(shared.turns)[0], 0))
        found.append(
            Seen(
                f"{path.stem} {joint.joint}", looseness, 1e3 * np.sqrt(skin.smooth), skin.places, rate,
                float(wobble),
            )
        )  # fmt: skip
    return found


def needed(error: np.ndarray, rest: np.ndarray) -> float:
    """Metres: the standard deviation that makes an error (3,) as large as its covariance says, χ² of 3.

    >>> needed(np.array([0.03, 0.0, 0.0]), np.zeros((3, 3)) + 1e-12 * np.eye(3)).__round__(4)
    0.0173
    """
    low, high = 0.0, float(np.linalg.norm(error))
    for _ in range(60):
        middle = 0.5 * (low + high)
        square = error @ np.linalg.solve(rest + middle**2 * np.eye(3), error)
        low, high = (middle, high) if square > 3 else (low, middle)
    return high


def literature() -> str:
    """What follows from the papers, beside the skeleton's prior of the hip and what the code has."""
    hip = next(s for s in read_skeleton("human").segments if s.joint == "RightHip").priors[0]
    out, front, up = placing()
    bone, (_, depth, down) = each_axis(*ON_BONE), (s.sd for s in hip.shifts)
    # A functional trial: what its fit takes of seven markers' skin in 3.8 places, and what they have in common.
    common = COMMON * 2.5 * np.sqrt(7 * 3.8 / (7 * 3.8 - 10) / 3.8)
    lines = [
        f"functional hip on skin, each axis: {each_axis(*FUNCTIONAL):.1f} mm (Fiorentino 2016)",
        f"Harrington on skin, each axis: {each_axis(*HARRINGTON):.1f} mm (Fiorentino 2016)",
        f"Harrington on bone, each axis: {each_axis(*ON_BONE):.1f} mm (Mantovani 2016)",
        f"placing the markers: {out:.1f} mm outwards, {front:.1f} to the front, {up:.1f} up (Della Croce 2005)",
        f"skin over the pelvis along its depth: {skin_of_depth():.1f} mm (Mantovani 2016)",
        f"together: {np.hypot(bone, out):.1f} mm outwards, {np.hypot(np.hypot(bone, front), skin_of_depth()):.1f} to "
        f"the front, {np.hypot(bone, up):.1f} up; prior: {1e3 * hip.sd:.1f}, {1e3 * np.hypot(hip.sd, depth):.1f}, "
        f"{1e3 * np.hypot(hip.sd, down):.1f}",
        f"COMMON {COMMON:g}: a functional trial of 7 markers with residuals of 2.5 mm at 3.8 places, 4 mm of its "
        f"markers' disagreement and {common:.1f} mm in common is {np.hypot(4.0, common):.1f} mm off along each axis",
        f"skin of a limb: {1e3 * USUAL * 0.3 * np.pi / 2:.0f} mm for 90 degrees at 30 cm (Leardini 2005: about a "
        "centimetre)",
    ]
    return "\n".join(lines)


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else CLIPS
    print(literature())
    paths = [p for p in sorted(folder.glob("*.c3d")) if p.with_suffix(".truth.csv").exists()]
    rows = [row for path in paths for row in joints_seen(path)]
    head = ("bones seen", "looseness", "skin mm", "places", "slide m/rad/m", "least turn rad")
    cells = [
        (r.name, f"{r.looseness:g}", f"{r.skin:.1f}", f"{r.places:.1f}", f"{r.slide:.1f}", f"{r.wobble:.3f}")
        for r in rows
    ]  # fmt: skip
    print(table(head, cells, frozenset({0})))
    loose = [r.slide for r in rows if r.looseness > 1]
    if loose:
        root = np.sqrt(np.mean(np.square(loose)))
        print(f"SLIDE {SLIDE:g}: {len(loose)} loose joints ask for {root:.1f} (root mean square)")


if __name__ == "__main__":
    main()
