"""A generated clip whose labels the tests of guesses change."""

from dataclasses import replace

import numpy as np
from recordings import SAMPLES, clip_of

from mocap_skel import artificial as art
from mocap_skel import read_clip

SIGMA = 0.001
HUMAN = art.human()
CMU = art.marker_set("cmu")
RECORDING = art.record(
    HUMAN, CMU, art.range_of_motion(12, 50, seed=3), art.Faults(sigma=SIGMA), seed=3
)
CLIP = clip_of(RECORDING)


def renamed(clip, names):
    """A clip with other names for some labels."""
    return replace(clip, labels=tuple(names.get(label, label) for label in clip.labels))


def unseen(clip, labels):
    """A clip without the samples of some labels."""
    points = clip.points.copy()
    points[:, [label in labels for label in clip.labels]] = np.nan
    return replace(clip, points=points)


def more(clip, tracks):
    """A clip with more markers: label → track (frames, 3)."""
    points = np.concatenate([clip.points, np.stack(list(tracks.values()), axis=1)], axis=1)
    subjects = (*clip.subjects, *("" for _ in tracks))
    return replace(clip, points=points, labels=(*clip.labels, *tracks), subjects=subjects)


def on(segment, place, rng=None):
    """The track of a place fixed in a segment of the clip; with noise from a generator."""
    track = RECORDING.poses[segment].place(np.array(place))
    return track if rng is None else track + SIGMA * rng.standard_normal(track.shape)


def one_of_two():
    """Anna's clip without her name, and Ben's points in the same order."""
    clip = read_clip(SAMPLES / "two_dancers.c3d")
    column = dict(zip(zip(clip.subjects, clip.labels, strict=True), range(82), strict=True))
    labels = [label for whose, label in column if whose == "Anna"]
    anna, ben = ([column[whose, label] for label in labels] for whose in ("Anna", "Ben"))
    alone = replace(clip, points=clip.points[:, anna], labels=tuple(labels), subjects=("",) * 41)
    return alone, clip.points[:, ben]


def segments(guess):
    """Label → segment of the lines that are used."""
    return {line.label: line.segment for line in guess.used}
