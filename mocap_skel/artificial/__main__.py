"""``python -m mocap_skel.artificial OUT.c3d``: make a clip with known truth."""

from __future__ import annotations

import argparse
import re
import shlex
import sys
from pathlib import Path

from mocap_skel.artificial.faults import Faults
from mocap_skel.artificial.figure import STATURE, Figure, Motion, human
from mocap_skel.artificial.markers import LABELS, MarkerSet, marker_set
from mocap_skel.artificial.motion import circumduct, dance, range_of_motion, still, walk
from mocap_skel.artificial.others import figure_of, markers_of, ranges_of
from mocap_skel.artificial.recording import Recording, merge, record
from mocap_skel.artificial.write import UNITS, write_c3d, write_truth
from mocap_skel.errors import MocapSkelError
from mocap_skel.figure.skeleton import STANDARD, read_skeleton

MOTIONS = ("rom", "dance", "walk", "still")
SPACING = 2.0
"""Metres between the subjects of one clip, side by side."""


def length(text: str) -> float:
    """Metres of a length such as `1mm`, `0.5 cm` or, without a unit, metres."""
    match = re.fullmatch(r"\s*([0-9.]+(?:e-?[0-9]+)?)\s*(mm|cm|dm|m)?\s*", text)
    if not match:
        raise argparse.ArgumentTypeError(f"not a length: {text!r} (write 1mm, 0.5cm or 0.001)")
    try:
        return float(match[1]) / UNITS[match[2] or "m"]
    except ValueError:
        raise argparse.ArgumentTypeError(f"not a number: {match[1]!r}") from None


def names(text: str) -> tuple[str, ...]:
    """The parts of a list that is separated by commas."""
    return tuple(part.strip() for part in text.split(",") if part.strip())


def parser() -> argparse.ArgumentParser:
    """The command line."""
    make = argparse.ArgumentParser(
        prog="python -m mocap_skel.artificial",
        description="Make an artificial motion-capture clip and the true paths of its joints: "
        "OUT.c3d and OUT.truth.csv (OUT.Anna.truth.csv, … with --subjects).",
        epilog="Example: python -m mocap_skel.artificial dog.c3d --figure quadruped --sigma 1mm",
    )
    make.add_argument("out", type=Path, metavar="OUT.c3d")
    make.add_argument(
        "--figure", default=STANDARD, metavar="NAME",
        help="any skeleton by name or file: all its markers, motion rom (default: human)",
    )  # fmt: skip
    make.add_argument("--motion", choices=MOTIONS, default="rom", help="(default: rom)")
    make.add_argument("--set", choices=LABELS, default="cmu", help="markers (default: cmu)")
    make.add_argument("--seconds", type=float, default=20.0, help="(default: 20)")
    make.add_argument("--rate", type=float, default=120.0, help="frames a second (default: 120)")
    make.add_argument("--sigma", type=length, default=0.0, help="white noise, e.g. 1mm")
    make.add_argument("--correlated", type=length, default=0.0, help="slow noise, e.g. 1mm")
    make.add_argument("--slide", type=length, default=0.0, help="skin at 90 degrees, e.g. 5mm")
    make.add_argument("--dropout", type=float, default=0.0, help="share missing, e.g. 0.2")
    make.add_argument("--burst", type=float, default=10.0, help="mean frames missing (default: 10)")
    make.add_argument("--outliers", type=float, default=0.0, help="share 0.5 m away, e.g. 0.01")
    make.add_argument(
        "--outlier-burst", type=float, default=1.0, help="mean frames of a stay there"
    )
    make.add_argument("--lost", type=names, default=(), metavar="LABELS", help="e.g. LKNE,RTHI")
    make.add_argument("--subjects", type=names, default=(), metavar="NAMES", help="Anna,Ben")
    make.add_argument("--stature", type=length, default=STATURE, help="(default: 1.75 m)")
    make.add_argument("--first-frame", type=int, default=1, help="(default: 1)")
    make.add_argument("--unit", choices=UNITS, default="mm", help="of the C3D (default: mm)")
    make.add_argument("--seed", type=int, default=0, help="(default: 0)")
    make.add_argument("--overwrite", action="store_true", help="replace existing files")
    return make


def _motion(args: argparse.Namespace, seed: int) -> Motion:
    if args.motion == "still":
        return still(args.seconds, args.rate, seed)
    make = {"rom": range_of_motion, "dance": dance, "walk": walk}[args.motion]
    return make(args.seconds, args.rate, seed, args.stature)


def _other(args: argparse.Namespace, seed: int) -> tuple[Figure, MarkerSet, Motion]:
    """The figure of a skeleton file, every joint through its range."""
    for name, usual in (("motion", "rom"), ("set", "cmu"), ("stature", STATURE)):
        if getattr(args, name) != usual:
            raise ValueError(f"--{name} is for the human only, not for --figure {args.figure}")
    skeleton = read_skeleton(args.figure)
    figure = figure_of(skeleton)
    motion = circumduct(ranges_of(skeleton), args.seconds, args.rate, seed)
    return figure, markers_of(skeleton, figure), motion


def _human(args: argparse.Namespace, seed: int) -> tuple[Figure, MarkerSet, Motion]:
    return human(args.stature), marker_set(args.set, args.stature), _motion(args, seed)


def _clip(args: argparse.Namespace) -> Recording:
    faults = Faults(
        sigma=args.sigma,
        correlated=args.correlated,
        slide=args.slide,
        dropout=args.dropout,
        burst=args.burst,
        lost=args.lost,
        outliers=args.outliers,
        outlier_burst=args.outlier_burst,
    )
    make = _human if args.figure == STANDARD else _other
    clips = [
        record(
            *make(args, args.seed + i),
            faults,
            seed=args.seed + i,
            first_frame=args.first_frame,
            place=(0.0, SPACING * i, 0.0),
        )
        for i in range(max(1, len(args.subjects)))
    ]
    return merge(dict(zip(args.subjects, clips, strict=True))) if args.subjects else clips[0]


def main(argv: list[str] | None = None) -> int:
    """Run the command; the exit code (2 for a wrong call is argparse's own)."""
    make = parser()
    args = make.parse_args(argv)
    if args.out.suffix.lower() != ".c3d":
        make.error(f"{args.out} should end in .c3d")
    stem = args.out.with_suffix("")
    # A subject's name must not lead out of the folder.
    safe = {s: re.sub(r"[^\w-]+", "_", s) for s in args.subjects}
    if len(set(safe.values())) < len(args.subjects):
        make.error("two subjects of one name")
    truths: dict[Path, str | None] = {Path(f"{stem}.{safe[s]}.truth.csv"): s for s in args.subjects}
    truths = truths or {Path(f"{stem}.truth.csv"): None}
    present = [str(path) for path in (args.out, *truths) if path.exists()]
    if present and not args.overwrite:
        make.error(f"{', '.join(present)} exists; --overwrite replaces it")
    try:
        clip = _clip(args)
        write_c3d(clip, args.out, args.unit)
        for path, subject in truths.items():
            write_truth(clip, path, subject)
    except (ValueError, OSError) as problem:
        make.error(str(problem))
    except MocapSkelError as problem:
        make.error(f"{problem.message} ({problem.hint})" if problem.hint else problem.message)
    for action in vars(args):
        print(f"{action} = {getattr(args, action)}")
    print(f"frames = {len(clip.points)}", f"markers = {len(clip.labels)}", sep="\n")
    print("wrote", shlex.join(map(str, (args.out, *truths))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
