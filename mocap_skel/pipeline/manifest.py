"""What a batch has done, clip by clip: a file of JSON lines, written as it goes, that tells the next call what is finished."""

from __future__ import annotations

import json
import os
import stat
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any, Self

from mocap_skel.errors import CallError, OutputError, ours

NAME = "manifest.jsonl"
# What became of a clip: all, a part of it (a subject or a format failed), nothing; and that files of it may be there
# of which no line tells, because the program was ended while it put them into their places.
DONE, PARTLY, FAILED, BROKEN = "done", "partly", "failed", "broken"
WITH_RESULTS = (DONE, PARTLY)


@dataclass(frozen=True)
class Finished:
    """A clip whose results are there, as the manifest has it.

    Attributes:
        status: `DONE` or `PARTLY`.
        sha256: of the clip's file.
        options: with which it was fitted.
        reason: why a part of it failed, None where none did.
        files: result file, from the manifest's folder on → bytes.
    """

    status: str
    sha256: str
    options: Mapping[str, Any]
    reason: str | None
    files: Mapping[str, int]


class Manifest:
    """The manifest of a folder of results, open for one process at a time.

    A clip's last line holds. Memory does not grow with what the lines say, only with the number of clips.
    """

    def __init__(self, folder: Path) -> None:
        """Open it, or make it.

        Raises:
            CallError: another process has it open, or it is no manifest.
            OutputError: it cannot be read or written.
        """
        self.folder, self.path = folder, folder / NAME
        # Where the last line of each clip begins, and the last one of results.
        self._last: dict[str, int] = {}
        self._done: dict[str, int] = {}
        self._finished: dict[str, Finished] = {}
        with ours(self.path, OutputError):
            # In appending, what others may have written in between is not written over.
            flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
            self._file = os.open(self.path, flags, 0o666)
        try:
            if not stat.S_ISREG(os.fstat(self._file).st_mode):
                raise CallError(f"{self.path}: a pipe or a device is no manifest", "use another -o")
            _lock(self._file, self.path)
            with ours(self.path, OutputError):
                self._scan()
        except BaseException:
            os.close(self._file)
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if not self._last:
            # Nothing has come of the call.
            with suppress(OSError):
                self.path.unlink()
                self.folder.rmdir()
        os.close(self._file)

    def __len__(self) -> int:
        """How many clips it knows."""
        return len(self._last)

    def finished(self, name: str) -> Finished | None:
        """What is known of a clip's results, None where there are none."""
        return self._finished.get(name)

    def known(self) -> Iterator[Finished]:
        """What is known of all results."""
        return iter(self._finished.values())

    def append(self, line: Mapping[str, Any]) -> None:
        """Add a line about a clip, whole or not at all.

        Raises:
            OutputError: it cannot be written, or the file is no longer there.
        """
        self._write(json.dumps(line, allow_nan=False).encode() + b"\n", line)

    def renew(self, name: str) -> None:
        """Let what is known of a clip's results be its last line, where a later one tells of a failure."""
        if self._last[name] != self._done[name]:
            text = self._text(self._done[name])
            self._write(text, json.loads(text))

    def lines(self) -> Iterator[dict[str, Any]]:
        """The last line of every clip, in the order of their first ones."""
        with ours(self.path, OutputError), self.path.open("rb") as file:
            for offset in self._last.values():
                file.seek(offset)
                line: dict[str, Any] = json.loads(file.readline())
                yield line

    def _text(self, offset: int) -> bytes:
        with ours(self.path, OutputError), self.path.open("rb") as file:
            file.seek(offset)
            return file.readline()

    def _write(self, text: bytes, line: Mapping[str, Any]) -> None:
        with ours(self.path, OutputError):
            if not self.path.exists():
                raise OutputError("it has gone, or its folder has")
            end = os.fstat(self._file).st_size
            try:
                written = 0
                while written < len(text):
                    written += os.write(self._file, text[written:])
            except BaseException:
                os.ftruncate(self._file, end)
                raise
        self._note(line, end)

    def _scan(self) -> None:
        with self.path.open("rb") as file:
            start = 0
            for number, text in enumerate(file, 1):
                if not text.endswith(b"\n"):
                    # The program was ended while it wrote this line.
                    os.ftruncate(self._file, start)
                    return
                try:
                    line = json.loads(text)
                    check_line(line)
                    self._note(line, start)
                except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
                    raise CallError(
                        f"{self.path}:{number}: no line of a batch",
                        "use another -o, or move that file away",
                    ) from None
                start += len(text)

    def _note(self, line: Mapping[str, Any], offset: int) -> None:
        name, status = line["name"], line["status"]
        if status in WITH_RESULTS:
            self._finished[name] = Finished(
                status, line["sha256"], line["options"], line["reason"], line["files"]
            )
            self._done[name] = offset
        elif status == BROKEN:
            self._finished.pop(name, None)
        self._last[name] = offset


_TEXTS = ("clip", "name", "status", "sha256")


def check_line(line: Any) -> None:
    """Refuse what no batch has written, before it is believed: a manifest may come from anywhere.

    Raises:
        ValueError, TypeError, KeyError, AttributeError: a key is not there, or a value is none that it can have.
    """
    wrong = [key for key in _TEXTS if not isinstance(line[key], str)]
    if wrong or line["status"] not in (DONE, PARTLY, FAILED, BROKEN):
        raise ValueError(line)
    if not (line["reason"] is None or isinstance(line["reason"], str)):
        raise ValueError(line)
    if not (isinstance(line["notes"], list) and all(isinstance(n, str) for n in line["notes"])):
        raise ValueError(line)
    if not _is_number(line["seconds"]) or not isinstance(line["options"]["version"], str):
        raise ValueError(line)
    if not all(isinstance(told, dict) for told in line["options"]["formats"].values()):
        raise ValueError(line)
    check_names(line["files"])
    if not all(type(size) is int for size in line["files"].values()):
        raise ValueError(line)
    for row in line["joints"]:
        if not (isinstance(row["subject"], str) and isinstance(row["joint"], str)):
            raise ValueError(line)
        if row["shown"] not in ("yes", "weak", "no"):
            raise ValueError(line)
        if not all(row[key] is None or _is_number(row[key]) for key in ("x", "y", "z", "bone")):
            raise ValueError(line)


def check_names(names: Iterable[str]) -> None:
    """Refuse names of result files that do not lie below the folder of the results.

    Raises:
        ValueError, TypeError: one is none.

    >>> check_names(["anna/walk.joints.csv"])
    >>> check_names(["../walk.joints.csv"])
    Traceback (most recent call last):
    ValueError: ../walk.joints.csv
    """
    for name in names:
        path = PurePath(name)
        if path.is_absolute() or path.drive or ".." in path.parts or "\0" in name:
            raise ValueError(name)


def _is_number(value: Any) -> bool:
    # A number of 400 digits is one, too, and nothing that can be calculated with.
    return type(value) in (int, float) and abs(value) < 1e300


def _lock(file: int, path: Path) -> None:
    """Keep other processes from the file; the system lets go when this one ends, however it ends.

    Raises:
        CallError: another process has it.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(file, 0, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise CallError(
            f"{path}: another batch is writing there", "wait for its end, or use another -o"
        ) from None
    except OSError:
        pass  # a disk that knows no locks: the user's word is all there is
