"""The lowest versions that pyproject.toml admits, as constraints for pip: `make test-lowest` installs them.

Tools that only look at the code (ruff, mypy) and libraries that only tests use are left to pip.
"""

import re
import sys
import tomllib
from pathlib import Path

PROJECT = Path(__file__).parent.parent / "pyproject.toml"
# Extras of the package; `dev` and `studies` are made of them and of tools.
EXTRAS = ("plot", "mle", "parquet", "gltf", "cluster")
# Tests take warnings for errors, and pyparsing 3.3 warns of what matplotlib did until then.
BESIDE = ("pyparsing<3.3",)
_REQUIREMENT = re.compile(r"([\w-]+)>=([\d.]+)")


def lowest(project: Path = PROJECT) -> dict[str, str]:
    """Library → its lowest version, of the package and its extras."""
    content = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
    extras = content["optional-dependencies"]
    wanted = [*content["dependencies"], *(one for name in EXTRAS for one in extras[name])]
    found = {}
    for requirement in wanted:
        match = _REQUIREMENT.fullmatch(requirement)
        assert match is not None, f"{requirement}: a lowest version is missing"
        assert found.setdefault(match[1], match[2]) == match[2], f"{match[1]}: two lowest versions"
    return found


if __name__ == "__main__":
    constraints = [*(f"{name}=={version}" for name, version in lowest().items()), *BESIDE]
    sys.stdout.writelines(f"{constraint}\n" for constraint in constraints)
