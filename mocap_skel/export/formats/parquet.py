"""Parquet, by pyarrow: the moving skeleton and its angles in long form, and the joints with their evidence."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mocap_skel.export.animated import Tracks
from mocap_skel.export.registry import Rendered, Source, register
from mocap_skel.extras import extra
from mocap_skel.text import visible
from mocap_skel.version import __version__

if TYPE_CHECKING:
    from mocap_skel.skeleton_fit import SkeletonFit

# Columns that are the same text over and over.
_REPEATED = ("clip", "subject", "point", "kind", "joint", "angle")


@register(
    "parquet",
    suffixes=(".skeleton.parquet", ".joints.parquet", ".angles.parquet"),
    options=Tracks,
    makes="walk.skeleton.parquet, walk.joints.parquet and walk.angles.parquet, the tables of csv and angles in long form",
    lacks="a Parquet table has points only, not how the segments turn",
    needs=("pyarrow.parquet", "parquet"),
)
def write(fit: SkeletonFit, options: Tracks, source: Source) -> Rendered:
    """The three tables of a fit.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    from mocap_skel.results.axes import turned

    fit, notes = options.fit_of(fit)
    fit = turned(fit, options.up)
    angles, said = angles_parquet(fit, source.static)
    return Rendered(
        {
            ".skeleton.parquet": skeleton_parquet(fit),
            ".joints.parquet": joints_parquet(fit),
            ".angles.parquet": angles,
        },
        (*(f"Parquet: {note}" for note in notes), *(f"angles: {note}" for note in said)),
    )


def skeleton_parquet(fit: SkeletonFit) -> bytes:
    """One row a frame and point, the columns of `points_table`; missing is null.

    Unit, vertical axis and frame rate stand in the schema's metadata.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    from mocap_skel.results.tables import point_columns

    return _long(fit, point_columns(fit))


def angles_parquet(fit: SkeletonFit, static: SkeletonFit | None) -> tuple[bytes, tuple[str, ...]]:
    """One row a frame and angle, degrees; missing is null. And the notes of the angles.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    from mocap_skel.angles.joint_angles import joint_angles
    from mocap_skel.results.angle_tables import long_angle_columns

    angles = joint_angles(fit, static)
    return _long(fit, long_angle_columns(fit, angles)), angles.notes


def _long(fit: SkeletonFit, long: Mapping[str, Any]) -> bytes:
    import numpy as np

    pa = extra("pyarrow", "parquet")
    columns = {}
    for name, values in long.items():
        if name == "clip":
            # A file's name need not be text, and what is written is.
            values = np.full(len(values), visible(fit.clip), dtype=object)
        if name in _REPEATED:
            columns[name] = pa.array(values, pa.string()).dictionary_encode()
        elif values.dtype.kind == "f":
            columns[name] = pa.array(values, mask=~np.isfinite(values))
        else:
            columns[name] = pa.array(values)
    return _file(fit, pa.table(columns))


def joints_parquet(fit: SkeletonFit) -> bytes:
    """One row a joint: clip, subject and the columns of joints.csv, its lists as lists.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    from mocap_skel.results.tables import joint_rows

    pa = extra("pyarrow", "parquet")
    rows = [{"clip": visible(fit.clip), "subject": fit.subject, **row} for row in joint_rows(fit)]
    names = list(rows[0]) if rows else []
    columns = {name: [row[name] for row in rows] for name in names}
    return _file(fit, pa.table({n: pa.array(v, _type(pa, n, v)) for n, v in columns.items()}))


def _type(pa: Any, name: str, values: list[Any]) -> Any:
    """A column's type by what is in it; where that says nothing, what it would be."""
    known = [value for value in values if value is not None]
    if any(isinstance(value, list) for value in known):
        inner = [item for value in known for item in value]
        return pa.list_(_type(pa, name, inner))
    if any(isinstance(value, str) for value in known):
        return pa.string()
    if known and all(isinstance(value, bool) for value in known):
        return pa.bool_()
    if known and all(isinstance(value, int) for value in known):
        return pa.int64()
    return pa.string() if name in ("markers", "angles") else pa.float64()


def _file(fit: SkeletonFit, table: Any) -> bytes:
    parquet = extra("pyarrow.parquet", "parquet")
    said = {
        "unit": "m", "up": fit.up, "axes": "right-handed", "rate": f"{fit.rate:.10g}",
        "time": "seconds, as the clip's file counts them", "clip": visible(fit.clip), "subject": fit.subject,
        "creator": f"mocap-skel {__version__}",
    }  # fmt: skip
    target = io.BytesIO()
    parquet.write_table(table.replace_schema_metadata(said), target, compression="zstd")
    return target.getvalue()
