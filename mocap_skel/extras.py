"""Libraries that only some commands need: loaded where they are used, missed in one line."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from mocap_skel.errors import MissingExtraError


def extra(module: str, name: str) -> Any:
    """Import a module of the optional extra `name`.

    Raises:
        MissingExtraError: it is not installed; the hint names the command that installs it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        library = module.partition(".")[0]
        raise MissingExtraError(
            f"this needs {library}, which is not installed", f"pip install 'mocap-skel[{name}]'"
        ) from error
