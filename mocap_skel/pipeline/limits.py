"""How much memory a clip may take, and what is said where it takes more."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mocap_skel.errors import ClipError

GIGABYTE = 1 << 30
MEMORY, MEMORY_PER_BYTE = 2 * GIGABYTE, 20.0
"""Bytes for any clip, and for each byte of its file: a long clip honestly needs more than a short one."""

# What the loader says where the limit is in its way.
_NO_ROOM = ("failed to map segment", "cannot allocate memory", "Cannot allocate memory")


def bytes_of(path: Path) -> int:
    """Bytes of a file, 0 where there is none."""
    try:
        return path.stat().st_size
    except OSError:
        return 0


def memory_for(path: Path) -> int:
    """Bytes that the work on a clip may take."""
    return max(MEMORY, int(MEMORY_PER_BYTE * bytes_of(path)))


@contextmanager
def limited(path: Path) -> Iterator[None]:
    """Let this process take no more memory than a clip may, where the system can see to it.

    Args:
        path: the clip.

    Raises:
        ClipError: it needs more.
    """
    memory = memory_for(path)
    before = limit(memory)
    try:
        yield
    except Exception as error:
        # Room first: there may be none left for the message.
        restore(before)
        if starved(error):
            raise ClipError(f"{path}: {too_much(memory)}") from None
        raise
    finally:
        restore(before)


def starved(error: BaseException) -> bool:
    """Whether an error is want of memory, which has many names."""
    if isinstance(error, OSError):
        return error.errno == errno.ENOMEM
    # A library in C that finds no room to be loaded.
    loading = isinstance(error, ImportError) and any(why in str(error) for why in _NO_ROOM)
    return loading or isinstance(error, MemoryError)


def too_much(memory: int) -> str:
    """What is said of work that needs more than so many bytes."""
    return f"needs more than {memory / GIGABYTE:.3g} GB of memory"


def used_memory() -> tuple[int, int]:
    """Bytes that this process has reserved and that it uses; zeros where the system does not say."""
    statistics = Path("/proc/self/statm")
    if sys.platform == "win32" or not statistics.exists():
        return 0, 0
    import resource

    reserved, used = (int(n) * resource.getpagesize() for n in statistics.read_text().split()[:2])
    return reserved, used


def used_seconds(process: int) -> float | None:
    """Seconds for which a process has had a core, all its threads together; None where the system does not say."""
    try:
        # The name, in brackets, may hold anything.
        words = Path(f"/proc/{process}/stat").read_bytes().rpartition(b")")[2].split()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, ValueError):
        return None


def limit(memory: int) -> tuple[int, int] | None:
    """Let this process use so many bytes, where the system can see to it.

    Returns:
        The limits of before; None where nothing was changed.
    """
    reserved, used = used_memory()
    if sys.platform == "win32" or not used:
        return None
    import resource

    # Address space is what can be limited, and BLAS reserves much more than it uses.
    before = resource.getrlimit(resource.RLIMIT_AS)
    wanted = reserved + max(0, memory - used)
    # What the user allows, by `ulimit` say, is never made more.
    wanted = min([wanted, *(bound for bound in before if bound != resource.RLIM_INFINITY)])
    resource.setrlimit(resource.RLIMIT_AS, (wanted, before[1]))
    return before


def restore(before: tuple[int, int] | None) -> None:
    """Take a limit back.

    Args:
        before: what `limit` gave.
    """
    if before is None or sys.platform == "win32":
        return
    import resource

    resource.setrlimit(resource.RLIMIT_AS, before)
