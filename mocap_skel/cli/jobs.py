"""From the options that every fitting command has (`options.which`, `estimation`, `reading`) to a `Job`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NotRequired, TypedDict

from mocap_skel.cli import options

if TYPE_CHECKING:
    from mocap_skel.job import Job


class Told(TypedDict):
    """What those options say, under the names of their parameters."""

    association: str | None
    skeleton: str | None
    subject: str | None
    sigma: float | tuple[float, ...] | None
    pose: str
    method: str
    noise: str
    prior: NotRequired[str]
    unit: str | None
    rate: float | None
    salvage: bool


def job_of(told: Told, **more: Any) -> Job:
    """The job; `more` are fields of it. A command without --prior fits the movement alone.

    Raises:
        CallError: options that do not go together.
        AssociationError, SkeletonError: there is no such file, or it is wrong.
    """
    name, skeleton = told["association"], told["skeleton"]
    if name is None and skeleton is not None:
        # Names are guessed for the standard human.
        raise options.missing_association()
    options.check_estimation(told["method"], told["noise"], told["sigma"])
    from mocap_skel.association import read_association
    from mocap_skel.job import Job

    return Job(
        association=None if name is None else read_association(name, skeleton),
        subject=told["subject"], sigma=told["sigma"], pose=told["pose"], method=told["method"],
        noise=told["noise"], prior=told.get("prior", "none"), unit=told["unit"], rate=told["rate"], salvage=told["salvage"], **more,
    )  # fmt: skip
