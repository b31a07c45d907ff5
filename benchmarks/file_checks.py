"""What the checks of `fit` say of clips, and what share of a fit's time they take.

    python benchmarks/file_checks.py [--clips FOLDER] [CLIP.c3d ...]

Without clips: the bundled ones. One line a clip and check that spoke, with its words; then a table of the checks: clips in which
each spoke, and its share of the time of all fits, from the profiler. A clip that has `NAME.map.txt` beside it is fitted with
that association file, the others as the guess names their markers. Of sound clips every line is a false alarm.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import re
from collections import Counter
from pathlib import Path

from mocap_skel.errors import MocapSkelError
from mocap_skel.labels.association import read_association
from mocap_skel.pipeline.job import Job, fit_file

BUNDLED = Path(__file__).parent.parent / "sample_data"
# Check → its words in a note or an error, and the functions (module, name) that are all of it.
CHECKS = {
    "exchanged, mirrored, wrong": (
        r"look exchanged|mirrored|moves with|out of order|belongs to",
        [("segments/misplaced.py", "checked_columns")],
    ),
    "samples that are none": (
        r"held|constant|straight line|repeat",
        [("readers/clean.py", "_leave_out_repeated")],
    ),
    "spikes": (r"for one frame|spike", [("segments/spikes.py", "spikes")]),
    "size and unit": (
        r"taller|shorter|--unit",
        [("results/body_size.py", "check_size"), ("results/body_size.py", "check_size_by_names")],
    ),
    "what points up": (r"points? up", [("results/upright.py", "upright")]),
    "lost bytes": (r"damaged: bytes", [("readers/formats/c3d/shifts.py", "shifted_at")]),
    "subjects and doubles": (
        r"told apart|are subjects|subject by",
        [("labels/subjects.py", "with_subjects"), ("labels/doubles.py", "with_right_doubles")],
    ),
}


def said_of(clip: Path) -> list[str]:
    """All sentences of a fit, or why there is none."""
    beside = clip.with_name(f"{clip.stem}.map.txt")
    association = read_association(str(beside)) if beside.exists() else None
    try:
        return list(fit_file(clip, Job(association)).notes)
    except MocapSkelError as error:
        return [f"NOT FITTED: {error}"]


def seconds(profile: cProfile.Profile) -> tuple[dict[str, float], float]:
    """Check → seconds, and of all."""
    stats = pstats.Stats(profile)
    spent = dict.fromkeys(CHECKS, 0.0)
    for (path, _, name), (*_, cumulated, _) in stats.stats.items():  # type: ignore[attr-defined]
        for check, (_, functions) in CHECKS.items():
            if any(path.endswith(module) and name == own for module, own in functions):
                spent[check] += cumulated
    return spent, stats.total_tt  # type: ignore[attr-defined]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", nargs="*", type=Path)
    parser.add_argument("--clips", dest="folder", type=Path, help="all C3D files below it")
    told = parser.parse_args()
    clips = [*told.clips, *(sorted(told.folder.rglob("*.c3d")) if told.folder else [])]
    clips = clips or sorted(BUNDLED.glob("*.c3d"))
    said_of(clips[0])  # what is imported is not the checks' time
    spoke: Counter[str] = Counter()
    profile = cProfile.Profile()
    for clip in clips:
        profile.enable()
        sentences = said_of(clip)
        profile.disable()
        for check, (words, _) in CHECKS.items():
            found = [s for s in sentences if re.search(words, s)]
            spoke[check] += bool(found)
            for sentence in found:
                print(f"{clip.name}  {check}: {sentence}")
        for sentence in sentences:
            if sentence.startswith("NOT FITTED"):
                print(f"{clip.name}  {sentence}")
    spent, total = seconds(profile)
    print(f"\n{len(clips)} clips\ncheck  clips in which it spoke  share of the time")
    for check in CHECKS:
        print(f"{check}  {spoke[check]}  {100 * spent[check] / total:.1f} %")
    print(f"all  {100 * sum(spent.values()) / total:.1f} %")


if __name__ == "__main__":
    main()
