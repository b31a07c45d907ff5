"""Lists in a C3D file's POINT group that name points which are no markers."""

from __future__ import annotations

from typing import Any

from mocap_skel.readers.formats.c3d.contents import texts

SKELETON_LIST, AXES_LIST = "JOINT_CENTRES", "SEGMENT_AXES"
"""Lists with the points that `export.c3d_copy` added."""
# Lists of points that a model computed (Vicon), and lists that name all points.
_MODEL_LISTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "MODELED_MARKERS", "REACTIONS")
_POINT_LISTS = ("LABELS", "DESCRIPTIONS")


def computed_points(group: dict[str, Any]) -> frozenset[str]:
    """All that the file's lists of model outputs name; TYPE_GROUPS lists the lists."""
    found: set[str] = set()
    for title in {*_MODEL_LISTS, *texts(group, "TYPE_GROUPS")[::2]}:
        if not title.startswith(_POINT_LISTS):
            found.update(texts(group, title))
    return frozenset(found - {""})


def added_points(group: dict[str, Any]) -> frozenset[str]:
    """The points that an earlier fit has written into the file."""
    return frozenset(label for key in (SKELETON_LIST, AXES_LIST) for label in texts(group, key))
