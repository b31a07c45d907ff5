"""What all pictures share: colours, size, caption, kinds of files. Needs matplotlib, the extra `plot`."""

from __future__ import annotations

import io
import textwrap
import warnings
from typing import Any

from mocap_skel.extras import extra

# Okabe & Ito's colours, which stay apart for the colour-blind.
COLOURS = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999933",
    "#882255", "#44AA99", "#AA4499", "#332288", "#117733", "#661100",
)  # fmt: skip
MARKS = ("o", "s", "^", "v", "D", "P", "X")
# What a file may be, by its suffix.
KINDS = ("png", "svg", "pdf")
# Types that journals take in a PDF; SVG ids that do not change from run to run.
_SETTINGS = {"pdf.fonttype": 42, "svg.hashsalt": "mocap-skel"}
# A file holds when it was made, unless told not to: the same call gives the same bytes.
_METADATA = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}


def figure(width: float = 9.0, height: float = 6.0) -> Any:
    """An empty figure of a size in inches; matplotlib finds the place of each part.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    return extra("matplotlib.figure", "plot").Figure(figsize=(width, height), layout="constrained")


def png(drawn: Any, caption: str) -> bytes:
    """The bytes of a PNG of a figure, with a caption below it."""
    return picture(drawn, caption, "png", 120)


def picture(drawn: Any, caption: str, kind: str, dpi: int = 200) -> bytes:
    """The bytes of a picture of a figure, with a caption below it.

    Args:
        drawn: the figure.
        caption: what the picture shows, how it was measured, the command.
        kind: one of `KINDS`.
        dpi: pixels an inch, for PNG.
    """
    width = int(13 * drawn.get_size_inches()[0])
    drawn.supxlabel(
        "\n".join(textwrap.wrap(plain(caption), width)), fontsize=8, color="0.3", ha="left", x=0.01
    )
    out = io.BytesIO()
    context = extra("matplotlib", "plot").rc_context(_SETTINGS)
    with context, warnings.catch_warnings():
        # A name in a script that the font does not have is drawn as boxes; there is nothing to do about it.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        drawn.savefig(out, format=kind, dpi=dpi, metadata=_METADATA[kind])
    return out.getvalue()


def plain(text: str) -> str:
    """A text from a file, so that matplotlib reads no formula between its dollar signs."""
    return text.replace("$", r"\$")


def check_figures() -> None:
    """Check that pictures can be drawn, before any work is done.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    extra("matplotlib.figure", "plot")
