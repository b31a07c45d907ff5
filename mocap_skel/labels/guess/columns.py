"""Which columns of a clip are on which segment, by what their labels alone say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from mocap_skel.clip import Clip
from mocap_skel.figure.skeleton import STANDARD, shipped_skeletons
from mocap_skel.labels.guess.names import HIGH, LIKELY, guess_names

Columns = Mapping[str, Mapping[str, int]]
"""Segment → marker → column of the clip."""


def columns_by_names(clip: Clip, subject: str | None = None) -> Iterator[tuple[str, Columns]]:
    """The columns whose labels say clearly which segment of the standard human they are on.

    Args:
        clip: as it was read; its movement is not looked at.
        subject: only this one.

    Yields:
        The name of each subject, and its columns.

    >>> from mocap_skel import read_clip
    >>> (whose, columns), = columns_by_names(read_clip("sample_data/nearly_still.c3d"))
    >>> whose, sorted(columns["Head"])
    ('', ['LBHD', 'LFHD', 'RBHD', 'RFHD'])
    """
    human = shipped_skeletons()[STANDARD]
    for whose in clip.subject_names:
        if subject not in (None, whose):
            continue
        own = [i for i, name in enumerate(clip.subjects) if name == whose]
        named = guess_names([clip.labels[i] for i in own], human.segment_of.items())
        columns: dict[str, dict[str, int]] = {}
        for i in own:
            guess = named[clip.labels[i]]
            if guess.confidence in (HIGH, LIKELY) and guess.segment:
                columns.setdefault(guess.segment, {})[clip.labels[i]] = i
        yield whose, columns
