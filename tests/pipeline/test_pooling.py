"""A functional trial and a walk of one actor: what the walk's skin does may not spoil what the trial shows."""

from dataclasses import replace

import numpy as np
import pytest
from recordings import clip_of, known

from mocap_skel import associate
from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record, walk
from mocap_skel.joints.calibration import Calibration, digest_of
from mocap_skel.joints.pooling import by_skin
from mocap_skel.pipeline.calibrate import evidence_of
from mocap_skel.pipeline.job import Job

JOINTS = ("Hip", "Knee", "Shoulder")
# Metres by which a joint may come out worse: of the trial's own standard error, 2 to 4 mm, less than half.
WORSE = 0.0015


def errors(fit, recording):
    return [
        float(np.nanmedian(np.linalg.norm(j.track - recording.truth[j.joint], axis=1)))
        for kind in JOINTS
        for j in fit.joints
        if j.joint.endswith(kind)
    ]


@pytest.fixture(scope="module")
def fits():
    """Trial, walk on three centimetres of skin, and the trial with both clips' evidence."""
    found = []
    for seed in range(2):
        takes = {
            "trial": record(
                human(), marker_set("cmu"), range_of_motion(10, 60, seed=seed),
                Faults(sigma=0.001, slide=0.003), seed=seed,
            ),
            "walk": record(
                human(), marker_set("cmu"), walk(20, 60, seed=seed),
                Faults(sigma=0.001, tissue=(0.01, 0.03), wobble=0.005), seed=100 + seed,
            ),
        }  # fmt: skip
        job, evidence = Job(known("cmu")), []
        for name, recording in takes.items():
            clip = replace(clip_of(recording), name=name)
            assignment = associate(clip, job.known)[0]
            fit = job.fit(clip, assignment)
            evidence.append(evidence_of(fit, digest_of(clip, assignment.subject)))
            if name == "trial":
                trial, alone, ours = clip, fit, assignment
        together = Calibration("human", tuple(evidence))
        pooled = replace(job, calibration=together).fit(trial, ours)
        found.append((takes["trial"], alone, pooled, evidence))
    return found


def test_a_walk_beside_a_functional_trial_does_no_harm(fits):
    alone, pooled = (np.array([errors(one[which], one[0]) for one in fits]) for which in (1, 2))
    # The walk alone, with as many frames as it has, took the hips 14 mm off.
    assert np.median(pooled) < np.median(alone) + WORSE
    assert pooled.max() < alone.max() + 3 * WORSE


def test_the_walks_samples_count_less(fits):
    *_, (trial, walked) = fits[0]
    for joint, looseness in (("LeftHip", 1.0), ("RightHip", 1.0), ("LeftShoulder", 3.0)):
        clips = [one.joints[joint].evidence for one in (trial, walked)]
        first, second = by_skin(clips, looseness)
        assert first == 1.0 and second < 0.5
        assert by_skin(clips[::-1], looseness) == [second, first]
        # A clip beside itself counts as much as it.
        assert by_skin([clips[0]] * 2, looseness) == [1.0, 1.0] == by_skin([clips[1]] * 2, 1.0)
