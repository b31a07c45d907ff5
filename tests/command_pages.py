"""docs/commands: a page for every command, made from what `--help` says. Run as a program it writes them."""

import inspect
import sys
from pathlib import Path

import click

from mocap_skel.cli import group

PAGES = Path(__file__).parents[1] / "docs" / "commands"


def pages():
    """File name → page, of every command."""
    context = click.Context(group, info_name="mocap-skel")
    found = {}
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        found[f"{name}.md"] = "\n".join([*page(command, f"mocap-skel {name}", "#"), ""])
    return found


def page(command, called, level):
    """The lines of a command, those under it below."""
    yield f"{level} {called}"
    yield ""
    arguments = [p for p in command.params if isinstance(p, click.Argument)]
    words = [called, "[OPTIONS]", *(p.metavar or p.name.upper() for p in arguments)]
    if isinstance(command, click.Group):
        words = [called, "COMMAND", "..."]
    yield f"    {' '.join(words)}"
    yield ""
    yield inspect.cleandoc(command.help or "")
    yield ""
    options = [p for p in command.params if isinstance(p, click.Option)]
    if options:
        yield "| option | what | default |"
        yield "|---|---|---|"
        for option in options:
            yield f"| {names(option)} | {cell(option.help)} | {cell(default(option))} |"
        yield ""
    if command.epilog and not isinstance(command, click.Group):
        yield f"{command.epilog.partition(': ')[0]}:"
        yield ""
        yield f"    {command.epilog.partition(': ')[2]}"
    if isinstance(command, click.Group):
        context = click.Context(command, info_name=called)
        for i, name in enumerate(command.list_commands(context)):
            if i:
                yield ""
            yield from page(command.get_command(context, name), f"{called} {name}", level + "#")


def names(option):
    """An option as it is typed."""
    value = "" if option.is_flag else f" {metavar(option)}"
    written = ", ".join(sorted(option.opts, key=len)) + "".join(
        f" / {name}" for name in option.secondary_opts
    )
    return f"`{written}{value}`".replace("|", "\\|")


def metavar(option):
    choices = getattr(option.type, "choices", None)
    if option.metavar or not choices:
        return option.metavar or option.type.name.split()[0].upper()
    return "|".join(choices)


def default(option):
    if isinstance(option.show_default, str):
        return option.show_default
    if not option.show_default or option.default is None:
        return ""
    if option.secondary_opts:
        return (option.opts if option.default else option.secondary_opts)[0].lstrip("-")
    value = option.default
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def cell(text):
    return (text or "").replace("|", "\\|")


def main():
    PAGES.mkdir(exist_ok=True)
    for old in PAGES.glob("*.md"):
        old.unlink()
    for name, text in pages().items():
        (PAGES / name).write_text(text)
        print(PAGES / name)


if __name__ == "__main__":
    sys.exit(main())
