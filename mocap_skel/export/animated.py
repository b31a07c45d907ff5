"""What formats with a rigid figure can be told, and how they come to it. Light, as the register asks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mocap_skel.errors import ExportError
from mocap_skel.export.joint_names import NAMINGS, joint_names
from mocap_skel.export.registry import Options, Turned, option

if TYPE_CHECKING:
    from mocap_skel.rig.animation import Animation, Choice
    from mocap_skel.rig.kinematics import Rig
    from mocap_skel.rig.quality import Quality
    from mocap_skel.skeleton_fit import SkeletonFit

AUTO = "auto"
# Which joints the rigid figure has.
RIGS = (MARKERS, FULL) = ("markers", "full")
# Hertz: no filter of a person's movement makes sense below or above.
SLOWEST, FASTEST = 0.5, 500.0
# Seconds.
LONGEST_GAP = 3600.0


def seconds_of(text: str) -> float:
    """A time in seconds, from what was typed.

    Raises:
        ValueError: it is no number of seconds from 0 to an hour.
    """
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= LONGEST_GAP:
        raise ValueError(f"{text!r}: a number of seconds, like 2")
    return value


def cutoff_of(text: str) -> float | str:
    """The frequency of a filter in hertz, AUTO, or 0 for none, from what was typed.

    Raises:
        ValueError: it is none of these.

    >>> cutoff_of("8"), cutoff_of("auto"), cutoff_of("0")
    (8.0, 'auto', 0.0)
    """
    if text.strip().lower() == AUTO:
        return AUTO
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if value != 0.0 and not SLOWEST <= value <= FASTEST:
        raise ValueError(f"{text!r}: a frequency in hertz, like 8; auto; or 0 for no filter")
    return value


def _gap() -> float:
    said = "seconds for which a turn that nothing shows is bridged by the motion before and after."
    value: float = option(2.0, said, parse=seconds_of, metavar="SECONDS", default_text="2")
    return value


def _smooth(default: float | str) -> float | str:
    said = (
        "take away the markers' movement above this frequency before the rigid figure is fitted (zero-phase "
        "Butterworth of 4th order); auto: by residual analysis; 0: nothing."
    )
    text = str(default) if isinstance(default, str) else f"{default:g}"
    value: float | str = option(default, said, parse=cutoff_of, metavar="HZ", default_text=text)
    return value


def _rig() -> str:
    said = (
        "joints of the rigid figure: markers = those that the markers show; full = those that animators know as "
        "well (spine, neck, collar bones, toes), by anatomy where no marker shows them."
    )
    value: str = option(MARKERS, said, choices=RIGS)
    return value


@dataclass(frozen=True)
class Tracks(Turned):
    """The options of a format of tracks, which may be those of the rigid figure.

    Attributes:
        rigid: tracks of the rigid figure, with constant bones and bridged gaps, not of the free fit.
        max_gap: of it, seconds for which a turn that nothing shows is bridged.
        smooth: of it, hertz of the filter, AUTO, or 0.
        rig: of it, MARKERS or FULL.
    """

    rigid: bool = option(
        False, "tracks of a rigid figure: constant bones, gaps bridged by its motion."
    )
    max_gap: float = _gap()
    smooth: float | str = _smooth(0.0)
    rig: str = _rig()

    def fit_of(self, fit: SkeletonFit) -> tuple[SkeletonFit, tuple[str, ...]]:
        """The fit whose tracks are asked for, and notes on how they were made."""
        if not self.rigid:
            said = ("--rig full is for the rigid figure: it needs --rigid here",)
            return fit, said if self.rig == FULL else ()
        from mocap_skel.rig.animation import animate, animation_notes
        from mocap_skel.rig.rigid_fit import rigid_fit

        animation = animate(fit, self.choice)
        return rigid_fit(fit, animation.motion), animation_notes(animation)

    @property
    def choice(self) -> Choice:
        """The same, as the rig takes it."""
        from mocap_skel.rig.animation import Choice
        from mocap_skel.rig.motion import Limits

        return Choice(
            Limits(gap=self.max_gap), smooth=self.smooth, even=False, full=self.rig == FULL
        )

    def quality(self, fit: SkeletonFit) -> Quality | None:
        """How good the rigid figure is whose tracks are asked for; None where those of the free fit are."""
        return _quality(fit, self.choice) if self.rigid else None


@dataclass(frozen=True)
class Whole(Options):
    """The options of a format that holds a moving rigid figure, bones as fitted, and cannot leave a gap.

    Attributes:
        max_gap: seconds for which a turn that nothing shows is bridged.
        smooth: hertz of the filter, AUTO, or 0.
        rig: which joints the figure has, MARKERS or FULL.
        stretches: "longest" or "all" of the stretches of frames in which the whole figure is known.
        trim: hold no pose at the clip's ends: leave those frames out.
    """

    max_gap: float = _gap()
    smooth: float | str = _smooth(0.0)
    rig: str = _rig()
    stretches: str = option(
        "longest",
        "where a gap is too long to bridge: the longest stretch of whole frames, or all, each in a file of its "
        "own.",
        choices=("longest", "all"),
    )
    trim: bool = option(False, "leave out incomplete frames at both ends, however few.")

    @property
    def choice(self) -> Choice:
        """The same, as the rig takes it."""
        from mocap_skel.rig.animation import Choice
        from mocap_skel.rig.motion import Limits

        hold = 0.0 if self.trim else Limits.hold
        limits = Limits(gap=self.max_gap, hold=hold)
        return Choice(limits, smooth=self.smooth, even=False, full=self.rig == FULL)

    def quality(self, fit: SkeletonFit) -> Quality:
        """How good the figure is, over all frames in which it is known."""
        return _quality(fit, self.choice)


@dataclass(frozen=True)
class Animated(Whole):
    """The options of a format for animators: a moving rigid figure, calm, and alike on both sides.

    Attributes:
        feet: "free", or "lock": each sole is held where it stands.
        asymmetric: keep the measured difference of left and right bones.
        names: how the joints are called, one of `joint_names.NAMINGS`.
        floor: move the figure up or down so that its lowest point over the clip is at zero.
    """

    smooth: float | str = _smooth(AUTO)
    feet: str = option("free", "lock holds each sole where it stands.", choices=("free", "lock"))
    asymmetric: bool = option(
        False, "keep the measured difference of left and right bones; else they are made equal."
    )
    names: str = option(
        "mocap",
        "joints named as in the skeleton file, as Mixamo's (mixamorig:LeftUpLeg), as Unreal's mannequin's "
        "(thigh_l), or as in the BVH files of the CMU database (LeftUpLeg).",
        choices=NAMINGS,
    )
    floor: bool = option(
        False, "move the figure up or down so that its lowest point over the clip is at zero."
    )

    @property
    def choice(self) -> Choice:
        """The same, as the rig takes it."""
        from dataclasses import replace

        return replace(super().choice, lock=self.feet == "lock", even=not self.asymmetric)


def _quality(fit: SkeletonFit, choice: Choice) -> Quality:
    from mocap_skel.rig.animation import animate
    from mocap_skel.rig.quality import quality_of

    return quality_of(animate(fit, choice))


def rigs_of(fit: SkeletonFit, options: Animated, up: str) -> tuple[dict[str, Rig], tuple[str, ...]]:
    """The rigs of a fit, one a stretch of frames, and notes.

    Args:
        fit: in the clip's own axes.
        options: what the format was told.
        up: the vertical axis of the rigs.

    Returns:
        What the file's name has before its suffix ("" for one stretch, else .1, .2 …) → rig.

    Raises:
        ExportError: there are no two frames in a row in which the figure is known.
    """
    from mocap_skel.rig.rigging import rig_of

    animation, stretches, said = animated(fit, options)
    notes, rigs = [*said], {}
    for part, stretch in stretches.items():
        rig, segments, more = rig_of(animation, stretch, up=up, floor=options.floor)
        names, unnamed = joint_names(segments, options.names)
        rigs[part] = rig.called(names)
        notes += [*more, *unnamed]
    return rigs, tuple(dict.fromkeys(notes))


def animated(
    fit: SkeletonFit, options: Whole
) -> tuple[Animation, dict[str, tuple[int, int]], tuple[str, ...]]:
    """The moving figure of a fit, the stretches of frames that are asked for, and notes.

    Args:
        fit: in the clip's own axes.
        options: what the format was told.

    Returns:
        The figure; what a file's name has before its suffix ("" for one stretch, else .1, .2 …) → (start, stop);
        what was done to the motion, and what is left out.

    Raises:
        ExportError: there are no two frames in a row in which the figure is known.
    """
    from mocap_skel.rig.animation import animate, animation_notes

    animation = animate(fit, options.choice)
    whole = [one for one in animation.motion.stretches if one[1] - one[0] > 1]
    if not whole:
        raise ExportError(f"{fit.clip}: no two frames in a row show a whole figure")
    chosen = sorted(whole) if options.stretches == "all" else whole[:1]
    notes = (*absences(fit, animation), *animation_notes(animation), *_left_out(animation, chosen))
    parts = {"" if len(chosen) == 1 else f".{i}": one for i, one in enumerate(chosen, 1)}
    return animation, parts, notes


def absences(fit: SkeletonFit, animation: Animation) -> list[str]:
    """Joints and poses that the figure does not have."""
    from mocap_skel.text import listed

    there = {segment.name for segment in animation.motion.model.segments}
    gone = [s.joint for s in fit.skeleton.segments if s.joint and s.name not in there]
    fitted = {joint.joint for joint in fit.joints if joint.fitted}
    never = [s.joint for s in fit.skeleton.segments if s.joint and s.name not in fit.segments]
    ends = [joint for joint in never if joint in fitted]
    notes = [f"without {listed(gone)}"] if gone else []
    if ends:
        notes.append(f"fitted, but no segment turns about them: {listed(ends)}")
    seldom = [joint for joint in gone if joint not in never]
    if seldom:
        notes.append(f"seen too seldom to be in the figure: {listed(seldom)}")
    if animation.average:
        notes.append(
            f"the rest pose of {listed(animation.average)} is the clip's average, no T-pose: the skeleton file "
            "has no direction (rest) for it"
        )
    return notes


def _left_out(animation: Animation, chosen: list[tuple[int, int]]) -> list[str]:
    """Frames that are in no file, and what is missing in them."""
    import numpy as np

    from mocap_skel.rig.animation import spans
    from mocap_skel.rig.bridging import runs
    from mocap_skel.text import listed

    outside = np.ones(animation.motion.poses.frames, dtype=bool)
    for start, stop in chosen:
        outside[start:stop] = False
    frames = runs(outside)
    if not frames:
        return []
    names = [
        segment.joint or segment.name
        for segment, absent in zip(
            animation.motion.model.segments, animation.motion.absent, strict=True
        )
        if absent.any()
    ]
    return [
        f"frames {spans(animation, frames)} are left out: in some of them nothing shows {listed(names)} "
        "(--max-gap bridges longer gaps, --stretches all writes every whole stretch)"
    ]
