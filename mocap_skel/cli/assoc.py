"""mocap-skel assoc: the commands about association files."""

from __future__ import annotations

from importlib import import_module

import click

# Subcommand → where in this package it is, and its line in the help: help loads no subcommand.
SUBCOMMANDS = {
    "guess": (
        "assoc_guess:guess",
        "Write an association file for a clip of an unknown marker set.",
    ),
    "list": ("assoc_show:list_", "List the shipped association files."),
    "show": ("assoc_show:show", "Print an association file."),
    "check": (
        "assoc_check:command",
        "Check whether each marker of a clip moves with its segment.",
    ),
    "page": (
        "assoc_page:command",
        "Make an HTML page on which to see and correct which marker is which.",
    ),
    "standard": ("assoc_show:standard", "Print the standard markers: the thesis's Table 1."),
}


class _Subcommands(click.Group):
    """Loads a subcommand's module on its first use."""

    # click hands every method its context, needed or not.
    # ruff: noqa: ARG002

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(SUBCOMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in SUBCOMMANDS:
            return None
        module, _, name = SUBCOMMANDS[cmd_name][0].partition(":")
        found: click.Command = getattr(import_module(f"mocap_skel.cli.{module}"), name)
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in SUBCOMMANDS.items()])


@click.group(
    "assoc", cls=_Subcommands, epilog="Example: mocap-skel assoc guess walk.c3d -o lab.txt"
)
def command() -> None:
    """Association files: which label of a clip is which marker of which segment."""
