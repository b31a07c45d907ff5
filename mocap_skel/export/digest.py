"""The hash by which a clip's file is known again."""

from __future__ import annotations

from hashlib import file_digest
from pathlib import Path

from mocap_skel.errors import ClipError, ours
from mocap_skel.text import check_file


def digest_of(path: Path) -> str:
    """SHA-256 of a file, as `sha256sum` prints it.

    Raises:
        ClipError: it cannot be read.
    """
    check_file(path, ClipError)
    with ours(path, ClipError), path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
