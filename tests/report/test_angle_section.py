"""Joint angles on the page: the lines are the angles, and the strong line is the frame that is played."""

import re
from dataclasses import replace

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from recordings import fit_sample
from reported import shown

from mocap_skel.angles.joint_angles import joint_angles
from mocap_skel.events import Event
from mocap_skel.report.angle_section import LEFT, WIDE, angle_section
from mocap_skel.report.html import page

# A label's height over its line.
_DROP = 4.0


def number(pattern, text):
    return [float(found) for found in re.findall(pattern, text)]


@pytest.fixture(scope="module")
def angles():
    return joint_angles(fit_sample("nearly_still"))


def test_a_line_is_where_its_angle_is(angles):
    """The picture read back by its own numbers: the left knee's flexion, to what a tenth of a unit shows."""
    section = angle_section(angles, ())
    (knee,) = re.findall(r'<figure data-angles="Knee">(.*?)</figure>', section)
    flexion = knee.split("</svg>")[0]
    heights = np.array(number(r'class="number"[^>]* y="([\d.]+)"', flexion)) - _DROP
    degrees = np.array(number(r'class="number"[^>]*>(-?[\d.]+)<', flexion))
    slope, start = np.polyfit(heights, degrees, 1)
    (path,) = re.findall(r'<path class="left" d="([^"]+)"', flexion)
    x, y = np.array(re.findall(r"[ML]([\d.]+) ([\d.]+)", path), dtype=float).T
    want = angles["LeftKnee"].degrees[:, 0]
    assert len(x) == len(want)
    assert x[0] == LEFT and x[-1] == WIDE
    np.testing.assert_allclose(start + slope * y, want, atol=abs(slope) * 0.2)


def test_one_joint_is_shown_and_every_joint_can_be_chosen(angles):
    section = angle_section(angles, ())
    names = re.findall(r"<option[^>]*>(\w+)</option>", section)
    assert names == re.findall(r'<figure data-angles="(\w+)"', section)
    assert re.findall(r'<figure data-angles="(\w+)">', section) == ["Knee"]
    assert section.count("<svg") == 3 * len(names)


def test_an_event_is_a_line_in_its_frame_and_its_words_are_safe(angles):
    first = int(angles.frame_numbers[0])
    events = [Event(0.0, first, "<b>", "Left"), Event(1.0, first + 10_000, "late", "Right")]
    section = angle_section(angles, events)
    assert "<b>" not in section and "late" not in section
    assert f'<line class="event left" x1="{LEFT:.1f}" x2="{LEFT:.1f}" y1="0"' in section


def test_a_figure_without_angles_says_so(angles):
    assert "<svg" not in angle_section(replace(angles, joints=()), ())
    assert "has angles" in angle_section(replace(angles, joints=()), ())


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_the_strong_line_follows_the_figure_and_a_place_leads_to_its_frame(tmp_path):
    content = shown("nearly_still")
    path = tmp_path / "page.html"
    path.write_text(page(content), encoding="utf-8")
    last = len(content.fit.frame_numbers) - 1
    with Browser(tmp_path / "profile") as browser:
        browser.open(path)
        browser.run("mocapSkel.play(false); mocapSkel.go(200)")
        browser.wait("mocapSkel.drawn === 200")
        moved = "Number(document.querySelector('figure:not([hidden]) > svg > .now').getAttribute('transform').slice(10, -1))"
        assert browser.run(moved) == pytest.approx((WIDE - LEFT) * 200 / last, abs=0.1)
        browser.run(
            "(() => { const list = document.getElementById('angle-joint'); list.value = 'Ankle';"
            "list.dispatchEvent(new Event('change')) })()"
        )
        visible = "[...document.querySelectorAll('#angle-plots figure:not([hidden])')].map((f) => f.dataset.angles).join()"
        assert browser.run(visible) == "Ankle"
        browser.run(
            "(() => { const svg = document.querySelector('#angle-plots figure:not([hidden]) svg');"
            "const box = svg.getBoundingClientRect();"
            f"const clientX = box.left + box.width * {(LEFT + WIDE) / 2 / WIDE};"
            "svg.dispatchEvent(new MouseEvent('click', { bubbles: true, clientX, clientY: box.top + 5 })) })()"
        )
        browser.wait("mocapSkel.drawn !== 200")
        assert browser.run("mocapSkel.frame") == pytest.approx(last / 2, abs=1)
