"""The register of result formats: what each is called, which files it makes, what it can be told.

A format is one module in `formats/`: it registers itself when it is imported. Everything here is light, and a
module of a format imports numpy and its libraries inside its functions: the help of the command line is made of
the register.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, TypeVar

from mocap_skel.extras import extra

if TYPE_CHECKING:
    from mocap_skel.clip import Clip
    from mocap_skel.export.files import Content
    from mocap_skel.labels.association import Assignment
    from mocap_skel.rig.quality import Quality
    from mocap_skel.skeleton_fit import SkeletonFit

# The format of a call that names none; it stands first in the help.
DEFAULT = "csv"
_HELP = "option"


@dataclass(frozen=True)
class OptionHelp:
    """What people are told of an option, and how its value is read from a command line.

    Attributes:
        help: a sentence for the help, without the format's name.
        choices: the values that it may have; none = any.
        parse: makes the value of what was typed; its ValueError is shown.
        metavar: what the help shows in place of a value.
        default_text: the default as it is typed, where that is not its `str`; what None means, where that
            is the default.
    """

    help: str
    choices: tuple[str, ...] = ()
    parse: Callable[[str], Any] | None = None
    metavar: str | None = None
    default_text: str | None = None


# Its value has the type of the field, as that of `dataclasses.field`, which types as Any.
def option(default: Any, help: str, **said: Any) -> Any:  # noqa: A002
    """A field of a format's options, with what the command line makes of it.

    A field that is False is a flag. `rotation_order` is `--rotation-order` there. Formats may share an option:
    fields of the same name have the same help.

    Args:
        default: the field's default.
        help: a sentence for the help.
        said: the other attributes of `OptionHelp`.
    """
    return field(default=default, metadata={_HELP: OptionHelp(help, **said)})


@dataclass(frozen=True)
class Options:
    """What a format may be told: the base of every format's own options."""

    def quality(self, fit: SkeletonFit) -> Quality | None:
        """How good the rigid figure in the format's files is; None where there is none in them."""
        del fit
        return None


def vertical(default: str | None) -> Any:
    """The field `up` of a format: the axis that points up in its files, None = as in the clip."""
    said = "Turn the results so that this axis points up."
    return option(default, said, choices=("x", "y", "z"), default_text=default or "as in the clip")


@dataclass(frozen=True)
class Turned(Options):
    """The options of a format whose axes can be turned.

    Attributes:
        up: the vertical axis; None = the clip's.
    """

    up: str | None = vertical(None)


@dataclass(frozen=True, eq=False)
class Source:
    """What a fit was made from, for formats that give more than the fit has.

    Attributes:
        clip: what was fitted.
        path: the clip's file.
        assignment: which marker is which column of the clip; None where the caller does not say.
        decided: what was decided about the file and its labels before the fit, one sentence each.
        command: the call, "" where there was none.
        static: the same subject in a static clip, whose mean pose is neutral for angles; None without one.
        options: gives the version and all options that are no defaults.
    """

    clip: Clip
    path: Path
    assignment: Assignment | None = None
    decided: tuple[str, ...] = ()
    command: str = ""
    static: SkeletonFit | None = None
    options: Callable[[], Mapping[str, Any]] = dict


@dataclass(frozen=True)
class Rendered:
    """A format's files, suffix → content, the main one first, and what there is to say about them."""

    files: Mapping[str, Content]
    notes: tuple[str, ...] = ()


Writer = Callable[["SkeletonFit", Any, Source], Rendered]
W = TypeVar("W", bound=Writer)


@dataclass(frozen=True)
class Format:
    """A result format.

    Attributes:
        name: as `--format` takes it.
        suffixes: of its files, behind the clip's name; the main one first.
        options: the dataclass of what it can be told.
        makes: its files of a clip walk.c3d, for the help: "walk.bvh".
        lacks: what of a fit it cannot hold, one sentence.
        write: renders a fit with options of that class.
        needs: (module, extra) of a library that has to be installed for it; None = nothing.
    """

    name: str
    suffixes: tuple[str, ...]
    options: type[Options]
    makes: str
    lacks: str
    write: Writer
    needs: tuple[str, str] | None = None

    @property
    def told(self) -> dict[str, OptionHelp]:
        """Its options by name."""
        return {f.name: f.metadata[_HELP] for f in fields(self.options)}

    def check_installed(self) -> None:
        """Better missed before the work than after it.

        Raises:
            MissingExtraError: its library is not installed.
        """
        if self.needs:
            extra(*self.needs)


@dataclass(frozen=True)
class Chosen:
    """A format and what it is told."""

    format: Format
    options: Options

    def render(self, fit: SkeletonFit, source: Source) -> Rendered:
        """The contents of the format's files.

        Raises:
            ExportError: the format cannot hold this fit.
        """
        return self.format.write(fit, self.options, source)


_registered: dict[str, Format] = {}


def register(
    name: str,
    *,
    suffixes: tuple[str, ...],
    options: type[Options],
    makes: str,
    lacks: str,
    needs: tuple[str, str] | None = None,
) -> Callable[[W], W]:
    """Register the decorated function as the writer of a format; the arguments are those of `Format`.

    Raises:
        ValueError: there is a format of that name.
    """

    def decorate(write: W) -> W:
        if name in _registered:
            raise ValueError(f"there are two formats {name!r}")
        _registered[name] = Format(name, suffixes, options, makes, lacks, write, needs)
        return write

    return decorate


@cache
def _load() -> None:
    """Import every module of the folder, once."""
    from mocap_skel.export import formats as folder

    for module in iter_modules(folder.__path__):
        import_module(f"{folder.__name__}.{module.name}")


def formats() -> Mapping[str, Format]:
    """Every format by its name: the default first, the others by name.

    >>> list(formats())
    ['csv', 'about', 'angles', 'bvh', 'c3d', 'events', 'glb', 'mot', 'osim', 'parquet', 'sto', 'trc']
    >>> formats()["bvh"].suffixes
    ('.bvh',)
    """
    _load()
    names = sorted(_registered, key=lambda name: (name != DEFAULT, name))
    return {name: _registered[name] for name in names}


def choose(names: str | Iterable[str] = DEFAULT, /, **told: Any) -> tuple[Chosen, ...]:
    """Formats with what they are told; each option goes to the formats that have it.

    Args:
        names: one format, or several; one that is named twice counts once.
        told: options by the names of their fields; None is the same as not told.

    Raises:
        ValueError: no such format, or an option has none of its choices.
        TypeError: an option that none of these formats has.

    >>> c3d, csv = choose(["c3d", "csv"], axes=True)
    >>> c3d.options.axes, hasattr(csv.options, "axes")
    (True, False)
    """
    known = formats()
    has: dict[str, dict[str, OptionHelp]] = {}
    for name in [names] if isinstance(names, str) else names:
        if name not in known:
            raise ValueError(f"formats must be of {tuple(known)}, got {name!r}")
        has[name] = known[name].told
    told = {key: value for key, value in told.items() if _checked(key, value, has) is not None}
    return tuple(
        Chosen(known[name], known[name].options(**{k: v for k, v in told.items() if k in said}))
        for name, said in has.items()
    )


def _checked(key: str, value: Any, has: Mapping[str, Mapping[str, OptionHelp]]) -> Any:
    """The value of an option.

    Raises:
        TypeError: no format has it.
        ValueError: the value is none of its choices.
    """
    owners = [said[key] for said in has.values() if key in said]
    if not owners:
        takes = "; ".join(f"{name} takes {', '.join(said) or 'none'}" for name, said in has.items())
        raise TypeError(f"no option {key!r} here: {takes}")
    choices = owners[0].choices
    if choices and value is not None and value not in choices:
        raise ValueError(f"{key} must be one of {choices}, got {value!r}")
    return value


def told_of(chosen: Iterable[Chosen]) -> dict[str, dict[str, Any]]:
    """What formats are told that is no default: the format's name → option → value.

    >>> told_of(choose(["c3d", "csv"], axes=True))
    {'c3d': {'axes': True}, 'csv': {}}
    """
    return {
        one.format.name: {
            key: value
            for key, value in asdict(one.options).items()
            if value != getattr(type(one.options)(), key)
        }
        for one in chosen
    }


def owners() -> list[tuple[str, dict[str, Format]]]:
    """Every option of all formats with the formats that have it, those of several formats first."""
    has: dict[str, dict[str, Format]] = {}
    for name, one in formats().items():
        for key in one.told:
            has.setdefault(key, {})[name] = one
    return sorted(has.items(), key=lambda item: len(item[1]) == 1)
