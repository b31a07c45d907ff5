"""mocap-skel assoc list, show, standard: what association files there are and what they may say."""

from __future__ import annotations

import json
import shutil
import textwrap

import click

from mocap_skel.cli import options, say


@click.command("list", epilog="Example: mocap-skel assoc list")
@options.as_json
def list_(as_json: bool) -> int:
    """List the shipped association files: their names, for --assoc, and what they are for."""
    from mocap_skel.labels.guess.catalogue import shipped_associations

    found = shipped_associations()
    if as_json:
        for name, what in found.items():
            say(json.dumps({"name": name, "what": what}, ensure_ascii=False))
        return 0
    indent = max(map(len, found), default=0) + 2
    width = max(shutil.get_terminal_size((100, 24)).columns, indent + 40)
    for name, what in found.items():
        text = textwrap.fill(
            what, width, subsequent_indent=" " * indent, initial_indent=" " * indent
        )
        say(name + text[len(name) :] if what else name)
    return 0


@click.command("show", epilog="Example: mocap-skel assoc show cmu > my_lab.txt")
@click.argument("name", metavar="NAME")
def show(name: str) -> int:
    """Print the association file NAME, a shipped one or a path: a start for one of your own."""
    from mocap_skel.errors import AssociationError
    from mocap_skel.labels.association import find_association, read_association
    from mocap_skel.text import read_text

    # A file that is none is refused, with its line and column.
    read_association(name)
    say(read_text(find_association(name), AssociationError), nl=False)
    return 0


@click.command("standard", epilog="Example: mocap-skel assoc standard")
@options.as_json
def standard(as_json: bool) -> int:
    """Print the standard markers with their segments and places on them: the thesis's Table 1.

    These are the names for the second column of an association file. A marker without one takes a name
    of its own there and its segment in the third.
    """
    from mocap_skel.labels.guess.catalogue import standard_markers

    found = standard_markers()
    if as_json:
        for row in found:
            say(json.dumps(row))
        return 0
    widths = {key: max(len(row[key]) for row in found) for key in found[0]}
    for row in [{key: key for key in widths}, *found]:
        say("  ".join(row[key].ljust(width) for key, width in widths.items()).rstrip())
    return 0
