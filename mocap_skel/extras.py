"""Libraries that only some commands need: loaded where they are used, with one clear error without them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from mocap_skel.errors import MissingExtraError


def extra(module: str, name: str) -> Any:
    """Import a module of an optional extra.

    Args:
        module: as in an import statement.
        name: the extra of this package that installs it.

    Raises:
        MissingExtraError: it is not installed; the hint names the command that installs it.

    Example:
        >>> from mocap_skel.extras import extra
        >>> extra("json", "any").dumps([1])
        '[1]'
    """
    try:
        return import_module(module)
    except ImportError as error:
        library = module.partition(".")[0]
        raise MissingExtraError(
            f"this needs {library}, which is not installed", f"pip install 'mocap-skel[{name}]'"
        ) from error
