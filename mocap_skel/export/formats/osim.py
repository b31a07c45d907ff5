"""OpenSim: the rigid figure as a model without muscles, its motion, and the clip's markers for inverse kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mocap_skel.export.animated import Whole, animated
from mocap_skel.export.registry import Rendered, Source, option, register

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mocap_skel.export.body_masses import Mass
    from mocap_skel.export.coordinates import Figure
    from mocap_skel.export.files import Content
    from mocap_skel.skeleton_fit import SkeletonFit

SUFFIXES = MODEL, MOTION, MARKERS = (".osim", ".mot", ".markers.trc")
# Kilograms: who does not say a mass gets a body of this one, which every program can move.
UNIT_MASS = 1.0
# Kilograms, for a whole person or animal.
LIGHTEST, HEAVIEST = 0.01, 1000.0


def mass_of(text: str) -> float:
    """A body's mass in kilograms, from what was typed.

    Raises:
        ValueError: it is no number from 0.01 to 1000.

    >>> mass_of("70")
    70.0
    """
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not LIGHTEST <= value <= HEAVIEST:
        raise ValueError(f"{text!r}: the whole body's mass in kilograms, like 70")
    return value


@dataclass(frozen=True)
class OsimOptions(Whole):
    """What an OpenSim model may be told, beside what every moving figure may. Its vertical is y.

    Attributes:
        mass: kilograms of the whole body, None = unknown.
    """

    mass: float | None = option(
        None,
        "the whole body's mass in kilograms, shared out to the segments by de Leva 1996.",
        parse=mass_of,
        metavar="KG",
        default_text="unknown, a body of 1 kg",
    )


@register(
    "osim",
    suffixes=SUFFIXES,
    options=OsimOptions,
    makes="walk.osim, walk.mot and walk.markers.trc, a model for OpenSim",
    lacks="a model for OpenSim has no muscles here, and its motion cannot say that something is missing",
)
def write(fit: SkeletonFit, options: OsimOptions, source: Source) -> Rendered:
    """The model with the fitted bones and markers, its coordinates over time, and the markers as recorded.

    Raises:
        ExportError: there are no two frames in a row in which the figure is known.
    """
    from mocap_skel.export.coordinates import figure_of, plain_names
    from mocap_skel.export.opensim import model_text, motion_text
    from mocap_skel.export.trc_text import trc_text
    from mocap_skel.text import stem

    animation, stretches, said = animated(fit, options)
    figure = figure_of(animation, list(stretches.values()), _labels(source))
    masses, notes = _masses(figure, options.mass)
    (name,) = plain_names([f"{stem(source.path)} {fit.subject}".strip()])
    start = figure.values(next(iter(stretches.values())))[1][0].tolist()
    credit = f"mocap-skel, from {plain_names([source.path.name])[0]}"
    files: dict[str, Content] = {MODEL: model_text(name, credit, figure, masses, start)}
    for part, stretch in stretches.items():
        frames = slice(*stretch)
        titles, values = figure.values(stretch)
        files[part + MOTION] = motion_text(name, titles, values, fit.time[frames])
        points = figure.points[frames].reshape(len(values), -1)
        columns = [title for title, _, _ in figure.markers]
        numbers = fit.frame_numbers[frames]
        files[part + MARKERS] = trc_text(
            f"{name}{part}{MARKERS}", columns, [points], numbers, fit.time[frames], fit.rate
        )
    told = [*_axes(fit), *said, *notes, *_orders(figure)]
    return Rendered(files, tuple(f"OSIM: {note}" for note in told))


def _labels(source: Source) -> dict[str, str]:
    """Standard marker → the clip's own label, so that the lab's other marker files fit the model."""
    if source.assignment is None:
        return {}
    columns = source.assignment.columns
    return {
        marker: source.clip.labels[column]
        for own in columns.values()
        for marker, column in own.items()
    }


def _masses(figure: Figure, whole: float | None) -> tuple[list[Mass], list[str]]:
    import numpy as np

    from mocap_skel.export.body_masses import masses

    found, known = masses(
        figure.bodies,
        [joint.name for joint in figure.joints],
        [joint.parent for joint in figure.joints],
        np.stack([joint.place for joint in figure.joints]),
        figure.ends,
        whole or UNIT_MASS,
    )
    if whole is None:
        return found, ["masses are those of a body of 1 kg; --mass says the real one"]
    there = sum(one.mass for one in found)
    if not known:
        return found, [f"masses: {whole:g} kg shared out equally, for de Leva has no such segments"]
    less = f", {there:.1f} kg of {whole:g} with the segments of this figure"
    return found, [f"masses by de Leva 1996{less if there < 0.999 * whole else ''}"]


def _axes(fit: SkeletonFit) -> list[str]:
    from mocap_skel.export.trc_text import axes_note

    return [axes_note(fit.up, "y")] if fit.up != "y" else []


def _orders(figure: Figure) -> Iterator[str]:
    """Which joints turn in another order than the usual one, and which come near to gimbal lock in any."""
    from mocap_skel.export.coordinates import ROOT, USUAL
    from mocap_skel.text import listed

    others: dict[str, list[str]] = {}
    for joint in figure.joints:
        if joint.order != (ROOT if joint.parent < 0 else USUAL):
            others.setdefault(joint.order, []).append(joint.name)
    for order, names in others.items():
        yield f"turns in the order {order}, away from gimbal lock: {listed(names)}"
    if figure.locked:
        near = [f"{name} ({left:.0f} degrees)" for name, left in figure.locked.items()]
        yield f"near gimbal lock in any order of turns, where single angles mean little: {listed(near)}"
