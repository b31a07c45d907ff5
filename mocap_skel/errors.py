"""The project's own errors, and the one place where errors of the system and of libraries become such.

Everything that is raised on purpose derives from one root, so that the command line can show it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self


class MocapSkelError(Exception):
    """A problem that the user can act on: one readable message, and a hint on what to do.

    Attributes:
        message: what is wrong, one line.
        hint: what to do about it; None where there is nothing to say.

    Example:
        >>> from mocap_skel import MocapSkelError, read_association
        >>> try:
        ...     read_association("cmo")
        ... except MocapSkelError as error:
        ...     print(error.message, error.hint, sep="; ")
        cmo: no such association file; did you mean cmu?
    """

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def named(self, place: str | Path) -> Self:
        """The same error, its message beginning with the place; one that does already stays as it is.

        >>> ClipError("no points in it").named("walk.c3d").named("walk.c3d").message
        'walk.c3d: no points in it'
        """
        if not self.message.startswith(f"{place}:"):
            self.message = f"{place}: {self.message}"
            self.args = (self.message,)
        return self


class CallError(MocapSkelError):
    """The call itself has to change: an option, an association file or a skeleton file."""


class AssociationError(CallError):
    """An association file that cannot be read."""


class SkeletonError(CallError):
    """A skeleton file that cannot be read, or whose tree does not hold together."""


class OutputError(CallError):
    """A result file that exists already or cannot be written."""


class ExistsError(OutputError):
    """A result file that exists already, and that the call does not allow to replace."""


class MissingExtraError(CallError):
    """A library of an optional extra that is not installed."""


class ClipError(MocapSkelError):
    """A recording that cannot be read, or that holds nothing to fit."""


class FitError(MocapSkelError):
    """A clip to which no skeleton can be fitted."""


class LabelError(CallError):
    """Markers that are certainly not where the labels have them, so that nothing true can be fitted."""


class RootError(FitError):
    """Too few markers of the figure's root are seen, so that no segment has a place.

    Attributes:
        seen: the segments that are seen, and that could be a root.
    """

    def __init__(self, message: str, hint: str | None = None, seen: tuple[str, ...] = ()) -> None:
        super().__init__(message, hint)
        self.seen = seen


class ExportError(MocapSkelError):
    """A fit that the chosen format cannot hold."""


Told = Callable[[Any], tuple[str, str | None]]
"""From a foreign error to our message and hint, without the file's name."""

# What may happen to any file that is opened, and to any that should be text.
_ALWAYS: dict[type[Exception], Told] = {
    OSError: lambda error: (error.strerror or str(error), None),
    UnicodeDecodeError: lambda error: (
        f"not a text file in UTF-8 (byte {error.start})",
        "save it as UTF-8",
    ),
    UnicodeEncodeError: lambda error: (
        f"the system's encoding, {error.encoding}, has no {error.object[error.start : error.end]!r}",
        "set a locale of UTF-8: LC_ALL=C.UTF-8",
    ),
}


@contextmanager
def ours(
    place: str | Path | None,
    kind: type[MocapSkelError],
    foreign: Mapping[type[Exception], Told] | None = None,
) -> Iterator[None]:
    """Turn foreign errors into ours, and put the file's name in front of ours that have none.

    Args:
        place: the file, or a place in it; None leaves messages without a name. Where the system names a
            file itself, that one is named.
        kind: what foreign errors become. Of our own errors those of this kind get the name.
        foreign: types of errors and what to say of each, beside and before those of the system and of
            text that is not UTF-8.

    Raises:
        MocapSkelError: of the kind.

    >>> with ours("walk.c3d", ClipError):
    ...     raise ClipError("no points in it")
    Traceback (most recent call last):
    mocap_skel.errors.ClipError: walk.c3d: no points in it
    """
    table = (*(foreign or {}).items(), *_ALWAYS.items())
    try:
        yield
    except kind as error:
        if place is not None:
            error.named(place)
        raise
    except tuple(known for known, _ in table) as error:
        told = next(told for known, told in table if isinstance(error, known))
        raised = kind(*told(error))
        if place is not None:
            raised.named(getattr(error, "filename", None) or place)
        raise raised from error


def reason(error: BaseException) -> str:
    """What a foreign error says, on one line; its type's name where it says nothing."""
    return " ".join(str(error).split()) or type(error).__name__


def refusals(kinds: tuple[type[Exception], ...], what: str) -> dict[type[Exception], Told]:
    """A table for `ours`: each of these errors is told as `what`, followed by its reason."""
    return dict.fromkeys(kinds, lambda error: (f"{what}: {reason(error)}", None))
