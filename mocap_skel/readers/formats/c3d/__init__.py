"""C3D files: looked at first, then read as they were found.

`survey` looks at a file: `section` reads the header and the parameters, `layout` finds the points, `machine` and
`frames` know its numbers and counts. `choice` takes what is sound as it stands (`points`), and asks py-c3d about
the rest (`with_c3d`); `damage` finds what no counter tells. `point_lists` says which points are no
markers by the file's own lists, `person` the measures of the person.
"""

from __future__ import annotations

from pathlib import Path

from mocap_skel.readers.formats.c3d.choice import read_contents
from mocap_skel.readers.formats.c3d.contents import texts
from mocap_skel.readers.formats.c3d.person import person
from mocap_skel.readers.formats.c3d.point_lists import added_points, computed_points
from mocap_skel.readers.formats.c3d.section import is_c3d
from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.registry import register


@register("C3D", suffixes=(".c3d",), sniff=is_c3d, salvages=True)
def read(path: Path, salvage: bool = False) -> RawClip:
    """Read a C3D file.

    Args:
        path: the file.
        salvage: read the whole frames that a file holds which is cut off or damaged.

    Raises:
        ClipError: no reader can read it, it is cut off or damaged, or holds no point; the message does not
            name the file.
        OSError: it cannot be opened.
    """
    found = read_contents(path, salvage)
    point = found.parameters["POINT"]
    measures, said = person(found.parameters)
    return RawClip(
        points=found.points,
        labels=tuple(texts(point, "LABELS")),
        rate=found.rate,
        unit=next(iter(texts(point, "UNITS")), ""),
        up=next(iter(texts(point, "Y_SCREEN")), ""),
        up_name="POINT:Y_SCREEN",
        first_frame=found.first_frame,
        computed=computed_points(point),
        earlier=added_points(point),
        rescale=found.rescale,
        scale_names=found.scale_names,
        measures=measures,
        notes=(*found.notes, *said),
        events=found.events,
    )
