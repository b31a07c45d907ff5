"""Result files: named after the clip, whole or not at all, never over an existing one unasked."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from tempfile import NamedTemporaryFile

from mocap_skel.errors import OutputError, ours


def safe_name(name: str) -> str:
    """A name from inside a file as a part of a path: no separators, no leading dot, never empty."""
    return re.sub(r"[^\w.+-]+", "_", name).strip("._") or "subject"


def check_free(paths: list[Path], overwrite: bool) -> None:
    """Refuse before anything is written.

    Raises:
        OutputError: a file is there already, a folder has its name, or it cannot be looked at.
    """
    for path in paths:
        with ours(path, OutputError):
            if path.is_dir():
                raise OutputError("is a folder")
            if os.path.lexists(path) and not overwrite:
                raise OutputError("exists already", "use --overwrite or another -o")


def check_folder(folder: Path) -> None:
    """Make a folder for results, and refuse one that cannot be written to before the work, not after it.

    Raises:
        OutputError: it cannot be made, or nothing can be written there.
    """
    with ours(folder, OutputError):
        folder.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=folder, prefix="."):
            pass


def write_all(contents: Mapping[Path, str | bytes], overwrite: bool) -> None:
    """Write files that belong together: each to a temporary file first, then all are renamed.

    Raises:
        OutputError: one exists already, or cannot be written; then none is there that was not before.
    """
    check_free(list(contents), overwrite)
    new = [path for path in contents if not os.path.lexists(path)]
    done = False
    ready: list[tuple[Path, Path]] = []
    try:
        for path, content in contents.items():
            with ours(path, OutputError):
                path.parent.mkdir(parents=True, exist_ok=True)
                with NamedTemporaryFile(
                    dir=path.parent, prefix=f".{path.name}.", suffix=".part", delete=False
                ) as file:
                    ready.append((Path(file.name), path))
                    file.write(content if isinstance(content, bytes) else content.encode())
        for temporary, path in ready:
            with ours(path, OutputError):
                # A temporary file is private; a result file gets what the user's umask allows.
                temporary.chmod(0o666 & ~_umask())
                temporary.replace(path)
        done = True
    finally:
        for temporary, _ in ready:
            temporary.unlink(missing_ok=True)
        for path in [] if done else new:
            with suppress(OSError):
                path.unlink()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
