"""The files of pictures: kinds, captions, and texts that come out of a file."""

import pytest

from mocap_skel.report.figures import KINDS, figure, picture, plain, png

STARTS = {"png": b"\x89PNG\r\n\x1a\n", "svg": b"<?xml", "pdf": b"%PDF-"}


@pytest.mark.parametrize("kind", KINDS)
def test_dollars_of_a_file_are_no_formula(kind):
    """matplotlib reads what stands between two of them as one, and fails on this."""
    drawn = figure()
    drawn.suptitle(plain("a $name_ of $5"))
    made = picture(drawn, "mocap-skel draw '$a_$.c3d'", kind)
    assert made.startswith(STARTS[kind]) and len(made) > 1000


def test_the_same_figure_is_the_same_bytes():
    first, second = (png(figure(), "seed 1") for _ in range(2))
    assert first == second != png(figure(), "seed 2")
