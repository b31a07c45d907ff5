"""Text and JSON that no HTML parser takes for markup, whatever a file calls its markers."""

from __future__ import annotations

import json
import unicodedata
from html import escape


def text(value: object) -> str:
    """Any value as text that is safe in HTML, between tags or in an attribute.

    Control characters, halves of surrogate pairs and the marks that turn the direction of writing round
    could make a label look like what it is not: each of them becomes �.

    >>> text("<b> & \u202e")
    '&lt;b&gt; &amp; �'
    """
    return escape("".join(_plain(c) for c in str(value)))


def _plain(c: str) -> str:
    return "\ufffd" if unicodedata.category(c) in ("Cc", "Cf", "Cs") else c


def safe_json(value: object) -> str:
    """JSON in ASCII without < > &, so that an HTML parser finds no tag in it."""
    dumped = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return dumped.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
