"""The one registry of options that commands share, and the types of their values."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem

from mocap_skel.errors import CallError

F = TypeVar("F", bound=Callable[..., Any])

_LENGTH = re.compile(r"\s*([0-9.]+(?:e[+-]?\d+)?)\s*(mm|cm|dm|m)?\s*", re.IGNORECASE)
_METRES = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0}


# Metres: the lengths that people give here are those of noise.
LONGEST = 0.1


class Length(click.ParamType):  # type: ignore[type-arg]  # generic from click 8.2 on only
    """A length with its unit, as metres."""

    name = "length"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        found = _LENGTH.fullmatch(str(value))
        try:
            metres = float(found[1]) * _METRES[(found[2] or "").lower()] if found else -1.0
        except (KeyError, ValueError):
            metres = -1.0
        if not 0 <= metres < LONGEST:
            self.fail(
                f"{value!r} is no length here; give it with its unit, like 1mm or 0.1cm", param, ctx
            )
        return metres


class Lengths(Length):
    """A length with its unit, or three of them for the axes x, y, z; in metres."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        metres = tuple(super(Lengths, self).convert(v, param, ctx) for v in str(value).split(","))
        if len(metres) not in (1, 3):
            self.fail(f"{value!r}: one length, or three for x, y and z: 1mm,1mm,3mm", param, ctx)
        return metres if len(metres) == 3 else metres[0]


class Capitals(click.Choice):  # type: ignore[type-arg]  # as Length
    """A choice of words in capitals, which may also be typed in small letters."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return super().convert(str(value).upper(), param, ctx)


class Folder(click.Path):
    """A folder. A dash (standard output) is refused: there are several result files."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if str(value) == "-":
            self.fail("there are several result files: give a folder, not -", param, ctx)
        return super().convert(value, param, ctx)


class Named(click.ParamType):  # type: ignore[type-arg]  # as Length
    """A file, or the bare name of a shipped one; the shell completes both."""

    # click hands over its context, needed or not.
    # ruff: noqa: ARG002

    name = "text"

    def __init__(self, folders: tuple[str, ...], suffix: str) -> None:
        self._folders, self._suffix = folders, suffix

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        # Nothing of the library is loaded: this is called at every press of the key.
        package = Path(__file__).parents[1]
        names = {p.stem for f in self._folders for p in (package / f).glob(f"*{self._suffix}")}
        found = [CompletionItem(name) for name in sorted(names) if name.startswith(incomplete)]
        return [*found, CompletionItem(incomplete, type="file")]


def _checked_rate(value: float | None) -> float | None:
    """Refuse, before any work, a rate that the reader would refuse clip by clip."""
    if value is not None and not 0.01 <= value <= 1e5:
        raise CallError(f"a frame rate is a number from 0.01 to 100000, not {value:g}")
    return value


def missing_association() -> CallError:
    """What to say where there is no association file."""
    return CallError(
        "which label is which marker? --assoc is missing",
        "mocap-skel assoc list shows the shipped ones; mocap-skel assoc guess CLIP writes one",
    )


def check_estimation(method: str, noise: str, sigma: object) -> None:
    """Refuse options that do not go together.

    Raises:
        CallError: --method, --noise and --sigma contradict each other.
    """
    from mocap_skel.extras import extra
    from mocap_skel.joints.choices import check_method

    if method == "mle":
        extra("scipy.optimize", "mle")
    try:
        check_method(method, noise, sigma)
    except ValueError as error:
        raise CallError(str(error)) from error


clips = click.argument(
    "clips", nargs=-1, required=True, metavar="CLIP...", type=click.Path(path_type=Path)
)
clip = click.argument("clip", metavar="CLIP", type=click.Path(path_type=Path))
association = click.option(
    "--assoc", "-a", "association", metavar="MAP",
    type=Named(("association_files", "../association_files"), ".txt"),
    help="Association file: which label is which marker. A path, or a shipped one by name: cmu, "
    "plug_in_gait ... (mocap-skel assoc list).",
)  # fmt: skip
skeleton = click.option(
    "--skeleton", metavar="NAME", type=Named(("figure/skeletons",), ".toml"),
    help="Skeleton by name or file, in place of the association file's; it may be a part of it.",
)  # fmt: skip
subject = click.option(
    "--subject", metavar="NAME", help="Only this subject of a clip that holds several."
)
sigma = click.option(
    "--sigma", type=Lengths(), metavar="LENGTH[,Y,Z]", show_default="estimated",
    help="Noise standard deviation of a marker, with its unit: 1mm; or along the clip's x, y, z.",
)  # fmt: skip
pose = click.option(
    "--pose", type=click.Choice(["least-squares", "triad"]), default="least-squares",
    show_default=True, help="Segment poses from all visible markers, or from three.",
)  # fmt: skip
method = click.option(
    "--method", default="best", show_default=True,
    type=click.Choice(["best", "gdke", "ugdk", "mgdk", "sgdk", "igdk", "lls", "mle", "pratt"]),
    help="Sphere fit. best: MGDK, and SGDK where a direction is not shown; the others are there to "
    "compare (mocap-skel methods).",
)  # fmt: skip
noise = click.option(
    "--noise", type=click.Choice(["rigid", "matrix", "marker"]), default="rigid", show_default=True,
    help="How the noise is estimated: one level from the segments' rigidity, a whole matrix from "
    "the same, or a level for each marker from its own residuals.",
)  # fmt: skip
prior = click.option(
    "--prior", type=click.Choice(["skeleton", "none"]), default="skeleton", show_default=True,
    help="What the movement does not show is taken from anatomy, as the skeleton file has it; none: from "
    "the movement alone, the thesis's pure fit.",
)  # fmt: skip
calibration = click.option(
    "--calibration", metavar="FILE", type=click.Path(path_type=Path),
    help="What other clips of the actor know of the joints, from mocap-skel calibrate; the clip's own "
    "movement adds to it. Without --assoc, the markers are named as they were there.",
)  # fmt: skip
measure = click.option(
    "--measure", "measure", multiple=True, metavar="NAME=LENGTH",
    help="A measure of the person, for the joints that anatomy places: knee_width=10.2cm; repeat it. Also left_ and "
    "right_; ankle_width, elbow_width, wrist_width, leg_length, inter_asis, marker_diameter, height.",
)  # fmt: skip
measures = click.option(
    "--measures", "measures", metavar="FILE", type=click.Path(path_type=Path),
    help='A file of such measures, TOML: knee_width = "10.2cm". --measure counts before it, and both before the '
    "clip's own.",
)  # fmt: skip
figures = click.option("--figures/--no-figures", default=True, show_default=True, help="Draw them.")
seed = click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Of all that is drawn."
)
output = click.option(
    "-o", "--output", default=".", metavar="DIR", show_default="current folder",
    help="Folder for the results; - sends one clip's first format to standard output.",
)  # fmt: skip
output_page = click.option(
    "-o", "--output", default=".", metavar="DIR", show_default="current folder",
    help="Folder for the pages; - sends one clip's page to standard output.",
)  # fmt: skip
folder = click.option(
    "-o", "--output", "folder", default=".", metavar="DIR", show_default="current folder",
    type=Folder(path_type=Path), help="Folder for the results.",
)  # fmt: skip
overwrite = click.option("--overwrite", is_flag=True, help="Replace result files that exist.")
wide = click.option(
    "--wide",
    is_flag=True,
    help="All columns of the tables, and all segments of the rigid figure, in lines of any length.",
)
as_json = click.option("--json", "as_json", is_flag=True, help="Print JSON lines, not a table.")
unit = click.option(
    "--unit", metavar="UNIT", help="Length unit of the clip (mm, cm, m), whatever the file says."
)
rate = click.option(
    "--rate", type=float, metavar="HZ", help="Frames a second, whatever the file says.",
    callback=lambda _ctx, _param, value: _checked_rate(value),
)  # fmt: skip
salvage = click.option(
    "--salvage",
    is_flag=True,
    help="Read the frames that are left of a clip whose file is cut off or damaged.",
)
mirror = click.option(
    "--mirror", type=click.Choice(["x", "y", "z"]),
    help="Negate this axis of the clip: for exports with a negated axis, whose bodies are mirrored.",
)  # fmt: skip
clip_up = click.option(
    "--clip-up", type=click.Choice(["x", "y", "z", "-x", "-y", "-z"]),
    help="What points up in the clip, whatever the file and the body in it say.",
)  # fmt: skip
trust = click.option(
    "--trust-labels", "trust", is_flag=True,
    help="Fit the markers as they are named, though some look exchanged or the body mirrored.",
)  # fmt: skip
static = click.option(
    "--static", metavar="CLIP.c3d", type=click.Path(path_type=Path),
    help="A clip of the same markers in which the actor stands still: its mean pose is neutral, so joint angles are 0 "
    "there; and markers that only it has give anatomical axes.",
)  # fmt: skip
strict = click.option(
    "--strict", is_flag=True,
    help="Without --assoc: stop where the movement contradicts even a few names, in place of leaving these "
    "markers out.",
)  # fmt: skip
quiet = click.option("-q", "--quiet", is_flag=True, help="No notes on standard error.")


def _together(*several: Callable[[F], F]) -> Callable[[F], F]:
    """One decorator of several options; the help shows them in this order."""

    def decorate(command: F) -> F:
        for option in reversed(several):
            command = option(command)
        return command

    return decorate


which = _together(association, skeleton, subject)
pure_estimation = _together(sigma, pose, method, noise)
person = _together(measure, measures)
estimation = _together(pure_estimation, prior, person, calibration, trust)
reading = _together(unit, rate, salvage, mirror, clip_up)
findings = _together(figures, folder, overwrite, as_json, quiet)
