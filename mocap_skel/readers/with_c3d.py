"""The second reader: the header and the parameters by py-c3d, the frames all at once by numpy.

py-c3d's own `read_frames` goes through a Python loop that costs 50 µs a frame and takes the number
of frames from fields that may be stale; and a trouble with analog channels, which nobody needs
here, ends it.
"""

from __future__ import annotations

import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap_skel.errors import ClipError
from mocap_skel.readers.frames import Groups, cut_off, first_frame, frame_count, without_padding
from mocap_skel.readers.raw import RawClip, decoded, number

_BLOCK = 512

# What py-c3d lets through on files that it does not expect; most of it is its own `assert`.
_REFUSALS = (
    ArithmeticError, AssertionError, AttributeError, LookupError, MemoryError, NameError, OSError,
    RuntimeError, TypeError, ValueError, struct.error,
)  # fmt: skip


def read(path: Path) -> RawClip:
    """Read a file with py-c3d.

    Raises:
        ClipError: py-c3d refuses the file; the message is its reason, without the file's name.
    """
    try:
        header, groups, machine = _described(path)
        return _clip(path, header, groups, machine)
    except _REFUSALS as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ClipError(f"py-c3d cannot read it: {reason}") from error


def _described(path: Path) -> tuple[Any, Groups, str]:
    """The header, the parameters, and the machine whose numbers the file has: INTEL, DEC, MIPS."""
    import c3d

    with path.open("rb") as file, warnings.catch_warnings():
        # Missing descriptions, no analog data: nothing that matters here.
        warnings.simplefilter("ignore")
        reader = c3d.Reader(file)
        machine: str = reader.proc_type
        groups: Groups = {}
        for name in ("POINT", "TRIAL"):
            group = reader.get(name)
            entries = group.param_items() if group is not None else ()
            groups[name] = {key: _value(param, machine) for key, param in entries}
    return reader.header, groups, machine


def _clip(path: Path, header: Any, groups: Groups, machine: str) -> RawClip:
    scale = number(groups["POINT"].get("SCALE")) or float(header.scale_factor)
    width = 4 if scale < 0 else 2
    values = 4 * header.point_count + header.analog_count
    start = (header.data_block - 1) * _BLOCK
    if not values or start < 0:
        raise ValueError(f"{values} values a frame from byte {start} on")
    said = max(0, header.last_frame - header.first_frame + 1)
    # 16 bits without a sign; some files hold the count as a float.
    counted = int(number(groups["POINT"].get("FRAMES"))) or said
    counted = counted & 0xFFFF if counted < 0 else counted
    first = first_frame(max(1, header.first_frame), groups)
    room = max(0, path.stat().st_size - start) // (values * width)
    length = frame_count(counted, first, groups, room)

    dtype = _dtype("f4" if width == 4 else "i2", machine)
    flat = np.fromfile(path, dtype, length * values, offset=start)
    # Numbers that are none are found later on, by what they are.
    with np.errstate(invalid="ignore"):
        data = _native(flat, machine).reshape(length, values)[:, : 4 * header.point_count]
        data = data[: without_padding(data, said)]
        data = data.reshape(len(data), header.point_count, 4)
        points = data[..., :3].astype(np.float64)
    # The fourth value holds a residual and a set of cameras; only its sign means the same to all.
    invalid = np.signbit(data[..., 3]) if width == 4 else data[..., 3] < 0
    if width == 2:
        points *= scale
    points[invalid] = np.nan
    return RawClip(
        path=str(path),
        points=points,
        invalid=invalid,
        rate=number(groups["POINT"].get("RATE")) or float(header.frame_rate),
        first_frame=first,
        length=len(data),
        parameters=groups,
        notes=cut_off(min(said, counted), room),
    )


def _value(param: Any, machine: str) -> Any:
    """A parameter's value: flat numbers, or a list of text."""
    if param.bytes_per_element == -1:
        # The first dimension is the width of one text.
        width = param.dimensions[0] if param.dimensions else 1
        texts = range(0, len(param.bytes), max(1, width))
        return [decoded(param.bytes[at : at + width]) for at in texts]
    kind = {1: "i1", 2: "i2", 4: "f4"}.get(param.bytes_per_element)
    if kind is None:
        return np.empty(0)
    dtype = _dtype(kind, machine)
    whole = len(param.bytes) // dtype.itemsize
    return _native(np.frombuffer(param.bytes, dtype, whole), machine)


def _dtype(kind: str, machine: str) -> np.dtype[Any]:
    return np.dtype((">" if machine == "MIPS" else "<") + kind)


def _native(values: NDArray[Any], machine: str) -> NDArray[Any]:
    """Numbers as they are meant: a DEC float has its words swapped and counts four times as much."""
    if machine != "DEC" or values.dtype.kind != "f":
        return values
    words = values.view("<u2").reshape(-1, 2)[:, ::-1]
    return np.ascontiguousarray(words).view("<f4").ravel() / np.float32(4)
