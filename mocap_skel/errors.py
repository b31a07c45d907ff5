"""Everything that this project raises on purpose derives from one root, so that one door can show it."""

from __future__ import annotations


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


class CallError(MocapSkelError):
    """The call itself has to change: an option, an association file or a skeleton file."""


class AssociationError(CallError):
    """An association file that cannot be read."""


class SkeletonError(CallError):
    """A skeleton file that cannot be read, or whose tree does not hold together."""


class OutputError(CallError):
    """A result file that exists already or cannot be written."""


class MissingExtraError(CallError):
    """A library of an optional extra that is not installed."""


class ClipError(MocapSkelError):
    """A recording that cannot be read, or that holds nothing to fit."""


class FitError(MocapSkelError):
    """A clip to which no skeleton can be fitted."""


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
