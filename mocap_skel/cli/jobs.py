"""What the shared options of a command say: read the clip and association, or make the `Job`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NotRequired, TypedDict

from mocap_skel.cli import options
from mocap_skel.errors import CallError

if TYPE_CHECKING:
    from mocap_skel.clip import Clip
    from mocap_skel.joints.calibration import Calibration
    from mocap_skel.labels.association import Association
    from mocap_skel.pipeline.job import Job


class Looked(TypedDict):
    """What `options.which` and `options.reading` say, under the names of their parameters."""

    association: str | None
    skeleton: str | None
    subject: str | None
    unit: str | None
    rate: float | None
    salvage: bool
    mirror: str | None
    clip_up: str | None


class Told(Looked):
    """What `options.estimation` says besides."""

    sigma: float | tuple[float, ...] | None
    pose: str
    method: str
    noise: str
    prior: NotRequired[str]
    trust: NotRequired[bool]
    calibration: NotRequired[Path | None]
    measure: NotRequired[tuple[str, ...]]
    measures: NotRequired[Path | None]
    static: NotRequired[Path | None]


@contextmanager
def looked_at(path: Path, told: Looked) -> Iterator[tuple[Clip, Job]]:
    """Read a clip for a command that fits nothing, and make the job that names its markers.

    What is done with them inside `with` may take no more memory than a clip may.

    Raises:
        AssociationError, SkeletonError: there is no such file, or it is wrong.
        ClipError: the clip cannot be read, or needs too much memory.
    """
    from mocap_skel.figure.skeleton import read_skeleton
    from mocap_skel.labels.association import read_association
    from mocap_skel.pipeline.job import Job
    from mocap_skel.pipeline.limits import limited

    name, skeleton = told["association"], told["skeleton"]
    association = None if name is None else read_association(name, skeleton)
    figure = None if skeleton is None else read_skeleton(skeleton)
    job = Job(
        association, subject=told["subject"], unit=told["unit"], rate=told["rate"],
        salvage=told["salvage"], mirror=told["mirror"], clip_up=told["clip_up"], figure=figure,
    )  # fmt: skip
    with limited(path):
        yield job.read(path), job


def job_of(told: Told, clips: Iterable[Path], **more: Any) -> Job:
    """Make the job of a command that fits. A command without --prior fits by the movement alone.

    Args:
        told: what the options say.
        clips: those of the call. They and the files that the options name are never written over.
        more: other fields of the job.

    Raises:
        CallError: options that do not go together.
        AssociationError, SkeletonError: there is no such file, or it is wrong.
    """
    name, skeleton = told["association"], told["skeleton"]
    options.check_estimation(told["method"], told["noise"], told["sigma"])
    from mocap_skel.figure.skeleton import read_skeleton
    from mocap_skel.labels.association import read_association
    from mocap_skel.pipeline.job import Job

    association = None if name is None else read_association(name, skeleton)
    figure = None if skeleton is None else read_skeleton(skeleton)
    calibration, association = _calibration(told, association)
    return Job(
        association=association, figure=figure, calibration=calibration,
        subject=told["subject"], sigma=told["sigma"], pose=told["pose"], method=told["method"],
        noise=told["noise"], prior=told.get("prior", "none"), unit=told["unit"], rate=told["rate"],
        measures=_measures(told), salvage=told["salvage"], mirror=told["mirror"], clip_up=told["clip_up"],
        trust=told.get("trust", False),
        static=told.get("static"), inputs=_inputs(told, clips), **more,
    )  # fmt: skip


def _inputs(told: Told, clips: Iterable[Path]) -> frozenset[Path]:
    """The files that the call reads; a bare name of a shipped one is no file here, and does no harm."""
    named = (
        told["association"], told["skeleton"], told.get("calibration"), told.get("measures"), told.get("static"),
    )  # fmt: skip
    return frozenset([*clips, *(Path(name) for name in named if name)])


def _measures(told: Told) -> dict[str, float]:
    """The measures of the person that the call gives, full name → metres."""
    path, said = told.get("measures"), told.get("measure", ())
    if path is None and not said:
        return {}
    from mocap_skel.measures import measures_of, read_measures

    return {**({} if path is None else read_measures(path)), **measures_of(said)}


def _calibration(
    told: Told, association: Association | None
) -> tuple[Calibration | None, Association | None]:
    """The calibration; and the association, which is the calibration's own where the call names none."""
    path = told.get("calibration")
    if path is None:
        return None, association
    from mocap_skel.export.calibration_json import check_figure, read_calibration
    from mocap_skel.joints.choices import check_method
    from mocap_skel.labels.calibrated import association_of

    try:
        check_method(told["method"], told["noise"], told["sigma"], calibrated=True)
    except ValueError as error:
        raise CallError(str(error)) from error
    calibration = read_calibration(path)
    # Names that are guessed clip by clip need not be the same in another clip.
    association = association or association_of(calibration, path, told["skeleton"])
    check_figure(path, calibration, association.skeleton)
    return calibration, association
