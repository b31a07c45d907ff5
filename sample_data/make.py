"""Make the bundled clips and their truth again: `make samples` (or `python sample_data/make.py DIR`).

Every clip comes from `mocap_skel.artificial` with a fixed seed; nothing here was recorded.
"""

from __future__ import annotations

import sys
from pathlib import Path

from mocap_skel.artificial import (
    Faults,
    Recording,
    dance,
    human,
    marker_set,
    merge,
    range_of_motion,
    record,
    still,
    write_c3d,
    write_truth,
)
from mocap_skel.artificial.gait import gait

HERE = Path(__file__).parent


def full_range() -> Recording:
    """Every joint moved in all its directions; 1 mm noise."""
    return record(
        human(), marker_set("cmu"), range_of_motion(23, 60, seed=1), Faults(sigma=0.001), seed=1
    )


def two_dancers() -> Recording:
    """Two subjects with skin that slides; the first frame is not number 1."""
    dancers = {}
    for seed, (name, stature) in enumerate({"Anna": 1.66, "Ben": 1.84}.items(), 11):
        dancers[name] = record(
            human(stature),
            marker_set("cmu", stature),
            dance(14, 50, seed=seed, stature=stature),
            Faults(sigma=0.0005, slide=0.004),
            seed=seed,
            first_frame=101,
            place=(0.0, 2.0 * (seed - 11), 0.0),
        )
    return merge(dancers)


def gaps() -> Recording:
    """Plug-in Gait markers, a fifth of the samples missing in bursts, one marker lost altogether."""
    return record(
        human(1.8),
        marker_set("plug_in_gait", 1.8),
        range_of_motion(24, 60, seed=21, stature=1.8),
        Faults(sigma=0.001, dropout=0.2, burst=12, lost=("LTHI",)),
        seed=21,
    )


def nearly_still() -> Recording:
    """Standing: no joint can be known from this."""
    return record(
        human(1.7), marker_set("cmu", 1.7), still(5, 60, seed=31), Faults(sigma=0.0005), seed=31
    )


def lab_static() -> Recording:
    """The person of range_of_motion stands: the neutral pose of lab_walk."""
    return record(human(), marker_set("cmu"), still(1, 60, seed=41), Faults(sigma=0.0005), seed=41)


def lab_walk() -> Recording:
    """The same person walks straight on; skin slides, and the foot contacts are known."""
    walk = gait(5, 60).motion
    return record(human(), marker_set("cmu"), walk, Faults(sigma=0.0005, slide=0.004), seed=42)


CLIPS = {
    "range_of_motion": full_range,
    "two_dancers": two_dancers,
    "gaps": gaps,
    "nearly_still": nearly_still,
    "lab_static": lab_static,
    "lab_walk": lab_walk,
}


def main(folder: Path) -> None:
    """Write every clip with its truth into a folder."""
    for name, make in CLIPS.items():
        recording = make()
        write_c3d(recording, folder / f"{name}.c3d")
        for subject in recording.subjects or (None,):
            middle = f".{subject}" if subject else ""
            write_truth(recording, folder / f"{name}{middle}.truth.csv", subject)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
