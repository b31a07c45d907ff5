"""C3D files as no library writes them: byte by byte, with any parameter and any number format."""

from __future__ import annotations

import struct

import numpy as np

from mocap_skel.readers import read_clip

BLOCK = 512
MACHINES = {"INTEL": 84, "DEC": 85, "MIPS": 86}


def as_dec(values):
    words = (np.asarray(values, "<f4") * 4).astype("<f4").view("<u2").reshape(-1, 2)
    return words[:, ::-1].tobytes()


def numbers(values, kind, machine):
    values = np.asarray(values).ravel()
    if kind == "f4" and machine == "DEC":
        return as_dec(values)
    return values.astype((">" if machine == "MIPS" else "<") + kind).tobytes()


def parameter(group, name, value, machine, description=""):
    """One parameter: text, list of text (up to 255), integers (numpy or int) or floats."""
    if isinstance(value, str | bytes) or (isinstance(value, list) and isinstance(value[0], str)):
        rows = value if isinstance(value, list) else [value]
        raw = [row if isinstance(row, bytes) else row.encode() for row in rows]
        width = max(map(len, raw))
        dims = [width, len(raw)] if isinstance(value, list) else [width]
        kind, data = -1, b"".join(row.ljust(width) for row in raw)
    else:
        array = np.asarray(value)
        dims = list(array.shape)
        kind, code = (4, "f4") if array.dtype.kind == "f" else (2, "i2")
        data = numbers(array, code, machine)
    body = struct.pack("<bB", kind, len(dims)) + bytes(dims) + data
    body += bytes([len(description)]) + description.encode()
    order = ">" if machine == "MIPS" else "<"
    head = struct.pack("<bb", len(name), group) + name.encode()
    return head + struct.pack(order + "h", len(body) + 2) + body


def signed(count):
    """An unsigned 16-bit number as the signed one that a parameter holds."""
    return int(np.uint16(count & 0xFFFF).view(np.int16))


def words(value):
    """A number of 32 bits as two words, the low one first."""
    return np.array([signed(value), value >> 16])


def c3d_file(
    path,
    points,
    *,
    residuals=None,
    first=1,
    last=None,
    rate=100.0,
    scale=-1.0,
    machine="INTEL",
    analogs=0,
    tail=b"",
    described="",
    **point,
):
    """Write points (frames, markers, 3).

    Args:
        analogs: analog values a frame, one a channel.
        tail: what stands behind the points.
        described: the description of every parameter.
        point: any parameter of POINT, or of another group as `TRIAL__…`, None to leave it out.
    """
    points = np.asarray(points, dtype=float)
    count, markers, _ = points.shape
    order = ">" if machine == "MIPS" else "<"
    said = {
        "USED": signed(markers),
        "FRAMES": signed(count),
        "SCALE": float(scale),
        "RATE": float(rate),
        "LABELS": [f"M{i + 1}" for i in range(markers)] or None,
        "UNITS": "mm",
    }
    if analogs:
        # ezc3d crashes the interpreter where these are not there.
        said |= {
            "ANALOG__USED": analogs,
            "ANALOG__RATE": rate,
            "ANALOG__GEN_SCALE": 1.0,
            "ANALOG__SCALE": np.ones(analogs),
            "ANALOG__OFFSET": np.zeros(analogs, int),
            "ANALOG__LABELS": ["A"] * analogs,
        }
    said |= point
    more = (name.split("__")[0] for name in said if "__" in name)
    groups = list(dict.fromkeys(["POINT", "ANALOG", "TRIAL", *more]))
    records = [
        struct.pack("<bb", len(name), -i) + name.encode() + struct.pack(order + "hb", 3, 0)
        for i, name in enumerate(groups, 1)
    ]
    section = b""
    # The place of the data depends on the parameters' length, in which it stands.
    for start in (0, 1):
        said["DATA_START"] = start and 2 + len(section) // BLOCK
        section = b"\1\x50\0" + bytes([MACHINES[machine]]) + b"".join(records)
        for name, value in said.items():
            group = 1 + groups.index(name.split("__")[0] if "__" in name else "POINT")
            if value is not None:
                section += parameter(group, name.split("__")[-1], value, machine, described)
        section += bytes(-len(section) % BLOCK or BLOCK)
    section = section[:2] + bytes([len(section) // BLOCK]) + section[3:]

    last = first + count - 1 if last is None else last
    header = b"\2\x50" + struct.pack(
        order + "5H", markers, analogs, first & 0xFFFF, min(last, 0xFFFF), 10
    )
    header += numbers(scale, "f4", machine) + struct.pack(
        order + "2H", 2 + len(section) // BLOCK, 1 if analogs else 0
    )
    header += numbers(rate, "f4", machine)

    values = np.zeros((count, 4 * markers + analogs))
    four = values[:, : 4 * markers].reshape(count, markers, 4)
    four[..., :3] = points if scale < 0 else np.round(points / scale)
    four[..., 3] = 0 if residuals is None else residuals
    values[:, : 4 * markers] = four.reshape(count, 4 * markers)
    values[:, 4 * markers :] = 123
    data = numbers(values, "f4" if scale < 0 else "i2", machine) + tail
    data += bytes(-len(data) % BLOCK)
    path.write_bytes(header.ljust(BLOCK, b"\0") + section + data)
    return path


def cloud(count=20, markers=3, seed=0):
    """Points about a metre apart, in millimetres, none of them zero."""
    return np.random.default_rng(seed).uniform(200.0, 1400.0, (count, markers, 3))


def notes(clip):
    return "\n".join(clip.notes)


def tracks(count=60, markers=4, seed=0):
    """Points that move as markers do, (frames, markers, 3) in mm: some mm a frame, a metre apart."""
    rng = np.random.default_rng(seed)
    time = np.arange(count)[:, None, None] / 100
    phase, middle = rng.uniform(0, 6, (markers, 3)), rng.uniform(-900, 900, (markers, 3))
    return middle + 100 * np.sin(3 * time + phase)


def is_right(path, points=None, tolerance=1e-3, **options):
    """The clip, which holds the tracks."""
    clip = read_clip(path, **options)
    points = tracks() if points is None else points
    np.testing.assert_allclose(clip.points * 1000, points, atol=tolerance)
    return clip


def change(path, at, form, *values):
    data = bytearray(path.read_bytes())
    struct.pack_into(form, data, at, *values)
    path.write_bytes(data)


def place(path, name):
    """Where a parameter's type stands."""
    return path.read_bytes().index(name.encode(), BLOCK) + len(name) + 2


def value_of(path, name, form, value):
    """Change the value of a scalar."""
    change(path, place(path, name) + 2, form, value)


def blocks_between(path, before, blocks):
    """Blocks of noise before block `before` (from 1), which nothing points to."""
    data = path.read_bytes()
    noise = np.random.default_rng(9).bytes(BLOCK * blocks)
    path.write_bytes(data[: BLOCK * (before - 1)] + noise + data[BLOCK * (before - 1) :])
