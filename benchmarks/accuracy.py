"""Accuracy on generated clips with known truth: `python benchmarks/accuracy.py [SEEDS]`.

For each fault, over several seeds: the error of the joint constants (the median over frames of the
error in the parent's fitted frame) and the RMS of the lab tracks, which holds the noise of the
parent's frame in every single frame as well. Millimetres.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from mocap_skel import associate, fit_skeleton, read_association, read_clip
from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record, write_c3d

FAULTS = {
    "1 mm noise": Faults(sigma=0.001),
    "1 mm noise, 20 % drop-outs": Faults(sigma=0.001, dropout=0.2),
    "1 mm noise, 5 mm skin slide": Faults(sigma=0.001, slide=0.005),
}
# Noise of cameras that see depth worse: metres along x, y, z.
SKEWED = np.array([0.001, 0.001, 0.003])
HINGES = ("RightElbow", "LeftElbow", "RightKnee", "LeftKnee")


def errors(
    faults: Faults, seed: int, spread: np.ndarray | float = 0.0, **options: object
) -> tuple[dict[str, float], dict[str, float]]:
    """Error of each joint's constant and of its track, mm, on 1,400 frames at 60 Hz.

    Args:
        faults: of the recording.
        seed: of all that is drawn.
        spread: more noise, a standard deviation for all axes or for each, metres.
        options: of `fit_skeleton`.
    """
    motion = range_of_motion(1400 / 60, 60, seed=seed)
    recording = record(human(), marker_set("cmu"), motion, faults, seed=seed)
    noise = np.random.default_rng(seed).normal(size=recording.points.shape)
    recording = replace(recording, points=recording.points + spread * noise)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.c3d"
        write_c3d(recording, path)
        clip = read_clip(path)
    known = read_association("cmu")
    fit = fit_skeleton(clip, associate(clip, known)[0], known.skeleton, **options)
    constants, tracks = {}, {}
    for joint in fit.joints:
        away = joint.track - recording.truth[joint.joint]
        frame = fit.segments[joint.parent].pose.rotation
        inside = np.einsum("fji,fj->fi", frame, away)
        constants[joint.joint] = 1e3 * float(np.linalg.norm(np.nanmedian(inside, axis=0)))
        tracks[joint.joint] = 1e3 * float(np.sqrt(np.nanmean((away**2).sum(axis=1))))
    return constants, tracks


def main() -> None:
    seeds = range(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
    print(
        f"range of motion, CMU markers, 1,400 frames at 60 Hz, seeds {seeds.start}..{seeds.stop - 1}"
    )
    for name, faults in FAULTS.items():
        runs = [errors(faults, seed) for seed in seeds]
        constants = np.array([list(c.values()) for c, _ in runs])
        tracks = np.array([list(t.values()) for _, t in runs])
        worst = list(runs[0][0])[int(constants.max(axis=0).argmax())]
        print(
            f"{name:30s} constants: median {np.median(constants):.2f}, "
            f"worst joint of a clip {np.median(constants.max(axis=1)):.2f} (at most {constants.max():.2f}, "
            f"{worst}); tracks RMS: median {np.median(tracks):.2f}, at most {tracks.max():.2f}"
        )
    print("1 mm of noise along x and y, 3 mm along z; what the fit takes away:")
    for name, options in {
        "one level (the default)": {},
        "--noise matrix": {"noise": "matrix"},
        "--noise marker": {"noise": "marker"},
        "--sigma 1mm,1mm,3mm": {"sigma": np.diag(SKEWED**2)},
    }.items():
        runs = [errors(Faults(), seed, SKEWED, **options)[0] for seed in seeds]
        every = np.array([list(run.values()) for run in runs])
        hinges = np.array([[run[joint] for joint in HINGES] for run in runs])
        print(
            f"  {name:28s} constants: median {np.median(every):.2f}, at most {every.max():.2f}; "
            f"elbows and knees: median {np.median(hinges):.2f}"
        )


if __name__ == "__main__":
    main()
