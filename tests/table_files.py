"""Files of markers as text, written from points that are known: TRC, Motive, Qualisys, plain tables.

A number is written with five decimals; `rounded` gives the points as such a file has them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Marked:
    """What stands in a file: points (frames, markers, 3) in its unit, NaN = missing."""

    points: np.ndarray
    labels: tuple[str, ...]
    rate: float = 100.0
    first: int = 1
    unit: str = "mm"
    sep: str = "\t"
    comma: bool = False
    decimals: int = 5

    def but(self, **changes):
        return replace(self, **changes)

    def number(self, value):
        if np.isnan(value):
            return ""
        return f"{value:.{self.decimals}f}".replace(".", "," if self.comma else ".")

    def cells(self, frame):
        return [self.number(value) for value in self.points[frame].ravel()]

    def time(self, frame):
        return self.number((frame + self.first - 1) / self.rate)

    def rows(self, *, frame=True, time=True):
        for i in range(len(self.points)):
            before = ([str(i + self.first)] if frame else []) + ([self.time(i)] if time else [])
            yield self.sep.join([*before, *self.cells(i)])

    def text(self, lines):
        return "".join(f"{line}\n" for line in lines)


def marked(frames=20, labels=("LASI", "RASI", "LKNE", "C7"), seed=0, **told):
    """Markers of something as large as a person that moves, in mm; a few samples are missing."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(0, 1500, (1, len(labels), 3))
    points = place + np.cumsum(rng.normal(0, 5, (frames, len(labels), 3)), axis=0)
    points[rng.random((frames, len(labels))) < 0.1] = np.nan
    return Marked(points, tuple(labels), **told)


def rounded(file):
    """(frames, markers, 3) as the file's text has them."""
    return np.round(file.points, file.decimals)


def trc(file, *, names=None, said=None, unit=None, blank=True, rate=None):
    """TRC, as OpenSim's documentation has it."""
    s, count = file.sep, len(file.labels)
    rate = f"{file.rate:g}" if rate is None else rate
    frames = len(file.points) if said is None else said
    head = [
        s.join(["PathFileType", "4", "(X/Y/Z)", "walk.trc"]),
        s.join(["DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate", "OrigDataStartFrame", "OrigNumFrames"]),
        s.join([rate, rate, str(frames), str(count), unit or file.unit, rate, "1", str(frames)]),
        s.join(["Frame#", "Time", *(names or [cell for x in file.labels for cell in (x, "", "")])]),
        s.join(["", "", *(f"{axis}{i + 1}" for i in range(count) for axis in "XYZ")]),
        *([""] if blank else []),
    ]  # fmt: skip
    return file.text([*head, *file.rows()])


def qualisys(file, *, frame=False, time=False, titles=False, said=None, before=(), tail=""):
    """TSV of Qualisys Track Manager."""
    s = file.sep
    frames = len(file.points) if said is None else said
    words = {
        "NO_OF_FRAMES": [frames], "NO_OF_CAMERAS": [12], "NO_OF_MARKERS": [len(file.labels)],
        "FREQUENCY": [f"{file.rate:g}"], "NO_OF_ANALOG": [0], "ANALOG_FREQUENCY": [0],
        "DESCRIPTION": ["--"], "TIME_STAMP": ["2024-04-15, 10:39:38.777", "406646.66137317"],
        "DATA_INCLUDED": ["3D"], "MARKER_NAMES": file.labels,
        "TRAJECTORY_TYPES": ["Measured"] * len(file.labels), **dict(before),
    }  # fmt: skip
    head = [
        s.join([word, *map(str, values)]) for word, values in words.items() if values is not None
    ]
    if titles:
        first = [word for word, there in (("Frame", frame), ("Time", time)) if there]
        head.append(s.join([*first, *(f"{x} {a}" for x in file.labels for a in "XYZ")]))
    return file.text([*head, *(row + tail for row in file.rows(frame=frame, time=time))])


def motive(file, *, columns=None, version="1.23", named=True, parent=False, said=None, code=False):
    """CSV of Motive: `columns` are (type, name, property, axis, values of all frames) beside the markers.

    They stand before the markers; `code` adds a column of time codes. Motive's frame 0 is at 0 s.
    """
    s, frames = file.sep, len(file.points)
    every = list(columns or [])
    for m, label in enumerate(file.labels):
        for a, axis in enumerate("XYZ"):
            every.append(("Marker", label, "Position", axis, file.points[:, m, a]))
    lead = ["", "", *([""] if code else [])]

    def row(word, cells):
        return s.join([lead[0], word if named else "", *lead[2:], *cells])

    rate = file.number(file.rate)
    first = {
        "Format Version": version, "Take Name": "walk", "Take Notes": "", "Capture Frame Rate": rate,
        "Export Frame Rate": rate, "Capture Start Time": "2024-01-01 10.00.00.000 AM",
        "Total Frames in Take": str(frames + 50),
        "Total Exported Frames": str(frames if said is None else said),
        "Rotation Type": "Quaternion", "Length Units": file.unit, "Coordinate Space": "Global",
    }  # fmt: skip
    head = [
        s.join(cell for pair in first.items() for cell in pair),
        "",
        row("Type", [one[0] for one in every]),
        row("Name", [f'"{one[1]}"' for one in every]),
        row("ID", [f'"{abs(hash(one[1]))}"' for one in every]),
        *([row("Parent", [""] * len(every))] if parent else []),
        row("", [one[2] for one in every]),
        s.join(
            ["Frame", "Time (Seconds)", *(["TimeCode"] if code else []), *(c[3] for c in every)]
        ),
    ]
    rows = [
        s.join(
            [str(i + file.first), file.time(i + 1), *(["15:26:46:12.02"] if code else [])]
            + [file.number(one[4][i]) for one in every]
        )
        for i in range(frames)
    ]
    return file.text([*head, *rows])


def nexus(file, *, before="", after="", rate=None, unit=None, fast=False, ends=("", "")):
    """CSV of Vicon Nexus, its block of trajectories between other blocks; `fast` adds velocities as Nexus has them."""
    s, count = file.sep, len(file.labels)
    axes, units = "XYZ", [unit or file.unit] * 3
    if fast:
        axes, units = ["X", "Y", "Z", "X'", "Y'", "Z'"], [*units, *["mm/s"] * 3]
    blank = [""] * (len(axes) - 1)
    rows = []
    for row in file.rows(time=False):
        number, *values = row.split(s)
        if fast:
            values = [x for m in range(count) for x in (*values[3 * m : 3 * m + 3], "7", "8", "9")]
        rows.append(s.join([number, "0", *values]))
    head = [
        "Trajectories" + ends[0],
        (f"{file.rate:g}" if rate is None else rate) + ends[1],
        s.join(["", "", *(cell for x in file.labels for cell in (x, *blank))]),
        s.join(["Frame", "Sub Frame", *list(axes) * count]),
        s.join(["", "", *units * count]),
    ]
    return before + file.text([*head, *rows]) + after


NEXUS_EVENTS = """Events
100
Subject,Context,Name,Time (s),Description
Ann,Left,Foot Strike,1.05,"The instant the heel strikes the ground, say"
Ann,Right,Foot Off,1.1,The instant the toe leaves the ground

"""
NEXUS_DEVICES = """Devices
1000
,,Imported AMTI OR6 #1 - Force,,,
Frame,Sub Frame,Fx,Fy,Fz
,,N,N,N
1,0,0.1,0.2,700
1,1,0.1,0.2,701

"""
NEXUS_MODEL = """
Model Outputs
100
,,Ann:LKneeAngles,,,
Frame,Sub Frame,X,Y,Z
,,deg,deg,deg
1,0,12.5,3,4
2,0,,,
"""


def plain(file, *, spell="{label}_{axis}", frame="frame", time="time", below=()):
    """A table with columns of x, y and z, spelt in any way."""
    names = [spell.format(label=x, axis=a, AXIS=a.upper()) for x in file.labels for a in "xyz"]
    before = [name for name in (frame, time) if name]
    rows = file.rows(frame=bool(frame), time=bool(time))
    return file.text([file.sep.join([*before, *names]), *below, *rows])
