"""What the registered formats can be told, as options of the command line."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import fields
from typing import Any, TypeVar

import click

from mocap_skel.cli.options import Capitals
from mocap_skel.export.registry import Format, OptionHelp, formats, owners

F = TypeVar("F", bound=Callable[..., Any])


class Parsed(click.ParamType):  # type: ignore[type-arg]  # generic from click 8.2 on only
    """A value that a format reads by a function of its own."""

    def __init__(self, name: str, parse: Callable[[str], Any]) -> None:
        self.name, self._parse = name, parse

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            return self._parse(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


def all_options(command: F) -> F:
    """Every option of every format, those of several formats first; the help says whose the others are."""
    for name, has in reversed(owners()):
        command = _option(name, has)(command)
    return command


def told_of(values: Mapping[str, Any], chosen: Collection[str]) -> dict[str, Any]:
    """What was said of options that one of these formats has; what is said of others has no effect."""
    return {name: values[name] for name, has in owners() if not has.keys().isdisjoint(chosen)}


def names() -> frozenset[str]:
    """The parameters of all these options."""
    return frozenset(name for name, _ in owners())


def _option(name: str, has: Mapping[str, Format]) -> Callable[[F], F]:
    said = next(iter(has.values())).told[name]
    flag = f"--{name.replace('_', '-')}"
    # Who has an option is worth a word where most formats do not have it.
    whose = f"{', '.join(has)}: " if 2 * len(has) < len(formats()) else ""
    text, default = _default(name, has)
    if default is False:
        return click.option(flag, name, is_flag=True, help=whose + said.help)
    return click.option(
        flag, name, type=_type(name, said), metavar=said.metavar, help=whose + said.help,
        default=None if default is None else text, show_default=text if default is None else True,
    )  # fmt: skip


def _default(name: str, has: Mapping[str, Format]) -> tuple[str, Any]:
    """The default in words, and its value; None where each format has its own, or what it means is said."""
    own: dict[str, list[str]] = {}
    values = {}
    for owner, one in has.items():
        values[owner] = next(f.default for f in fields(one.options) if f.name == name)
        own.setdefault(one.told[name].default_text or str(values[owner]), []).append(owner)
    (first, _), *others = own.items()
    text = "; ".join([first, *(f"{other} for {' and '.join(whose)}" for other, whose in others)])
    return text, None if others else next(iter(values.values()))


def _type(name: str, said: OptionHelp) -> Any:
    if said.parse:
        return Parsed(name, said.parse)
    if not said.choices:
        return str
    capitals = all(choice.isupper() for choice in said.choices)
    return Capitals(said.choices) if capitals else click.Choice(said.choices)
