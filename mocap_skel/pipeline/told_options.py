"""What decides the results of a clip beside its file: the version and the options, as a manifest keeps them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from mocap_skel.export.digest import digest_of
from mocap_skel.export.registry import told_of
from mocap_skel.pipeline.job import Job
from mocap_skel.version import __version__

# Fields of a job that do not change what is in the result files.
_NO_OPTIONS = {
    "association",
    "figure",
    "calibration",
    "static",
    "formats",
    "folder",
    "overwrite",
    "inputs",
    "command",
}


def options_of(job: Job) -> dict[str, Any]:
    """All that decides what is in the results of a clip: the version and the options that are no defaults.

    Files of the call are named, with a hash of what they say.
    """
    told: dict[str, Any] = {"version": __version__}
    if job.association is not None:
        told["assoc"] = Path(job.association.path).name
        told["assoc_sha256"] = _hash(replace(job.association, path=""))
    if job.figure is not None:
        told["skeleton"] = job.figure.name
        told["skeleton_sha256"] = _hash(job.figure)
    if job.calibration is not None:
        told["calibration_sha256"] = sha256(_calibration_text(job)).hexdigest()
    if job.static is not None:
        told["static"] = job.static.name
        told["static_sha256"] = digest_of(job.static)
    for one in fields(job):
        value = getattr(job, one.name)
        default = one.default if one.default_factory is MISSING else one.default_factory()
        if one.name not in _NO_OPTIONS and value != default:
            told[one.name] = value
    told["formats"] = told_of(job.formats)
    # As it is read from the manifest: lists, no tuples.
    plain: dict[str, Any] = json.loads(json.dumps(told, default=str))
    return plain


def has_all(known: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    """Whether results with the known options are all that is wanted: the same fit, and at least the formats."""
    formats = known["formats"]
    return fit_options(known) == fit_options(wanted) and all(
        formats.get(name) == told for name, told in wanted["formats"].items()
    )


def fit_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Those that decide the fit, whatever formats it is written in."""
    return {name: value for name, value in options.items() if name != "formats"}


def _calibration_text(job: Job) -> bytes:
    from mocap_skel.export.calibration_json import calibration_json

    assert job.calibration is not None
    return calibration_json(job.calibration, ()).encode()


def _hash(thing: object) -> str:
    return sha256(repr(thing).encode()).hexdigest()[:16]
