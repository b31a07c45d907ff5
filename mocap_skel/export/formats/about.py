"""A side file that says what a clip's results were made with: version, options, the clip's hash, which label is what."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mocap_skel.export.registry import Options, Rendered, Source, register

if TYPE_CHECKING:
    from mocap_skel.skeleton_fit import SkeletonFit

SUFFIX = ".about.json"


@dataclass(frozen=True)
class AboutOptions(Options):
    """Nothing can be told."""


@register(
    "about",
    suffixes=(SUFFIX,),
    options=AboutOptions,
    makes=f"walk{SUFFIX}, the version, the options and the clip's hash, for results that cannot say so",
    lacks="a side file only says what the results were made with, and holds none",
)
def write(fit: SkeletonFit, options: AboutOptions, source: Source) -> Rendered:
    """One JSON object.

    Raises:
        ClipError: the clip cannot be read once more.
    """
    import json

    from mocap_skel.export.digest import digest_of

    del options
    told = dict(source.options())
    about = {
        "clip": source.clip.name,
        "sha256": digest_of(source.path),
        "subject": fit.subject,
        "version": told.pop("version", None),
        "options": told,
        "markers": _labels(source),
        "decided": list(source.decided),
    }
    text = json.dumps(about, indent=1, allow_nan=False, ensure_ascii=False)
    return Rendered({SUFFIX: f"{text}\n"})


def _labels(source: Source) -> dict[str, dict[str, str]]:
    """Segment → marker → its label in the clip."""
    if source.assignment is None:
        return {}
    labels = source.clip.labels
    return {
        segment: {marker: labels[column] for marker, column in columns.items()}
        for segment, columns in source.assignment.columns.items()
    }
