"""Result files: whole or not at all, over an existing one only if that is asked for, never over an input."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryFile, mkdtemp, mkstemp

from mocap_skel.errors import ExistsError, OutputError, ours
from mocap_skel.export.interrupts import interrupts_held


@dataclass(frozen=True, eq=False)
class Pieces:
    """A text that is made as it is written: the whole of it may be as large as the clip.

    Attributes:
        make: gives its pieces, each time anew.

    >>> str(Pieces(lambda: (f"{n} " for n in range(3))))
    '0 1 2 '
    """

    make: Callable[[], Iterable[str]]

    def __str__(self) -> str:
        return "".join(self.make())


Content = str | bytes | Pieces
"""What is in a file; texts are written as UTF-8."""


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
    own = {found for path in inputs if (found := identity(path))}
    for path in paths:
        with ours(path, OutputError):
            if path.is_dir():
                raise OutputError("is a folder")
            if own and identity(path) in own:
                raise OutputError("is an input of this call", "use another -o")
            if os.path.lexists(path) and not overwrite:
                raise ExistsError("exists already", "use --overwrite or another -o")


def identity(path: Path) -> tuple[int, int] | None:
    """What all names of a file have in common: device and number. None where there is none to look at."""
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
        try:
            with TemporaryFile(dir=folder):
                pass
        except OSError as error:
            # The system names a file that nobody knows.
            raise OutputError(str(error.strerror)) from error


def write_all(
    contents: Mapping[Path, Content], overwrite: bool, inputs: Iterable[Path] = ()
) -> None:
    """Write files that belong together: each to a temporary file first, then all are put into their places.

    Args:
        contents: file → what is in it.
        overwrite: whether existing files may be replaced.
        inputs: the files that the call reads, which never are.

    Raises:
        OutputError: one exists already, is an input, or cannot be written; then none is there that was not
            before.
    """
    inputs = tuple(inputs)
    check_free(contents, overwrite, inputs)
    parts: dict[Path, Path] = {}
    with interrupts_held():
        try:
            for path, content in contents.items():
                with ours(path, OutputError), _without_name():
                    path.parent.mkdir(parents=True, exist_ok=True)
                    # A name of its own: the result's may be as long as a name can be.
                    number, name = mkstemp(dir=path.parent, prefix=".mocap-skel-", suffix=".part")
                    parts[path] = Path(name)
                    with os.fdopen(number, "wb") as file:
                        file.writelines(_parts(content))
                    # A temporary file is private; a result file gets what the user's umask allows.
                    parts[path].chmod(0o666 & ~_umask())
            put_all(parts, overwrite, inputs)
        finally:
            for part in parts.values():
                with suppress(OSError):
                    part.unlink()


@contextmanager
def _without_name() -> Iterator[None]:
    """Errors of the system about a temporary file, without its name."""
    try:
        yield
    except OSError as error:
        error.filename = None
        raise


def stage_all(contents: Mapping[Path, Content], folder: Path) -> dict[Path, Path]:
    """Write files that belong together into a folder of the same disk, where they wait for `put_all`.

    Args:
        contents: file → what is in it.
        folder: made by `staging`; the files get a folder of their own in it.

    Returns:
        File → where its content waits.

    Raises:
        OutputError: one cannot be written.
    """
    parts: dict[Path, Path] = {}
    with ours(folder, OutputError), _without_name():
        own = Path(mkdtemp(dir=folder))
    for number, (path, content) in enumerate(contents.items()):
        parts[path] = own / str(number)
        with ours(path, OutputError), _without_name(), parts[path].open("wb") as file:
            file.writelines(_parts(content))
    return parts


def put_all(parts: Mapping[Path, Path], overwrite: bool, inputs: Iterable[Path] = ()) -> None:
    """Put files that were written elsewhere on the same disk into their places, all or none.

    Args:
        parts: file → where its content waits.
        overwrite: whether existing files may be replaced.
        inputs: the files that the call reads, which never are.

    Raises:
        OutputError: one exists already, is an input, or cannot be written; then none is there that was not
            before.
    """
    check_free(parts, overwrite, inputs)
    put: list[Path] = []
    done = False
    with interrupts_held():
        try:
            for path, part in parts.items():
                with ours(path, OutputError), _without_name():
                    path.parent.mkdir(parents=True, exist_ok=True)
                    new = not overwrite or not os.path.lexists(path)
                    if overwrite:
                        part.replace(path)
                    else:
                        _put_new(part, path)
                    put += [path] if new else []
            done = True
        finally:
            for path in [] if done else put:
                with suppress(OSError):
                    path.unlink()


def _put_new(part: Path, path: Path) -> None:
    """Give a file its name, which no other process can have taken in between.

    Raises:
        ExistsError: there is one of that name.
    """
    try:
        try:
            os.link(part, path)
        except FileExistsError:
            raise
        except OSError:
            # A disk without links: an empty file keeps the place.
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
            try:
                part.replace(path)
            except BaseException:
                path.unlink()
                raise
        else:
            part.unlink()
    except FileExistsError:
        raise ExistsError("exists already", "use --overwrite or another -o") from None


@contextmanager
def staging(folder: Path, prefix: str = ".mocap-skel-") -> Iterator[Path]:
    """A new folder in another, for `stage_all`; it goes away at the end, and the other one too if it was made for it.

    Raises:
        OutputError: it cannot be made, or nothing can be written there.
    """
    made: list[Path] = []
    stage: Path | None = None
    try:
        with interrupts_held():
            made = [place for place in (folder, *folder.parents) if not place.exists()]
            check_folder(folder)
            with ours(folder, OutputError), _without_name():
                stage = Path(mkdtemp(dir=folder, prefix=prefix))
        yield stage
    finally:
        with interrupts_held():
            if stage is not None:
                # Where no file can be opened any more, a folder without files still goes away.
                with suppress(OSError):
                    stage.rmdir()
                rmtree(stage, ignore_errors=True)
            for place in made:
                # What holds results stays.
                with suppress(OSError):
                    place.rmdir()


def _parts(content: Content) -> Iterator[bytes]:
    if isinstance(content, bytes):
        yield content
        return
    # Names of files need not be text, and what is written is.
    for piece in content.make() if isinstance(content, Pieces) else [content]:
        yield piece.encode("utf-8", "backslashreplace")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
