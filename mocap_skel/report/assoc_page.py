"""One HTML page on which a person sees which marker each label is, corrects it, and saves the association file.

As the report page it is one file and loads nothing, and no name out of a clip can become a part of it.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from mocap_skel.clip import AXES, Clip, turn_between
from mocap_skel.figure.skeleton import STANDARD
from mocap_skel.report.inline import asset, in_json, policy, text
from mocap_skel.report.scene import floor_height, middles, pack, step_of, steps_of
from mocap_skel.results.assoc_start import Start, rigid_group_of
from mocap_skel.results.series import side
from mocap_skel.segments.pose import Array
from mocap_skel.version import __version__

# Frames on the page: enough to see how a marker moves, and few enough for the page to compare the distances
# of all markers while its user waits.
MOST_FRAMES = 400
# A point so many times as far from the middle as the usual marker does not decide how far the camera stands.
FAR = 4.0


def assoc_page(clip: Clip, start: Start) -> str:
    """The text of the whole page, one HTML file that loads nothing.

    Args:
        clip: the recording.
        start: what its labels are so far, from `start_from_guess` or `start_from_file`.

    >>> from mocap_skel import read_clip
    >>> from mocap_skel.results.assoc_start import start_from_guess
    >>> clip = read_clip("sample_data/nearly_still.c3d")
    >>> assoc_page(clip, start_from_guess(clip))[:15]
    '<!doctype html>'
    """
    # As for `scene`: the viewer knows what points up by the number of an axis.
    turn = turn_between(clip.up, clip.up[-1])
    clip = replace(clip, points=clip.points @ turn.T, up=clip.up[-1])
    about, packed = _scene(clip, start)
    style, script = asset("assoc.css"), asset("viewer.bundle.js")
    return Template(asset("assoc.html")).substitute(
        policy=policy(script, style),
        style=style,
        script=script,
        title=text(Path(clip.name).name),
        said=text(start.said),
        frames=f"{clip.frames} frames at {clip.rate:g} Hz"
        + (f", one of {about['every']} is on this page" if about["every"] > 1 else ""),
        version=text(__version__),
        scene=in_json(about),
        samples=base64.b64encode(packed).decode(),
    )


def _scene(clip: Clip, start: Start) -> tuple[dict[str, Any], bytes]:
    """What the page's script gets: names and links for JSON, and the movement as `pack` has it."""
    columns = list(start.columns)
    every = max(1, -(-clip.frames // MOST_FRAMES))
    thinned = clip.points[::every, columns]
    subjects = [s for s in clip.subject_names if any(clip.subjects[c] == s for c in columns)]
    own = [[i for i, c in enumerate(columns) if clip.subjects[c] == s] for s in subjects]
    # The middle of each subject is a point more: the camera follows it.
    homes = [_home(thinned[:, i]) for i in own]
    positions = np.concatenate([thinned, np.stack(homes, axis=1)], axis=1)
    middle = middles(positions)
    step = step_of(positions - middle)
    rows = steps_of(positions - middle, step).reshape(len(positions), -1).T
    groups = rigid_group_of(clip, columns)
    seen = clip.missing()[columns] < 1.0
    about = {
        "clip": Path(clip.name).name,
        "frames": len(positions),
        "firstFrame": int(clip.first_frame),
        "zeroFrame": float(clip.zero_frame),
        "every": every,
        "rate": float(clip.rate),
        "up": AXES.index(clip.up),
        "floor": floor_height(thinned[..., AXES.index(clip.up)]),
        "front": _front(clip, start).tolist(),
        "step": step,
        "middle": np.round(middle, 6).tolist(),
        "points": positions.shape[1],
        "joints": [],
        "bones": [],
        "subjects": [
            {"name": name, "root": len(columns) + i, "ends": _near(thinned, home, of)}
            for i, (name, home, of) in enumerate(zip(subjects, homes, own, strict=True))
        ],
        "markers": [
            {
                "label": clip.labels[c],
                "subject": clip.subjects[c],
                "seen": bool(seen[i]),
                "group": groups.get(c, -1),
                "marker": start.placed[c].marker,
                "segment": start.placed[c].segment,
                "ignored": start.placed[c].ignored,
                "offered": list(start.placed[c].offered),
                "reason": start.placed[c].reason,
            }
            for i, c in enumerate(columns)
        ],
        "doubts": [
            {"markers": [columns.index(c) for c in doubt.columns], "words": doubt.words}
            for doubt in start.doubts
        ],
        "segments": [{"name": s.name, "markers": list(s.markers)} for s in start.skeleton.segments],
        "figure": "" if start.figure == STANDARD else start.figure,
        "absent": [[rule.label, rule.marker, rule.segment] for rule in start.absent],
        "patterns": list(start.patterns),
    }
    return about, pack(rows)


def _home(points: Array) -> Array:
    """(frames, 3) the middle marker of each frame along each axis, NaN where none is seen."""
    found = np.full((len(points), 3), np.nan)
    there = np.isfinite(points[..., 0]).any(axis=1)
    found[there] = np.nanmedian(points[there], axis=1)
    return found


def _near(points: Array, home: Array, own: Sequence[int]) -> list[int]:
    """Those of the subject's markers by which the camera finds its distance: seen, and not far off."""
    seen = [i for i in own if np.isfinite(points[:, i, 0]).any()]
    if not seen:
        return list(own)
    away = np.nanmedian(np.linalg.norm(points[:, seen] - home[:, None], axis=2), axis=0)
    limit = FAR * float(np.median(away))
    return [i for i, far in zip(seen, away, strict=True) if far <= limit]


def _front(clip: Clip, start: Start) -> Array:
    """(3,) horizontal unit vector: the front of the body in the first frame that shows both of its sides.

    Its right is from the middle of the segments of the left side to that of the right side. Where no side is
    known it is the lab's own axis, as in `view.first_front`.
    """
    up = np.eye(3)[AXES.index(clip.up)]
    sides = [
        clip.points[:, [c for c in start.columns if side(start.placed[c].segment) == name]]
        for name in ("left", "right")
    ]
    right = np.roll(up, 1)
    if all(points.shape[1] for points in sides):
        left_home, right_home = (_home(points) for points in sides)
        across = right_home - left_home
        across -= np.outer(across @ up, up)
        length = np.linalg.norm(across, axis=1)
        known = np.flatnonzero(length > 0)
        if len(known):
            right = across[known[0]] / length[known[0]]
    return np.asarray(np.round(np.cross(up, right), 4))
