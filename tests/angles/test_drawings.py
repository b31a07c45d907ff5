"""The drawings of the page of angles are those that its script makes of the table."""

import importlib.util
import re

import pytest
from recordings import ROOT

from mocap_skel.figure.angle_table import angle_table

FOLDER = ROOT / "docs" / "angles"
RIGHT = [rule for rule in angle_table().angles if not rule.mirrored]


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("draw_angles", FOLDER / "draw.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("rule", RIGHT, ids=lambda rule: rule.name)
def test_a_drawing_is_what_the_script_makes(script, rule):
    path = FOLDER / f"{rule.name.replace('Right', '').lower()}.svg"
    made = script.drawing(rule)
    assert path.read_text(encoding="utf-8") == made
    assert all(f"+30° {part}" in made for part in rule.parts)
    assert f"(angles/{path.name})" in (ROOT / "docs" / "angles.md").read_text()


@pytest.mark.parametrize("rule", RIGHT, ids=lambda rule: rule.name)
def test_the_page_lists_every_angle_with_its_sequence(rule):
    page = (ROOT / "docs" / "angles.md").read_text()
    table = page[page.index("## The angles") : page.index("### Drawings")]
    (row,) = [line for line in table.splitlines() if re.match(rf"\| [^|]*`{rule.name}`", line)]
    assert rule.sequence in row and all(f"`{part}`" in row for part in rule.parts)
