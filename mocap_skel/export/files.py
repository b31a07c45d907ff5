"""Result files: whole or not at all, over an existing one only if that is asked for, never over an input."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from tempfile import NamedTemporaryFile

from mocap_skel.errors import OutputError, ours


def safe_name(name: str) -> str:
    """A name from inside a file as a part of a path: no separators, no leading dot, never empty.

    >>> safe_name("../Anna (left)")
    'Anna_left'
    """
    return re.sub(r"[^\w.+-]+", "_", name).strip("._") or "subject"


def check_free(paths: Iterable[Path], overwrite: bool, inputs: Iterable[Path] = ()) -> None:
    """Refuse results that must not be written, before anything is.

    Args:
        paths: the results' files.
        overwrite: whether existing files may be replaced.
        inputs: the files that the call reads. None of them is ever replaced, by whatever path, symbolic or
            hard link or other spelling of its name it is reached.

    Raises:
        OutputError: a file is there already or is an input, a folder has its name, or it cannot be looked at.
    """
    own = {found for path in inputs if (found := _identity(path))}
    for path in paths:
        with ours(path, OutputError):
            if path.is_dir():
                raise OutputError("is a folder")
            if own and _identity(path) in own:
                raise OutputError("is an input of this call", "use another -o")
            if os.path.lexists(path) and not overwrite:
                raise OutputError("exists already", "use --overwrite or another -o")


def _identity(path: Path) -> tuple[int, int] | None:
    """What all names of a file have in common; None where there is none to look at."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def check_folder(folder: Path) -> None:
    """Make a folder for results, and refuse one that cannot be written to before the work, not after it.

    Raises:
        OutputError: it cannot be made, or nothing can be written there.
    """
    with ours(folder, OutputError):
        folder.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=folder, prefix="."):
            pass


def write_all(
    contents: Mapping[Path, str | bytes], overwrite: bool, inputs: Iterable[Path] = ()
) -> None:
    """Write files that belong together: each to a temporary file first, then all are renamed.

    Args:
        contents: file → what is in it, texts in UTF-8.
        overwrite: whether existing files may be replaced.
        inputs: the files that the call reads, which never are.

    Raises:
        OutputError: one exists already, is an input, or cannot be written; then none is there that was not
            before.
    """
    check_free(contents, overwrite, inputs)
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
