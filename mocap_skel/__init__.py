"""mocap-skel: skeletons from optical motion capture, by closed-form sphere fits.

Read a clip, say which label is which marker, fit a skeleton to each subject, write it:

    >>> from tempfile import TemporaryDirectory
    >>> from mocap_skel import associate, fit_skeleton, read_association, read_clip, write_fit
    >>> clip = read_clip("sample_data/range_of_motion.c3d")
    >>> association = read_association("cmu")
    >>> with TemporaryDirectory() as folder:
    ...     for subject in associate(clip, association):
    ...         fit = fit_skeleton(clip, subject, association.skeleton)
    ...         files = write_fit(fit, clip, folder, ["csv", "bvh"])
    >>> print(len(fit.joints), *sorted(path.name for path in files))
    14 range_of_motion.bvh range_of_motion.joints.csv range_of_motion.skeleton.csv
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mocap_skel.version import __version__ as __version__

if TYPE_CHECKING:
    from mocap_skel.angles.joint_angles import joint_angles
    from mocap_skel.clip import Clip
    from mocap_skel.errors import MocapSkelError
    from mocap_skel.export.result_files import write_fit
    from mocap_skel.figure.skeleton import read_skeleton
    from mocap_skel.fit import fit_skeleton
    from mocap_skel.labels.association import Association, associate, read_association
    from mocap_skel.readers import read_clip
    from mocap_skel.results.angle_tables import angles_table
    from mocap_skel.results.tables import joints_table, points_table, tracks_table
    from mocap_skel.skeleton_fit import SkeletonFit

# Loaded on first use: `mocap-skel --help` must not wait for numpy.
_PUBLIC = {
    "Association": "labels.association",
    "Clip": "clip",
    "MocapSkelError": "errors",
    "SkeletonFit": "skeleton_fit",
    "angles_table": "results.angle_tables",
    "associate": "labels.association",
    "fit_skeleton": "fit",
    "joint_angles": "angles.joint_angles",
    "joints_table": "results.tables",
    "points_table": "results.tables",
    "read_association": "labels.association",
    "read_clip": "readers",
    "read_skeleton": "figure.skeleton",
    "tracks_table": "results.tables",
    "write_fit": "export.result_files",
}

__all__ = [
    "Association", "Clip", "MocapSkelError", "SkeletonFit", "angles_table", "associate", "fit_skeleton",
    "joint_angles", "joints_table", "points_table", "read_association", "read_clip", "read_skeleton", "tracks_table", "write_fit",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PUBLIC[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
