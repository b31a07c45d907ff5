"""The figure that the page plays: the rigid one, or the free poses where there is none."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mocap_skel.export.animated import absences
from mocap_skel.rig.animation import Animation, animate, animation_notes
from mocap_skel.rig.model import joint_of
from mocap_skel.rig.quality import Quality, quality_of
from mocap_skel.rig.rigid_fit import rigid_fit
from mocap_skel.skeleton_fit import SkeletonFit


@dataclass(frozen=True, eq=False)
class Moving:
    """A figure to play.

    Attributes:
        fit: its tracks and poses.
        animation: what they are of; None for the free poses of the fit.
        notes: how it was made, one sentence each; why it is not the rigid figure, where it is not.
    """

    fit: SkeletonFit
    animation: Animation | None
    notes: tuple[str, ...]

    @property
    def quality(self) -> Quality | None:
        """How good the rigid figure is; None where there is none."""
        return None if self.animation is None else quality_of(self.animation)

    @property
    def floor(self) -> float | None:
        """Metres along the vertical; None where no sole stands on one."""
        found = self.animation.feet if self.animation is not None else None
        return found.floor if found is not None and found.soles else None


def moving(fit: SkeletonFit) -> Moving:
    """The rigid figure of a fit as BVH and GLB have it by default: gaps bridged, calm, both sides alike.

    A fit of which no two frames in a row show a whole figure has none; its free poses are shown.
    """
    animation = animate(fit) if fit.segments else None
    if animation is None or not any(b - a > 1 for a, b in animation.motion.stretches):
        why = (
            "No rigid figure can be made, for no two frames in a row show all of it: these are the free poses of each "
            "frame."
        )
        return Moving(fit, None, (why,))
    shown = rigid_fit(fit, animation.motion)
    segments = dict(shown.segments)
    for s, end in animation.motion.model.ends.items():
        name = animation.motion.model.segments[s].name
        own = segments[name]
        if own.end is not None:
            # Of a foot: on the sole, where the fit has a place between the markers above it.
            segments[name] = replace(own, end=end + joint_of(own))
    notes = (*absences(fit, animation), *animation_notes(animation))
    return Moving(replace(shown, segments=segments), animation, notes)
