"""Draw one SVG for each joint: its three angles, at rest (grey) and turned by +30 degrees (blue).

    python docs/angles/draw.py

The figure is the generated human, and the turns are those of `mocap_skel/figure/angles.toml`, so the drawings show what
the program computes. It is the right side; the left one is its mirror image.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mocap_skel.artificial import Motion, from_vector, human
from mocap_skel.figure.angle_table import AngleRule, angle_table

HERE = Path(__file__).parent
DEGREES, SIZE, MARGIN = 30.0, 190, 16
# Anatomical axes in the generated human's: x forward, y to the left, z up.
AXES = {"X": (1.0, 0, 0), "Y": (0, 0, 1.0), "Z": (0, -1.0, 0)}
# Seen along the axis of the turn: what is to the right and up on the paper, and from where.
VIEWS = {
    "Z": ((1.0, 0, 0), (0, 0, 1.0), "from the right, front at the right"),
    "X": ((0, 1.0, 0), (0, 0, 1.0), "from the front, the right side at the left"),
    "Y": ((0, -1.0, 0), (1.0, 0, 0), "from above, front at the top"),
}
# Half of a bar across the end of a bone, metres: it shows a turn about the bone.
BARS = {"Foot": 0.05, "Hand": 0.05, "Head": 0.09, "Hips": 0.14, "Chest": 0.17, "Arm": 0.05}


def turns(rule: AngleRule, part: int | None) -> dict[str, np.ndarray]:
    """Rotations where one of the angles is +30 degrees and the others are 0; at rest without one."""
    made = np.eye(3)
    arm = rule.sequence == "YXY"
    # An arm that hangs has no plane: it is drawn raised, and the bent elbow shows its turn.
    angles = [60.0 * (arm and i == 1) + DEGREES * (i == part) for i in range(3)]
    for axis, angle, sign in zip(rule.sequence, angles, rule.signs, strict=True):
        made = made @ from_vector(np.radians(sign * angle) * np.array(AXES[axis]))
    bent = {"LowerRightArm": from_vector(np.pi / 2 * np.array(AXES["Z"]))[None]} if arm else {}
    return {rule.child: made[None], **bent}


def lines(rule: AngleRule, rotations: dict[str, np.ndarray]) -> Iterator[tuple[str, np.ndarray]]:
    """Segment, and the two ends of each of its lines (2, 3)."""
    figure = human()
    poses = figure.poses(Motion(1.0, np.zeros((1, 3)), rotations))
    for name in wanted(rule):
        pose, bone = poses[name], figure.bones[name]
        end = pose.place(bone)[0]
        yield name, np.array([pose.origin[0], end])
        for word, half in BARS.items():
            if word in name:
                at = bone if word != "Hips" else np.zeros(3)
                sides = [pose.place(at + half * s * np.array([0, 1.0, 0]))[0] for s in (-1, 1)]
                yield name, np.array(sides)
                if word in ("Head", "Hand", "Arm", "Chest", "Hips"):
                    yield name, np.array([pose.place(at)[0], pose.place(at + [half, 0, 0])[0]])


def wanted(rule: AngleRule) -> list[str]:
    """The parent, the child, and what hangs from it along the limb."""
    figure = human()
    names = [rule.parent] if rule.parent else []
    names.append(rule.child)
    for segment in figure.segments:
        limb = segment.parent in names and segment.parent != rule.parent
        side = "Left" not in segment.name and "Right" not in segment.name
        if limb and (side == (rule.child in ("Hips", "Chest")) or "Right" in rule.child):
            names.append(segment.name)
    return list(dict.fromkeys(names))


def panel(rule: AngleRule, part: int, left: int) -> str:
    """One drawing: a turn, seen along its axis where that can be."""
    # The third turn of a raised arm is about the arm: it is seen from its end.
    axis = "Z" if rule.sequence == "YXY" and part == 2 else rule.sequence[part]
    across, up, view = VIEWS[axis]
    flat = np.stack([across, up], axis=1)
    drawn = {
        "#aaa": [(n, ends @ flat) for n, ends in lines(rule, turns(rule, None))],
        "#0072B2": [(n, ends @ flat) for n, ends in lines(rule, turns(rule, part))],
    }
    every = np.concatenate([ends for some in drawn.values() for _, ends in some])
    low, high = every.min(axis=0), every.max(axis=0)
    scale = (SIZE - 2 * MARGIN) / max(high - low)
    middle = (low + high) / 2
    text = []
    for colour, some in drawn.items():
        for name, ends in some:
            here = colour if name != rule.parent else "#333"
            (a, b), (c, d) = (ends - middle) * scale * [1, -1] + [left + SIZE / 2, 30 + SIZE / 2]
            text.append(
                f'<line x1="{a:.1f}" y1="{b:.1f}" x2="{c:.1f}" y2="{d:.1f}" stroke="{here}" '
                'stroke-width="3" stroke-linecap="round"/>'
            )
    title = f'<text x="{left + SIZE / 2}" y="18" text-anchor="middle">+{DEGREES:g}° {rule.parts[part]}</text>'
    under = f'<text x="{left + SIZE / 2}" y="{SIZE + 44}" text-anchor="middle" font-size="9">{view}</text>'
    return "\n".join([title, *text, under])


def drawing(rule: AngleRule) -> str:
    """The SVG of a joint."""
    width, height = 3 * SIZE + 40, SIZE + 54
    panels = "\n".join(panel(rule, part, part * (SIZE + 20)) for part in range(3))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'height="{height}" font-family="sans-serif" font-size="13">\n'
        f'<rect width="{width}" height="{height}" fill="white"/>\n{panels}\n</svg>\n'
    )


def main() -> None:
    """Write every drawing beside this file."""
    for rule in angle_table().angles:
        if not rule.mirrored:
            name = rule.name.replace("Right", "").lower()
            (HERE / f"{name}.svg").write_text(drawing(rule), encoding="utf-8", newline="")


if __name__ == "__main__":
    main()
