"""The options of a call in a TOML file: what the command line does not say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from mocap_skel.errors import CallError, ours
from mocap_skel.text import nearest, parse_toml, read_text


def read_job(path: Path, command: click.Command) -> dict[str, Any]:
    """Read the file.

    Args:
        path: a table of options under their long names: `sigma = "1mm"`, `format = ["csv", "bvh"]`, `salvage = true`.
        command: whose options they are. Values mean what they mean on its command line.

    Returns:
        Parameter → value, as click takes it for its defaults.

    Raises:
        CallError: it cannot be read, or has what is no option.
    """
    content = parse_toml(path, read_text(path, CallError), CallError)
    with ours(path, CallError):
        known = _options(command)
        found: dict[str, Any] = {}
        for key, value in content.items():
            option = known.get(key.replace("_", "-"))
            if option is None:
                raise CallError(f"{key} is no option of {command.name}", nearest(key, known))
            assert option.name is not None
            found[option.name] = _value(key, value, option)
        return found


def _options(command: click.Command) -> dict[str, click.Option]:
    """Long name → option, of those that may stand in a file."""
    return {
        name.removeprefix("--"): option
        for option in command.params
        if isinstance(option, click.Option) and option.expose_value
        for name in option.opts
        if name.startswith("--")
    }


def _value(key: str, value: Any, option: click.Option) -> Any:
    if option.is_flag:
        if not isinstance(value, bool):
            raise CallError(f"{key} is true or false")
        return value
    words = value if isinstance(value, list) else [value]
    if any(isinstance(word, (bool, dict, list)) for word in words):
        raise CallError(f"{key} takes no value of this kind")
    if option.multiple:
        return [str(word) for word in words]
    if isinstance(value, list):
        raise CallError(f"{key} takes one value")
    return str(value)
