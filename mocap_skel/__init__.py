"""mocap-skel: skeletons from optical motion capture, by closed-form sphere fits.

from mocap_skel import associate, fit_skeleton, read_association, read_clip, write_fit

clip, association = read_clip("walk.c3d"), read_association("cmu")
for subject in associate(clip, association):
    fit = fit_skeleton(clip, subject, association.skeleton)
    write_fit(fit, clip, "out", ["csv", "bvh"])
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocap_skel.association import Association, associate, read_association
    from mocap_skel.clip import Clip
    from mocap_skel.errors import MocapSkelError
    from mocap_skel.export.results import write_fit
    from mocap_skel.fit import SkeletonFit, fit_skeleton
    from mocap_skel.readers import read_clip
    from mocap_skel.skeleton import read_skeleton
    from mocap_skel.tables import joints_table, points_table, tracks_table

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
    "write_fit": "export.results",
}

__all__ = [
    "Association", "Clip", "MocapSkelError", "SkeletonFit", "associate", "fit_skeleton", "joints_table",
    "points_table", "read_association", "read_clip", "read_skeleton", "tracks_table", "write_fit",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PUBLIC[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
