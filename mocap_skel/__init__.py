"""mocap-skel: skeletons from optical motion capture, by closed-form sphere fits.

from mocap_skel import associate, fit_skeleton, read_association, read_clip

clip = read_clip("walk.c3d")
association = read_association("cmu")
for subject in associate(clip, association):
    fit = fit_skeleton(clip, subject, association.skeleton)
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Loaded on first use: `mocap-skel --help` must not wait for numpy.
_PUBLIC = {
    "Association": "association",
    "Clip": "clip",
    "MocapSkelError": "errors",
    "SkeletonFit": "fit",
    "associate": "association",
    "fit_skeleton": "fit",
    "joints_table": "tables",
    "points_table": "tables",
    "read_association": "association",
    "read_clip": "readers",
    "read_skeleton": "skeleton",
    "tracks_table": "tables",
}

__all__ = [*_PUBLIC]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PUBLIC[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
