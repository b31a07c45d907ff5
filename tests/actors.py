"""A generated clip of a range of motion, fitted and with its markers: what series, views and pictures are tried on.

Lengths between two joints of a generated figure vary by noise only. A frame fitted to n markers with noise σ puts
a joint that is no farther from them than they are from each other wrong by about σ; a bone has two ends and three
directions, of which its length sees one: within 2 σ.
"""

from functools import cache

from recordings import clip_of, known

from mocap_skel import associate, fit_skeleton
from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
from mocap_skel.report.pose_figures import Actor
from mocap_skel.results.series import marker_tracks

SIGMA = 0.001


def actor_of(clip, association="cmu", **options):
    found = known(association)
    assignment = associate(clip, found)[0]
    fit = fit_skeleton(clip, assignment, found.skeleton, **options)
    return Actor(fit, marker_tracks(clip, assignment, fit))


def film(**faults):
    motion = range_of_motion(20, 30, seed=1)
    return record(human(), marker_set("cmu"), motion, Faults(sigma=SIGMA, **faults), seed=1)


@cache
def recording():
    return film(dropout=0.05)


@cache
def actor():
    # A landmark's prior moves a joint off the sphere's centre, by up to the skin errors it is weighed with;
    # the laws here are those of the movement alone.
    return actor_of(clip_of(recording()), prior="none")
