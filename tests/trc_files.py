"""TRC files read by a plain parser."""

import numpy as np


def read_trc(text):
    """Head, names, frame numbers, times and points (frames, names, 3) of a TRC, as its format has it."""
    lines = str(text).split("\n")
    assert lines[0].split("\t")[:3] == ["PathFileType", "4", "(X/Y/Z)"]
    head = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    titles = lines[3].split("\t")
    assert titles[:2] == ["Frame#", "Time"]
    names = titles[2::3]
    assert lines[4].split("\t")[2:] == [f"{a}{i + 1}" for i in range(len(names)) for a in "XYZ"]
    assert lines[5] == "" and lines[-1] == ""
    rows = [line.split("\t") for line in lines[6:-1]]
    width = 2 + 3 * len(names)
    # OpenSim wants one tab more where the last cell is empty.
    assert all(len(row) == width + (row[width - 1] == "") for row in rows)
    values = np.array([[float(cell or "nan") for cell in row[:width]] for row in rows])
    points = values[:, 2:].reshape(len(rows), -1, 3)
    return head, names, values[:, 0], values[:, 1], points
