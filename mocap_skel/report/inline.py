"""What a page that is one file is made of: escaped text, data, its own style and script, and no others."""

from __future__ import annotations

import base64
import hashlib
import json
import unicodedata
from html import escape
from importlib.resources import files


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


def in_json(value: object) -> str:
    r"""JSON in ASCII without < > &, so that an HTML parser finds no tag in it.

    >>> in_json({"label": "</script>"})
    '{"label":"\\u003c/script\\u003e"}'
    """
    dumped = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return dumped.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def asset(name: str) -> str:
    """The text of a file of `report/page`."""
    return (files("mocap_skel.report") / "page" / name).read_text(encoding="utf-8")


def policy(script: str, style: str) -> str:
    """The content security policy that lets only this script and this style take effect, and nothing load."""
    return (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
        "base-uri 'none'; form-action 'none'"
    )


def _hash(inline: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()}"
