"""The command line: one module a command, loaded when it is called, and one door for every error.

Here belongs parsing, calling and printing, nothing that computes. It may import everything.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

import click

from mocap_skel.errors import CallError, MocapSkelError
from mocap_skel.version import __version__

# Command → the line that `mocap-skel --help` shows for it, so that help loads no command.
COMMANDS = {
    "fit": "Fit a skeleton to clips: joint centres, moving skeleton, evidence.",
    "batch": "Fit many clips at the same time, each once, with a manifest of what became of them.",
    "calibrate": "Add up what several clips of one actor show of the joints.",
    "draw": "Draw a fitted clip: the skeleton in a frame, joints and bones against time.",
    "cycles": "Gait cycles: joint angles from foot strike to foot strike, mean and deviation.",
    "report": "Show a clip's skeleton moving, and the evidence for it, on one HTML page.",
    "inspect": "Show what is in a clip before anyone fits it.",
    "assoc": "Association files: guess one for a clip, check one, list and show the shipped ones.",
    "methods": "Compare the sphere fits: the thesis's Table 4, measured now.",
    "study": "Repeat the thesis's experiments: resample, speed, accuracy.",
}

NOTHING_FITTED = 3
USAGE = 2
INTERRUPTED = 130
TERMINATED = 143
FAILED = 1


class _Commands(click.Group):
    """Loads a command's module on its first use."""

    # click hands every method its context, needed or not.
    # ruff: noqa: ARG002

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = import_module(f"mocap_skel.cli.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: mocap-skel fit walk.c3d --assoc cmu -o out",
)
@click.version_option(__version__, message="mocap-skel %(version)s")
@click.option("--debug", is_flag=True, help="Show the traceback of an unexpected error.")
@click.pass_context
def group(ctx: click.Context, debug: bool) -> None:
    """Skeletons from optical motion capture: C3D, TRC or CSV in, joint centres and a moving skeleton out.

    No initial guess and no optimisation: closed-form sphere fits, one pass over the data.
    """
    ctx.obj = debug


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: the one place where errors become a line and an exit code."""
    debug = "--debug" in (sys.argv[1:] if arguments is None else arguments)
    if not debug:
        # What a library warns of is no message for a user, who gets ours.
        warnings.showwarning = _unseen
    try:
        with _terminable():
            code = group.main(arguments, "mocap-skel", standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt) as error:
        terminated = _Terminated in (type(error), type(error.__cause__))
        click.echo(f"mocap-skel: {'terminated' if terminated else 'interrupted'}", err=True)
        code = TERMINATED if terminated else INTERRUPTED
    except MocapSkelError as error:
        complain(error)
        code = USAGE if isinstance(error, CallError) else NOTHING_FITTED
    except OSError as error:
        # Whatever reads or writes files turns its errors into ours; what is left is standard output.
        if not isinstance(error, BrokenPipeError):
            click.echo(f"mocap-skel: error: standard output: {error.strerror}", err=True)
        _close_output()
        code = 0 if isinstance(error, BrokenPipeError) else FAILED
    except MemoryError:
        click.echo("mocap-skel: error: not enough memory for this call", err=True)
        code = FAILED
    except Exception as error:  # the last door: anything else is our mistake
        complain(bug(error, debug))
        code = FAILED
    sys.exit(code if isinstance(code, int) else 0)


class _Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a call as Ctrl-C does: children end, and nothing is left half done."""


@contextmanager
def _terminable() -> Iterator[None]:
    """Let SIGTERM raise `_Terminated`."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def terminate(*_: object) -> None:
        raise _Terminated

    before = signal.signal(signal.SIGTERM, terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _unseen(*_: object, **__: object) -> None:
    """Shows no warning."""


def say(text: str | bytes, *, nl: bool = True) -> None:
    """Print to standard output. If its reader has stopped reading, that is no error and the work goes on."""
    try:
        click.echo(text, nl=nl)
    except BrokenPipeError:
        _close_output()


def _close_output() -> None:
    # Python would complain once more while it flushes a broken stream at exit.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def bug(error: Exception, debug: bool) -> MocapSkelError:
    """Turn an error that nobody raised on purpose into one that can be shown; print its traceback if asked."""
    if debug:
        traceback.print_exception(error)
    return MocapSkelError(
        f"this is a bug: {type(error).__name__}: {' '.join(str(error).split())}",
        "please report it with the output of the same command after 'mocap-skel --debug'",
    )


def complain(error: MocapSkelError) -> None:
    """Print an error as one line, with what to do about it."""
    hint = f" ({error.hint})" if error.hint else ""
    click.echo(f"mocap-skel: error: {error.message}{hint}", err=True)
