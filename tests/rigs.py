"""A fit's rig as the formats get it, without their options: no filter, bones as fitted."""

from mocap_skel.export.animated import Animated, rigs_of
from mocap_skel.rig.animation import Choice, animate
from mocap_skel.rig.motion import Limits
from mocap_skel.rig.rigging import rig_of as rig_of_animation


def rig_of(fit, *, floor=False, **options):
    """The rig of the longest stretch, its segments and all notes; the rig's vertical is the fit's.

    Args:
        options: of `Animated`, beside what is said above.
    """
    told = Animated(**{"smooth": 0.0, "asymmetric": True, "floor": floor, **options})
    _, notes = rigs_of(fit, told, fit.up)
    animation = animate(fit, told.choice)
    rig, segments, _ = rig_of_animation(
        animation, animation.motion.stretches[0], up=fit.up, floor=floor
    )
    return rig, segments, notes


def motion_of(fit, **limits):
    """The rigid motion of a fit, no filter, bones as fitted."""
    return animate(fit, Choice(Limits(**limits), smooth=0.0, even=False)).motion
