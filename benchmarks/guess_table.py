"""How many markers of real clips the guess places as a hand-written association file does.

`python benchmarks/guess_table.py [ASSOCIATIONS [-v]]` prints one line a clip. A marker is right if its segment
is that of the file, and its standard name too where the file gives one; "low" counts the wrong ones
that the guess itself calls unsure, and so leaves out. A second table has the figure by motion alone, with
the labels erased. Needs the recordings in ../shared/clips.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path

from mocap_skel.errors import MocapSkelError
from mocap_skel.figure.skeleton import read_skeleton
from mocap_skel.labels.association import SHIPPED, associate, read_association
from mocap_skel.labels.guess import guess_association
from mocap_skel.labels.guess.figure import find_figure
from mocap_skel.readers import read_clip

ROOT = Path(__file__).parent.parent
CLIPS = Path(os.environ.get("MOCAP_SKEL_CLIPS", ROOT.parent / "shared" / "clips"))
FILES = {
    "cmu/01_01": "cmu",
    "cmu/basketball": "cmu",
    "hdm05/HDM_dg_06-03_03_120": "cmu",
    "two_subjects/kinematics_tennis_serve_2players": "plug_in_gait",
    "functional_hip/FunctionalLHip": "plug_in_gait_clusters",
    "functional_hip/FunctionalWalk": "plug_in_gait_clusters",
    "functional_knee/right_knee": "landmarks_and_triads",
    "plug_in_gait/HC055A01": "oxford_foot_model",
    "plug_in_gait/HC055A34": "oxford_foot_model",
    "odd_files/Eb015pi": "lower_body_plates",
    "odd_files/Eb015si": "lower_body_plates",
    "odd_files/sub_labels": "plug_in_gait_kad",
    "odd_files/duplicate_labels": "wheelchair_upper_body",
    "odd_files/Dance": "phoenix_channels",
    "odd_files/bad_parameter_section": "numbered_points",
}


def score(clip: Path, association: str | Path) -> tuple[Counter[str], list[str]]:
    """Counts of right, wrong, low, open and extra, and the labels that are not right."""
    known = read_association(association, "human")
    standard = set(read_skeleton("human").segment_of)
    read = read_clip(clip)
    labels = set(read.labels)
    rules = {rule.label: rule for rule in known.rules if rule.label in labels}
    counts: Counter[str] = Counter(markers=len(rules))
    try:
        lines = {line.label: line for line in guess_association(read).lines}
    except MocapSkelError:
        counts["open"] = len(rules)
        return counts, []
    remarks = []
    for label, rule in rules.items():
        line = lines[label]
        name = rule.marker if rule.marker in standard else None
        same = line.segment == rule.segment and (name is None or name == line.marker)
        if not line.segment:
            kind = "open"
        elif same:
            kind = "right" if line.used else "open"
        else:
            kind = "wrong" if line.used else "low"
        counts[kind] += 1
        if kind != "right":
            remarks.append(f"{label}: {line.segment} {line.marker} ({line.confidence}) {kind}")
    for label, line in lines.items():
        if line.used and label not in rules:
            dropped = any(fnmatchcase(label, pattern) for pattern in known.ignored)
            counts["of ignored" if dropped else "extra"] += 1
    return counts, remarks


def erased(clip: Path, association: str | Path) -> tuple[int, int, int, int, int]:
    """Segments found whole, segments there are; joints found between true neighbours, joints found,
    joints there are. The labels are erased; a found segment counts as that which most of its markers
    are on, so that one that is found in two halves makes a joint that there is none of.
    """
    known = read_association(association, "human")
    read = read_clip(clip)
    match = associate(read, known)[0]
    place = {c: s for s, columns in match.columns.items() for c in columns.values()}
    columns = list(place)
    bare = replace(
        read,
        points=read.points[:, columns],
        labels=tuple(f"m{c}" for c in columns),
        subjects=("",) * len(columns),
    )
    figure = find_figure(bare)
    truth: dict[str, set[str]] = {}
    for column, segment in place.items():
        # What is never seen is on no segment.
        if figure.left_out.get(f"m{column}") != "hardly ever seen":
            truth.setdefault(segment, set()).add(f"m{column}")
    most = {
        s.name: max(truth, key=lambda name: len(truth[name] & set(s.labels)))
        for s in figure.segments
    }
    pairs = {frozenset((s.name, s.parent)) for s in known.skeleton.segments}
    joints = [s for s in figure.segments if s.parent]
    right = sum(frozenset((most[s.name], most[str(s.parent)])) in pairs for s in joints)
    whole = sum(set(s.labels) in truth.values() for s in figure.segments)
    there = sum(bool(p <= set(truth)) for p in pairs)
    return whole, len(truth), right, len(joints), there


def table_without_names(folder: Path) -> None:
    """The second table: the figure by motion, with the labels erased."""
    print(f"\n{'labels erased, by motion':72}{'segments':>12}{'joints':>24}")
    bundled = {"range_of_motion": "cmu", "two_dancers": "cmu", "gaps": "plug_in_gait"}
    bundled |= {"nearly_still": "cmu"}
    files = {ROOT / "sample_data" / f"{name}.c3d": a for name, a in bundled.items()}
    files |= {CLIPS / f"{name}.c3d": a for name, a in FILES.items()}
    for clip, association in files.items():
        file = folder / f"{association}.txt"
        if not clip.exists() or not file.exists():
            continue
        try:
            whole, there, right, joints, true = erased(clip, file)
        except MocapSkelError as error:
            print(f"{clip.stem:48}{association:24} {error}")
            continue
        print(
            f"{clip.stem:48}{association:24}{whole:6} of {there:2}"
            f"{right:10} of {joints} found ({true} true)"
        )


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else SHIPPED
    kinds = ("markers", "right", "wrong", "low", "open", "extra", "of ignored")
    print(f"{'clip':48}{'file':24}" + "".join(f"{kind:>11}" for kind in kinds))
    total: Counter[str] = Counter()
    for name, association in FILES.items():
        clip, file = CLIPS / f"{name}.c3d", folder / f"{association}.txt"
        if not clip.exists() or not file.exists():
            continue
        counts, remarks = score(clip, file)
        total += counts
        print(f"{name:48}{association:24}" + "".join(f"{counts[kind]:11}" for kind in kinds))
        for remark in remarks if "-v" in sys.argv else ():
            print(f"    {remark}")
    if total:
        share = 100 * total["right"] / total["markers"]
        print(
            f"{'all':72}"
            + "".join(f"{total[kind]:11}" for kind in kinds)
            + f"  {share:.1f} % right"
        )
    table_without_names(folder)


if __name__ == "__main__":
    main()
