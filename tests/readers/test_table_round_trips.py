"""Whatever is written as a table is read, to the last digit."""

from __future__ import annotations

import gzip

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from table_files import Marked, motive, nexus, plain, qualisys, trc

from mocap_skel.readers.registry import read_raw

NUMBERS = st.floats(-1e5, 1e5).map(lambda x: round(x, 5)) | st.just(np.nan)
LABEL = (
    st.text("ABCdef_0123456789 .-ÄÖß", min_size=1, max_size=8)
    .map(str.strip)
    .filter(lambda x: x and x[0].isalpha() and x[-1] not in "_ .-")
)
WRITERS = {
    "TRC": trc,
    "Motive": motive,
    "Nexus": nexus,
    "Qualisys": lambda file: qualisys(file, frame=True, time=True, titles=True),
    "plain": lambda file: plain(file, spell="{label}_{axis}"),
}


@st.composite
def files(draw):
    """Any few markers in any few frames; the first sample is there."""
    labels = draw(st.lists(LABEL, min_size=1, max_size=6, unique=True))
    frames = draw(st.integers(1, 8))
    size = 3 * len(labels) * frames
    values = draw(st.lists(NUMBERS, min_size=size, max_size=size))
    points = np.array(values).reshape(frames, len(labels), 3)
    points[0, 0] = [1.0, 2.0, 3.0]
    points[np.isnan(points).any(axis=2)] = np.nan
    comma = draw(st.booleans())
    sep = draw(st.sampled_from("\t;" if comma else "\t;,"))
    first = draw(st.integers(0, 10**6))
    return Marked(points, tuple(labels), first=first, sep=sep, comma=comma)


@pytest.mark.parametrize("kind", WRITERS)
@settings(deadline=None, max_examples=40)
@given(file=files(), end=st.sampled_from(["\n", "\r\n", "\r"]), packed=st.booleans())
def test_whatever_is_written_is_read(tmp_path_factory, kind, file, end, packed):
    content = WRITERS[kind](file).replace("\n", end).encode()
    path = tmp_path_factory.mktemp("any") / ("any.txt.gz" if packed else "any.txt")
    path.write_bytes(gzip.compress(content) if packed else content)
    raw = read_raw(path)
    np.testing.assert_array_equal(raw.points, file.points)
    assert (raw.labels, raw.first_frame) == (file.labels, file.first)
    # One row has no rate by its time.
    assert raw.rate == pytest.approx(0 if kind == "plain" and len(file.points) == 1 else 100)
