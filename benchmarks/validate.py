"""Ours and four published methods against the references in a folder of real clips.

Example: `python benchmarks/validate.py ../shared/clips`, or `make validate CLIPS=...`. Nothing is known of any clip:
see `validation/references.py` for what is looked for.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

ROOT = Path(__file__).parent.parent
CLIPS = Path(os.environ.get("MOCAP_SKEL_CLIPS", ROOT.parent / "shared" / "clips"))


@click.command(epilog="Example: python benchmarks/validate.py ../shared/clips --half -o table.txt")
@click.argument("folder", type=click.Path(path_type=Path), default=CLIPS)
@click.option("--assoc", metavar="MAP", help="One association for all clips; 'guess' guesses it.")
@click.option("--only", metavar="TEXT", help="Clips with this text in their path only.")
@click.option("--half", is_flag=True, help="Also fit each half of the frames: repeatability.")
@click.option("--json", "form", flag_value="json", help="One JSON object in place of tables.")
@click.option("--csv", "form", flag_value="csv", help="One row a number in place of tables.")
@click.option("-o", "output", type=click.Path(path_type=Path), help="To a file.")
@click.option("--overwrite", is_flag=True, help="Replace that file.")
@click.option("-q", "--quiet", is_flag=True, help="Do not name the clips on standard error.")
def main(
    folder: Path,
    assoc: str | None,
    only: str | None,
    half: bool,
    form: str | None,
    output: Path | None,
    overwrite: bool,
    quiet: bool,
) -> None:
    """Error of every joint that a clip of FOLDER has a reference for, method by method.

    FOLDER is ../shared/clips or MOCAP_SKEL_CLIPS without one. References are found by themselves: ASF/AMC
    beside a clip, joint centres and Plug-in Gait bones inside it, midpoints of medial and lateral markers. All
    of these are withheld from the fit, and so are the medial markers.

    Exit codes: 0 all fitted, 1 some clips were not, 2 wrong call, 3 none was.
    """
    from validation.folder import GUESS, clips_in
    from validation.harness import validate
    from validation.tables import as_csv, as_json, text

    from mocap_skel.errors import CallError
    from mocap_skel.export.files import check_free, write_all
    from mocap_skel.labels.association import read_association

    try:
        if output is not None:
            check_free([output], overwrite)
        if assoc not in (None, GUESS):
            read_association(str(assoc))
        if not folder.exists():
            raise CallError(f"{folder}: no such folder", "give one, or set MOCAP_SKEL_CLIPS")
        clips = [path for path in clips_in(folder) if only is None or only in str(path)]
        if not clips:
            raise CallError(f"{folder}: no C3D file in it" + (f" with {only!r}" if only else ""))
        results = validate(
            clips, folder, assoc, half=half, tell=lambda s: quiet or click.echo(s, err=True)
        )
        content = {"json": as_json, "csv": as_csv}.get(form or "", text)(results)
        if output is None:
            click.echo(content, nl=False)
        else:
            write_all({output: content}, overwrite)
    except CallError as error:
        hint = f" ({error.hint})" if error.hint else ""
        click.echo(f"error: {error.message}{hint}", err=True)
        sys.exit(2)
    failed = sum(bool(one.failed) for one in results)
    sys.exit(0 if not failed else 3 if failed == len(results) else 1)


if __name__ == "__main__":
    main()
