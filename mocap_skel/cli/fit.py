"""mocap-skel fit: clips in, skeletons and joint statistics out."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

import click

from mocap_skel.cli import each, options
from mocap_skel.cli.jobs import Told, job_of
from mocap_skel.errors import CallError

FORMATS = ("csv", "bvh", "c3d", "trc", "parquet")


@click.command(
    "fit",
    epilog="Example: mocap-skel fit walk.c3d --assoc cmu --format csv --format bvh -o out",
)
@options.clips
@options.which
@click.option(
    "--format", "-f", "formats", multiple=True, type=click.Choice(FORMATS), default=("csv",),
    show_default=True, help="Result format; repeat it for several.",
)  # fmt: skip
@options.output
@options.overwrite
@options.estimation
@click.option(
    "--up", type=click.Choice(["x", "y", "z"]), show_default="as in the clip; y for bvh and trc",
    help="Turn the results so that this axis points up.",
)  # fmt: skip
@click.option("--trim", is_flag=True, help="bvh: leave out incomplete frames at both ends.")
@click.option(
    "--axes", is_flag=True, help="c3d: also each segment's origin and the tips of its axes."
)
@click.option("--markers", is_flag=True, help="trc: also the subject's markers.")
@options.rig
@options.reading
@options.wide
@options.as_json
@options.quiet
def command(
    clips: tuple[Path, ...],
    formats: tuple[str, ...],
    output: str,
    overwrite: bool,
    up: str | None,
    trim: bool,
    axes: bool,
    markers: bool,
    rotation_order: str,
    scale: float,
    names: str,
    floor: bool,
    root_at_origin: bool,
    wide: bool,
    as_json: bool,
    quiet: bool,
    **told: Unpack[Told],
) -> int:
    """Fit a skeleton to each CLIP and write it.

    For walk.c3d, csv makes walk.skeleton.csv (the joints in every frame) and walk.joints.csv (each
    joint with its evidence), parquet the same two in long form; bvh makes walk.bvh; trc makes
    walk.skeleton.trc for OpenSim; c3d makes walk.skeleton.c3d, a copy of the clip with the skeleton's
    points behind its own. The joint table goes to standard output. Column 'shown' tells whether
    the movement shows the joint: yes, weak or no; --wide adds columns.

    Without --assoc, which label is which marker is guessed from names and motion, and said; where that
    is not sure, nothing is fitted: mocap-skel assoc guess writes the file to correct.

    Exit codes: 0 all done, 1 some clips failed, 2 wrong call or association file, 3 nothing could
    be fitted, 130 interrupted.
    """
    to_stdout = output == "-"
    if to_stdout and (len(clips) > 1 or len(set(formats)) > 1 or as_json):
        raise CallError(
            "-o - sends one clip in one format and nothing else", "give a folder for more"
        )
    each.check_names(clips)
    from mocap_skel.export import Options
    from mocap_skel.extras import extra

    if "parquet" in formats:
        # Better missed before the work than after it.
        extra("pyarrow.parquet", "parquet")
    job = job_of(
        told,
        formats=tuple(dict.fromkeys(formats)),
        folder=None if to_stdout else Path(output),
        overwrite=overwrite,
        inputs=frozenset(clip.resolve() for clip in clips),
        options=Options(
            up=up,
            trim=trim,
            rotation_order=rotation_order,
            scale=scale,
            names=names,
            floor=floor,
            root_at_origin=root_at_origin,
            axes=axes,
            markers=markers,
        ),
    )
    return each.run(clips, job, as_json=as_json, quiet=quiet, wide=wide)
