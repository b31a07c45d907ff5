"""The command line: one module a command, loaded when it is called, and one door for every error.

Here belongs parsing, calling and printing, nothing that computes. It may import everything.
"""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import TextIO

import click

from mocap_skel.errors import CallError, MocapSkelError
from mocap_skel.text import visible
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
FAILED = 1
# Characters of a message. Picked by eye.
_LONGEST = 2000

_TOO_MANY = os.strerror(errno.EMFILE)


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
    _open_streams()
    debug = "--debug" in (sys.argv[1:] if arguments is None else arguments)
    if not debug:
        # What a library warns of is no message for a user, who gets ours.
        warnings.showwarning = _unseen
    try:
        with _terminable():
            code = group.main(arguments, "mocap-skel", standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        _show(error)
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt) as error:
        ended = next((e for e in (error, error.__cause__) if isinstance(e, _Terminated)), None)
        warn("terminated" if ended else "interrupted")
        code = ended.code if ended else INTERRUPTED
    except MocapSkelError as error:
        complain(error)
        code = USAGE if isinstance(error, CallError) else NOTHING_FITTED
    except BrokenPipeError:
        _close(sys.stdout)
        code = 0
    except Exception as error:  # the last door
        complain(_want(error) or _unwritten(error) or bug(error, debug))
        code = FAILED
    sys.exit(code if isinstance(code, int) else 0)


class _Terminated(KeyboardInterrupt):
    """SIGTERM or SIGHUP, which end a call as Ctrl-C does: children end, and nothing is left half done.

    Attributes:
        code: the exit code, that of a shell.
    """

    def __init__(self, sign: int) -> None:
        super().__init__()
        self.code = 128 + sign


@contextmanager
def _terminable() -> Iterator[None]:
    """Let SIGTERM and SIGHUP raise `_Terminated`, unless the caller has them ignored, as nohup does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def terminate(sign: int, _: object) -> None:
        raise _Terminated(sign)

    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    mine = [
        sign for name in names if signal.getsignal(sign := getattr(signal, name)) == signal.SIG_DFL
    ]
    for sign in mine:
        signal.signal(sign, terminate)
    try:
        yield
    finally:
        for sign in mine:
            signal.signal(sign, signal.SIG_DFL)


def _unseen(*_: object, **__: object) -> None:
    """Shows no warning."""


def _open_streams() -> None:
    """Let standard streams that the caller has closed lead nowhere, and text on its way there always be written.

    Otherwise the next file to be opened would be in a stream's place, and be written to.
    """
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_RDWR)
            # Children have it, too.
            os.set_inheritable(nowhere, nowhere == number)
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        # A locale may have no letters but those of English.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def is_closed(stream: TextIO) -> bool:
    """Whether a standard stream was closed by the caller."""
    return getattr(stream, "name", None) == os.devnull


def say(text: str | bytes, *, nl: bool = True) -> None:
    """Print to standard output. If its reader has stopped reading, that is no error and the work goes on.

    Args:
        text: a text, shown as a terminal may show it; or bytes, as they are.
        nl: whether a line ends with it.
    """
    shown = visible(text, "\n\t") if isinstance(text, str) else text
    try:
        click.echo(shown, nl=nl)
    except BrokenPipeError:
        _close(sys.stdout)


def warn(text: str) -> None:
    """Print a line to standard error. If nobody can read it, the work goes on."""
    try:
        click.echo(f"mocap-skel: {visible(text)}", err=True)
    except OSError:
        _close(sys.stderr)


def _show(error: click.ClickException) -> None:
    """Print click's own words about a call."""
    said = io.StringIO()
    error.show(said)
    with suppress(OSError):
        click.echo(visible(said.getvalue(), "\n"), err=True, nl=False)


def _close(stream: TextIO) -> None:
    """Let a stream lead nowhere: Python would complain once more while it flushes a broken one at exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def _want(error: BaseException) -> MocapSkelError | None:
    """What to say where the system gives this process no more memory or files; None where that is not why."""
    from mocap_skel.pipeline.limits import starved

    chain = [error]
    while (cause := chain[-1].__cause__ or chain[-1].__context__) is not None:
        chain.append(cause)
    if any(map(starved, chain)):
        return MocapSkelError("not enough memory for this call")
    # A library that cannot be loaded has no other way to say it.
    if any(getattr(e, "errno", 0) == errno.EMFILE or _TOO_MANY in str(e) for e in chain):
        return MocapSkelError("too many open files", "ulimit -n shows how many there may be")
    return None


def _unwritten(error: Exception) -> MocapSkelError | None:
    """What to say where standard output cannot be written; None where that is not why."""
    # Whatever reads or writes files turns its errors into ours; what is left without a name is standard output.
    if not isinstance(error, OSError) or error.filename is not None:
        return None
    _close(sys.stdout)
    return MocapSkelError(f"standard output: {error.strerror}")


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
    # A file may have a name of megabytes in it.
    said = error.message if len(error.message) <= _LONGEST else f"{error.message[:_LONGEST]} ..."
    warn(f"error: {said}{hint:.{_LONGEST}}")
