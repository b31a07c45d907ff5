"""What the page of an association begins with: the clip's markers, named as every command names them."""

from __future__ import annotations

from dataclasses import replace

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError
from mocap_skel.labels.association import check_subject
from mocap_skel.labels.subjects import with_subjects
from mocap_skel.pipeline.job import Job
from mocap_skel.results.assoc_start import Start, start_from_file, start_from_guess
from mocap_skel.results.upright import upright_by_names


def page_start(clip: Clip, job: Job, figure: str | None = None) -> tuple[Clip, Start]:
    """Name the markers of a clip for its page, and say what is in doubt.

    A guess that is not sure enough for a fit is a start all the same: the page is where it is put right.

    Args:
        clip: as it was read.
        job: how its markers are named.
        figure: the name or the file of the job's figure, as the saved file names it; None = the human.

    Returns:
        The clip with its subjects, upright; and the start.

    Raises:
        CallError: there is no such subject, or the association file is of another marker set.

    >>> from mocap_skel import read_clip
    >>> clip, start = page_start(read_clip("sample_data/nearly_still.c3d"), Job(None))
    >>> start.said, len(start.columns)
    ('41 of 41 labels placed (41 high, 0 likely)', 41)
    """
    try:
        named = job.named(clip)
    except CallError:
        if job.association is not None:
            raise
        clip = with_subjects(clip)
        check_subject(clip, job.subject)
        clip = upright_by_names(clip, job.subject)
        return clip, start_from_guess(clip, figure, job.subject, job.how)
    clip = upright_by_names(named.whole, job.subject)
    if named.guess is not None:
        return clip, start_from_guess(clip, figure, job.subject, job.how, named.guess)
    start = start_from_file(clip, job.association or named.association, job.subject)
    if job.association is None:
        start = replace(start, said=named.notes[-1])
    return clip, start
