"""Figures as PNG: what every one of them shares. Needs matplotlib, the extra `plot`."""

from __future__ import annotations

import io
import textwrap
from typing import Any

from mocap_skel.extras import extra

# Okabe & Ito's colours, which stay apart for the colour-blind.
COLOURS = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999933",
    "#882255", "#44AA99", "#AA4499", "#332288", "#117733", "#661100",
)  # fmt: skip
MARKS = ("o", "s", "^", "v", "D", "P", "X")


def figure(width: float = 9.0, height: float = 6.0) -> Any:
    """An empty figure of a size in inches, laid out by itself.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    return extra("matplotlib.figure", "plot").Figure(figsize=(width, height), layout="constrained")


def png(drawn: Any, caption: str) -> bytes:
    """A figure as PNG with a caption under it: what was measured, the seed, the command."""
    width = int(13 * drawn.get_size_inches()[0])
    drawn.supxlabel(
        "\n".join(textwrap.wrap(caption, width)), fontsize=8, color="0.3", ha="left", x=0.01
    )
    out = io.BytesIO()
    drawn.savefig(out, format="png", dpi=120, metadata={"Software": None})
    return out.getvalue()


def check_figures() -> None:
    """Refuse before any work is done.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    extra("matplotlib.figure", "plot")
