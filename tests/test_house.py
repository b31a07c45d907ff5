"""The plan of the house: arrows go down only. `PLAN` is the plan; docs/architecture.md shows the same."""

import ast
import re
from functools import cache

import pytest
from recordings import ROOT

PACKAGE = ROOT / "mocap_skel"
# From the roof to the ground. A room may import what stands below it; rooms of one floor do not see each other.
PLAN = (
    ("__main__",),
    ("cli",),
    ("pipeline",),
    ("studies",),
    ("report",),
    ("export",),
    ("results",),
    ("gait",),
    ("angles", "rig"),
    ("fit",),
    ("labels",),
    ("skeleton_fit",),
    ("joints",),
    ("segments",),
    ("artificial", "readers"),
    ("figure",),
    ("spherefit",),
    ("clip", "extras", "measures"),
    ("text",),
    ("errors", "events", "version"),
)
FLOOR = {room: floor for floor, rooms in enumerate(reversed(PLAN)) for room in rooms}


def modules():
    """Name within the package → its file; `labels.guess` for a folder's own file."""
    for path in sorted(PACKAGE.rglob("*.py")):
        name = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        yield name.removesuffix("__init__").rstrip("."), path


MODULES = dict(modules())


def imports(path):
    """Modules of the package that a file imports anywhere, in functions and for types too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (a.name for a in node.names if a.name.split(".")[0] == "mocap_skel")
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            if node.module and node.module.split(".")[0] == "mocap_skel":
                inside = node.module.removeprefix("mocap_skel").lstrip(".")
                for alias in node.names:
                    deeper = f"{inside}.{alias.name}".lstrip(".")
                    yield f"mocap_skel.{deeper if deeper in MODULES else inside}"


@cache
def arrows():
    """(importing module, imported module), both within the package; "" is the package's face."""
    return {
        (name, found.removeprefix("mocap_skel").lstrip("."))
        for name, path in MODULES.items()
        if name
        for found in imports(path)
    }


def room(module):
    return module.split(".")[0]


def test_every_room_is_on_the_plan_and_every_room_of_the_plan_is_there():
    assert {room(name) for name in MODULES if name} == set(FLOOR)


def test_arrows_go_down_only():
    up = [
        f"{start} imports {goal or 'mocap_skel'}"
        for start, goal in sorted(arrows())
        if room(start) != room(goal) and (not goal or FLOOR[room(goal)] >= FLOOR[room(start)])
    ]
    assert not up


def test_modules_of_a_wing_do_not_import_each_other_in_a_circle():
    below = {name: {goal for start, goal in arrows() if start == name} for name in MODULES}
    free = set()
    while True:
        next_free = {name for name in below if below[name] <= free | {name}} - free
        if not next_free:
            break
        free |= next_free
    assert not sorted(set(below) - free - {""})


@pytest.mark.parametrize("wing", sorted(p.parent.name for p in PACKAGE.glob("*/__init__.py")))
def test_each_wing_says_what_belongs_there(wing):
    said = ast.get_docstring(ast.parse((PACKAGE / wing / "__init__.py").read_text()))
    assert said is not None
    assert "may import" in said


def test_the_architecture_page_shows_the_same_plan():
    page = (ROOT / "docs" / "architecture.md").read_text()
    table = page[page.index("## Floors") : page.index("## Rooms")]
    shown = re.findall(r"^\d+\. (.+)$", table, re.M)
    assert [tuple(re.findall(r"`(\w+)`", line)) for line in shown] == [tuple(r) for r in PLAN[1:]]
