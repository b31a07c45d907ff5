"""Result files: whole or not at all, over an existing one only if that is asked for, never over an input."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from tempfile import NamedTemporaryFile

from mocap_skel.errors import OutputError


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
        try:
            folder, there = path.is_dir(), os.path.lexists(path)
        except OSError as error:
            raise OutputError(f"{path}: {error.strerror}") from error
        if folder:
            raise OutputError(f"{path}: is a folder")
        if own and _identity(path) in own:
            raise OutputError(f"{path}: is an input of this call", "use another -o")
        if there and not overwrite:
            raise OutputError(f"{path}: exists already", "use --overwrite or another -o")


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
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=folder, prefix="."):
            pass
    except OSError as error:
        raise OutputError(f"{error.filename or folder}: {error.strerror}") from error


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
            path.parent.mkdir(parents=True, exist_ok=True)
            with NamedTemporaryFile(
                dir=path.parent, prefix=f".{path.name}.", suffix=".part", delete=False
            ) as file:
                ready.append((Path(file.name), path))
                file.write(content if isinstance(content, bytes) else content.encode())
        for temporary, path in ready:
            # A temporary file is private; a result file gets what the user's umask allows.
            temporary.chmod(0o666 & ~_umask())
            temporary.replace(path)
        done = True
    except OSError as error:
        raise OutputError(f"{error.filename or path}: {error.strerror}") from error
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
