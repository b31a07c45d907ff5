"""Files packed with gzip: whatever is inside, read as if it lay there unpacked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from mocap_skel.errors import CallError, ClipError, reason
from mocap_skel.readers.raw import RawClip
from mocap_skel.readers.registry import read_raw, register

_PART = 1 << 20
_GZIP = b"\x1f\x8b"


@register(
    "gzip",
    suffixes=(".gz",),
    sniff=lambda head: head.startswith(_GZIP),
    salvages=True,
)
def read(path: Path, salvage: bool = False) -> RawClip:
    """Read a packed file.

    Args:
        path: the file, named after what is inside: walk.trc.gz.
        salvage: read what is left of a damaged one inside.

    Raises:
        ClipError: it is damaged, too large, or what is inside cannot be read; the message does not name the file.
        OSError: it cannot be opened.
    """
    import gzip
    import zlib
    from tempfile import TemporaryDirectory

    from mocap_skel.readers.tables.source import LARGEST

    with TemporaryDirectory(prefix="mocap-skel-") as folder:
        inside = Path(folder) / (path.stem if path.suffix.lower() == ".gz" else path.name)
        damage = ""
        with gzip.open(path) as packed, inside.open("wb") as file:
            try:
                while part := packed.read1(_PART):
                    if file.tell() + len(part) > LARGEST:
                        raise ClipError(f"more than {LARGEST >> 20} MB when it is unpacked")
                    file.write(part)
            except (EOFError, zlib.error, gzip.BadGzipFile) as error:
                damage = f"a damaged gzip file: {reason(error)}"
                if not salvage or not file.tell():
                    hint = "--salvage reads what can be unpacked" if file.tell() else None
                    raise ClipError(damage, hint) from error
        with inside.open("rb") as file:
            # There are files that hold themselves.
            if file.read(len(_GZIP)) == _GZIP:
                raise ClipError("packed twice", "unpack it once")
        try:
            raw = read_raw(inside, salvage)
            return replace(raw, notes=(damage, *raw.notes)) if damage else raw
        except CallError as error:
            # The name of a temporary file tells nobody anything.
            message = error.message.removeprefix(f"{inside}: ")
            raise ClipError(f"inside: {message}", error.hint) from error
