"""From the call of `draw` to the picture's file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.errors import CallError, FitError
from mocap_skel.export.files import check_free, safe_name, write_all
from mocap_skel.gait.events import foot_events
from mocap_skel.pipeline.job import Job, fit_file, static_fits, static_of
from mocap_skel.pipeline.limits import limited
from mocap_skel.report.angle_figure import angles_figure
from mocap_skel.report.figures import KINDS, check_figures, picture
from mocap_skel.report.pose_figures import Actor, pose_figure
from mocap_skel.report.time_figures import bones_figure, residuals_figure, tracks_figure
from mocap_skel.results.series import best_frame, marker_tracks
from mocap_skel.text import listed, stem, visible

# What is drawn against time, of one subject.
OVER_TIME: dict[str, Callable[[Actor, str], tuple[Any, str]]] = {
    "tracks": tracks_figure,
    "bones": bones_figure,
    "residuals": residuals_figure,
}


@dataclass(frozen=True)
class Drawing:
    """What to draw.

    Attributes:
        plot: "pose", "angles", or one of `OVER_TIME`.
        frames: the file's own numbers, for a pose; none = the one in which most is seen.
        sheet: so many frames, evenly spaced, in their place; 0 = none.
        view: one of `report.view.VIEWS`, for a pose.
        output: the file, or a folder for it; None = the current one.
        overwrite: whether an existing file may be replaced.
    """

    plot: str = "pose"
    frames: tuple[int, ...] = ()
    sheet: int = 0
    view: str = "oblique"
    output: Path | None = None
    overwrite: bool = False


@dataclass(frozen=True)
class Drawn:
    """A picture that was made: its file, what there is to say, why other subjects are not in it."""

    file: Path
    notes: tuple[str, ...]
    failed: tuple[FitError, ...]


def draw(path: Path, job: Job, wanted: Drawing) -> Drawn:
    """Fit a clip and draw it.

    Raises:
        CallError: no such frame or kind of file, several subjects where one is drawn, the file is there
            already, or matplotlib is not installed.
        MocapSkelError: the clip cannot be read or fitted.
    """
    check_figures()
    target = _target(path, job, wanted)
    check_free([target], wanted.overwrite, job.inputs)
    with limited(path):
        found = fit_file(path, job)
    actors = [Actor(fit, marker_tracks(found.clip, a, fit)) for a, fit in found.subjects]
    called = visible(path.name)
    if wanted.plot == "pose":
        frames = _frames(found.clip, actors, wanted)
        names = listed(actor.fit.subject for actor in actors if actor.fit.subject)
        title = f"{called}: {names}" if names else called
        drawn, caption = pose_figure(actors, frames, wanted.view, title)
    else:
        if len(actors) > 1:
            known = ", ".join(actor.fit.subject for actor in actors)
            raise CallError(
                f"{path}: --plot {wanted.plot} takes one subject", f"choose with --subject: {known}"
            )
        if wanted.plot == "angles":
            static = static_of(static_fits(job), actors[0].fit)
            events = foot_events(actors[0].fit, found.clip)
            drawn, caption = angles_figure(actors[0], called, static, events)
        else:
            drawn, caption = OVER_TIME[wanted.plot](actors[0], called)
    content = picture(drawn, caption, target.suffix[1:].lower())
    write_all({target: content}, wanted.overwrite, job.inputs)
    return Drawn(target, found.notes, found.failed)


def _target(path: Path, job: Job, wanted: Drawing) -> Path:
    """The picture's file."""
    subject = f".{safe_name(job.subject)}" if job.subject else ""
    name = f"{stem(path)}{subject}.{wanted.plot}.png"
    output = wanted.output
    if output is None or output.is_dir():
        return (output or Path()) / name
    if output.suffix[1:].lower() not in KINDS:
        raise CallError(
            f"{output}: its suffix does not tell what kind of picture it is",
            f"one of .{', .'.join(KINDS)}",
        )
    return output


def _frames(clip: Clip, actors: list[Actor], wanted: Drawing) -> list[int]:
    """The frames to draw, counted from 0."""
    first, last = clip.first_frame, clip.first_frame + clip.frames - 1
    for number in wanted.frames:
        if not first <= number <= last:
            raise CallError(f"{clip.name}: no frame {number}: it has frames {first} to {last}")
    if wanted.frames:
        return [number - first for number in dict.fromkeys(wanted.frames)]
    if wanted.sheet:
        # Frames in which nobody has a pose have nothing to show.
        seen = np.any(
            [actor.fit.segments[actor.fit.skeleton.root.name].pose.known for actor in actors],
            axis=0,
        )
        shown = np.flatnonzero(seen)
        spaced = shown[np.linspace(0, len(shown) - 1, wanted.sheet).round().astype(int)]
        return [int(i) for i in dict.fromkeys(spaced.tolist())]
    return [best_frame((actor.fit, actor.markers) for actor in actors)]
