"""mocap-skel fit: clips in, skeletons and joint statistics out."""

from __future__ import annotations

from pathlib import Path

import click

from mocap_skel.cli import each, options
from mocap_skel.errors import CallError

FORMATS = ("csv", "bvh")


@click.command(
    "fit",
    epilog="Example: mocap-skel fit walk.c3d --assoc cmu --format csv --format bvh -o out",
)
@options.clips
@options.association
@options.skeleton
@options.subject
@click.option(
    "--format", "-f", "formats", multiple=True, type=click.Choice(FORMATS), default=("csv",),
    show_default=True, help="Result format; repeat it for several.",
)  # fmt: skip
@options.output
@options.overwrite
@options.sigma
@options.pose
@options.method
@options.noise
@click.option(
    "--up", type=click.Choice(["x", "y", "z"]), help="Turn the results so that this axis points up."
    "  [default: as in the clip; y for bvh]",
)  # fmt: skip
@click.option("--trim", is_flag=True, help="bvh: leave out incomplete frames at both ends.")
@options.unit
@options.rate
@options.salvage
@options.as_json
@options.quiet
def command(
    clips: tuple[Path, ...],
    association: str | None,
    skeleton: str | None,
    subject: str | None,
    formats: tuple[str, ...],
    output: str,
    overwrite: bool,
    sigma: float | tuple[float, ...] | None,
    pose: str,
    method: str,
    noise: str,
    up: str | None,
    trim: bool,
    unit: str | None,
    rate: float | None,
    salvage: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Fit a skeleton to each CLIP and write it.

    For walk.c3d, csv makes walk.skeleton.csv (the joints in every frame) and walk.joints.csv (each
    joint with its evidence), bvh makes walk.bvh. The joint table goes to standard output. Column
    'known' tells whether the motion shows the joint: yes, weak or no.

    Without --assoc, which label is which marker is guessed from names and motion, and said; where that
    is not sure, nothing is fitted: mocap-skel assoc guess writes the file to correct.

    Exit codes: 0 all done, 1 some clips failed, 2 wrong call or association file, 3 nothing could
    be fitted, 130 interrupted.
    """
    if association is None and skeleton is not None:
        # Names are guessed for the standard human.
        raise options.missing_association()
    to_stdout = output == "-"
    if to_stdout and (len(clips) > 1 or len(set(formats)) > 1 or as_json):
        raise CallError(
            "-o - sends one clip in one format and nothing else", "give a folder for more"
        )
    each.check_names(clips)
    from mocap_skel.association import read_association
    from mocap_skel.batch import Job
    from mocap_skel.export import Options

    options.check_estimation(method, noise, sigma)
    job = Job(
        association=None if association is None else read_association(association, skeleton),
        formats=tuple(dict.fromkeys(formats)),
        folder=None if to_stdout else Path(output),
        overwrite=overwrite,
        subject=subject,
        sigma=sigma,
        pose=pose,
        method=method,
        noise=noise,
        unit=unit,
        rate=rate,
        salvage=salvage,
        options=Options(up, trim),
    )
    return each.run(clips, job, as_json=as_json, quiet=quiet)
