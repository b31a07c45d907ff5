"""mocap-skel draw: a fitted clip as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

import click

from mocap_skel.cli import FAILED, complain, options, say, warn
from mocap_skel.cli.jobs import Told, job_of
from mocap_skel.errors import CallError


@click.command(
    "draw", epilog="Example: mocap-skel draw walk.c3d --assoc cmu --frame 120 -o pose.png"
)
@options.clip
@options.which
@click.option(
    "--plot", type=click.Choice(["pose", "tracks", "angles", "bones", "residuals"]), default="pose",
    show_default=True, help="pose: the skeleton in one frame or several. Against time: where joints "
    "are (tracks), joint angles (angles), bone lengths (bones), how well markers keep their distance to joints (residuals).",
)  # fmt: skip
@click.option(
    "--frame", "frames", type=int, multiple=True, metavar="N",
    show_default="the middlemost in which most is seen",
    help="Frame to draw, by the file's own number; repeat it for a sheet of several.",
)  # fmt: skip
@click.option(
    "--sheet", type=click.IntRange(1, 60), metavar="N", help="A sheet of N frames, evenly spaced."
)
@click.option(
    "--view", type=click.Choice(["oblique", "front", "side", "top"]), show_default="oblique",
    help="Of a pose, from where: front and side (the right one) by the figure's own left and right.",
)  # fmt: skip
@click.option(
    "-o", "--output", metavar="FILE", type=click.Path(path_type=Path),
    show_default="CLIP.PLOT.png in the current folder",
    help="The picture; its suffix tells the kind: .png, .svg or .pdf.",
)  # fmt: skip
@options.overwrite
@options.estimation
@options.static
@options.reading
@options.quiet
def command(
    clip: Path,
    plot: str,
    frames: tuple[int, ...],
    sheet: int | None,
    view: str | None,
    output: Path | None,
    overwrite: bool,
    quiet: bool,
    **told: Unpack[Told],
) -> int:
    """Fit CLIP and draw it.

    A pose shows the bones from joint to joint, the markers, the floor, and each joint in the colour of
    its verdict (shown: yes, weak, no) with the ellipsoid of two standard errors around it. All subjects
    of a clip stand in one picture; the plots against time take one subject.

    Needs the extra 'plot': pip install 'mocap-skel[plot]'. Without --assoc the markers are guessed, as by fit.
    """
    if frames and sheet:
        raise CallError("--frame and --sheet do not go together", "--sheet chooses the frames")
    if told.get("static") and plot != "angles":
        raise CallError(f"--static is for --plot angles, not for {plot}")
    for name, given in (("--frame", frames), ("--sheet", sheet), ("--view", view)):
        if given and plot != "pose":
            raise CallError(f"{name} is for --plot pose, not for {plot}")
    from mocap_skel.extras import extra

    # Better said before anything is loaded or read.
    extra("matplotlib.figure", "plot")
    from mocap_skel.pipeline.drawing import Drawing, draw
    from mocap_skel.pipeline.telling import wrote

    wanted = Drawing(plot, frames, sheet or 0, view or "oblique", output, overwrite)
    done = draw(clip, job_of(told, [clip]), wanted)
    for failure in done.failed:
        complain(failure)
    for note in [] if quiet else done.notes:
        warn(f"{clip}: {note}")
    say(wrote([done.file]))
    return FAILED if done.failed else 0
