"""How the page is looked at in a real browser: from where, how large, by finger and by keys."""

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from reported import rows_of, shown

from mocap_skel.report.html import page
from mocap_skel.report.moving import moving
from mocap_skel.report.view import view_of

in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

FILLED = (
    "(() => { const { stage, data } = mocapSkel; const found = [];"
    "const used = [...new Set(data.about.bones.flatMap((bone) => [bone.from, bone.to]))];"
    "for (let frame = 0; frame < data.about.frames; frame += 5) {"
    "mocapSkel.at = frame; mocapSkel.draw();"
    "const at = used.map((point) => { const one = stage.camera.position.clone();"
    "return stage.screen({ at: one, seen: data.point(point, frame, one) }) }).filter(Boolean);"
    "const x = at.map((p) => p[0] / stage.view.clientWidth), y = at.map((p) => p[1] / stage.view.clientHeight);"
    "found.push([Math.min(...x, ...y), Math.max(...x, ...y),"
    "Math.max(Math.max(...x) - Math.min(...x), Math.max(...y) - Math.min(...y))]) } return found })()"
)


@in_chromium
@pytest.mark.parametrize("size", [(1400, 900), (390, 844), (844, 390)])
def test_the_figure_fills_the_view_all_the_way_and_never_leaves_it(tmp_path, size):
    path = tmp_path / "page.html"
    path.write_text(page(shown("range_of_motion")), encoding="utf-8")
    with Browser(tmp_path / "profile", *size) as browser:
        browser.open(path)
        browser.run("mocapSkel.play(false); mocapSkel.go(0)")
        browser.wait("mocapSkel.drawn === 0")
        first = np.array(browser.run(FILLED))
        assert first[:, 0].min() > 0 and first[:, 1].max() < 1
        # In the first second, and in most frames, however it crouches and stretches.
        assert first[:12, 2].max() > 0.7 and first[:, 2].min() > 0.3, first[:, 2]
        assert np.median(first[:, 2]) > 0.55, first[:, 2]
        # A user who has come nearer stays as much nearer; the way there leaves no trace.
        assert browser.run("mocapSkel.stage.view.clientHeight") >= 0.4 * size[1]
        np.testing.assert_allclose(browser.run(FILLED), first, atol=1e-6)
        browser.run("mocapSkel.stage.camera.position.sub(mocapSkel.stage.controls.target)"
                    ".multiplyScalar(2).add(mocapSkel.stage.controls.target)")  # fmt: skip
        assert 0.4 < np.median(np.array(browser.run(FILLED))[:, 2] / first[:, 2]) < 0.55


@in_chromium
def test_bands_are_reached_by_keys_buttons_and_a_finger_beside_them(tmp_path):
    path = tmp_path / "page.html"
    path.write_text(page(shown("gaps")), encoding="utf-8")
    with Browser(tmp_path / "profile", 390, 844) as browser:
        browser.open(path)
        browser.run("mocapSkel.play(false); mocapSkel.go(0)")
        browser.wait("mocapSkel.drawn === 0")
        about, _ = rows_of(page(shown("gaps")))
        starts = sorted({start - about["firstFrame"] for start, _, _ in about["bands"]} - {0})
        for start in starts[:2]:
            browser.press("b", "KeyB")
            assert browser.run("mocapSkel.frame") == start
        browser.wait(f"mocapSkel.drawn === {starts[1]}")
        said = browser.run("document.querySelector('#scrub').getAttribute('aria-valuetext')")
        assert ":" in said and f"frame {starts[1] + about['firstFrame']}" in said
        button = "document.querySelector('[data-kind=guessed]')"
        assert browser.run(f"{button}.focus(), document.activeElement === {button}")
        browser.run(f"mocapSkel.go(0), {button}.click()")
        guessed = [a for a, _, words in about["bands"] if words.startswith("guessed")]
        assert browser.run("mocapSkel.frame") == min(
            (a - about["firstFrame"] for a in guessed if a > about["firstFrame"]), default=0
        )
        # Beside a band: the nearest one is meant.
        x, y, first = browser.run(
            "(() => { const one = document.querySelector('#bands rect.repaired'), box = one.getBoundingClientRect();"
            "return [box.right, box.top + box.height / 2, Number(one.dataset.frame)] })()"
        )
        browser.run(
            f"document.querySelector('#bands').dispatchEvent(new MouseEvent('click', {{ clientX: {x + 4}, clientY: {y} }}))"
        )
        assert browser.run("mocapSkel.frame") == first - about["firstFrame"]
        # What is to look at stands before the long tables.
        assert browser.run(
            "document.querySelector('#rig').getBoundingClientRect().top < document.querySelector('#joints').getBoundingClientRect().top"
        )
        assert browser.messages == []


@in_chromium
def test_a_phone_sees_the_standard_errors_and_the_figure_fills_the_view(tmp_path):
    path = tmp_path / "page.html"
    path.write_text(page(shown("gaps")), encoding="utf-8")
    with Browser(tmp_path / "profile", 360, 740) as browser:
        browser.open(path)
        browser.run("mocapSkel.play(false); mocapSkel.go(0)")
        browser.wait("mocapSkel.drawn === 0")
        # Nothing is cut off at the right, and each joint's error is inside the window.
        assert browser.run("document.documentElement.scrollWidth") == 360
        errors = browser.run(
            "[...document.querySelectorAll('#joint-table td[data-head=\"s.e. mm\"]')].map((cell) => "
            "[cell.getBoundingClientRect().left, cell.getBoundingClientRect().right])"
        )
        assert len(errors) == 14
        assert all(0 < left < right <= 360 for left, right in errors)
        browser.run("document.querySelector('rect.repaired').dispatchEvent(new Event('click'))")
        browser.wait("mocapSkel.drawn > 0")
        assert "repaired" in browser.run("document.querySelector('#done').textContent")
        path.write_text(page(shown("nearly_still")), encoding="utf-8")
        browser.open(path)
        box = browser.run(
            "(() => { const { stage } = mocapSkel; const at = stage.figure.places.map((p) => stage.screen(p));"
            "const x = at.map((p) => p[0]), y = at.map((p) => p[1]);"
            "return [Math.min(...x), Math.max(...x), Math.min(...y), Math.max(...y),"
            "stage.view.clientWidth, stage.view.clientHeight] })()"
        )
        left, right, top, bottom, width, height = box
        assert left >= 0 and right <= width and top >= 0 and bottom <= height
        assert max((right - left) / width, (bottom - top) / height) > 0.6
        assert browser.messages == []


@in_chromium
def test_the_page_looks_at_the_figure_as_pictures_do(tmp_path):
    one = shown("range_of_motion")
    path = tmp_path / "page.html"
    path.write_text(page(one), encoding="utf-8")
    hips = [[j.joint for j in one.fit.joints].index(f"{s}Hip") for s in ("Right", "Left")]
    with Browser(tmp_path / "profile") as browser:
        browser.open(path)
        browser.run("mocapSkel.play(false); mocapSkel.go(0)")
        browser.wait("mocapSkel.drawn === 0")
        # The first view is the oblique one of a picture of that frame.
        for name in ("oblique", "front", "side", "top"):
            if name != "oblique":
                browser.run(f"document.querySelector('[data-view={name}]').click()")
            towards, right, left = browser.run(
                "(() => { mocapSkel.draw(); const { stage } = mocapSkel;"
                "return [stage.camera.position.clone().sub(stage.controls.target).normalize().toArray(),"
                f"...{hips}.map((i) => stage.screen(stage.figure.places[i])[0])] }})()"
            )
            view = view_of(name, [moving(one.fit).fit], [0])
            # The page's front and side are 0.05 of their distance, 3 degrees, above the horizon.
            angle = np.degrees(np.arccos(min(1.0, towards @ view.axes[2])))
            assert angle < (3.0 if name in ("front", "side") else 0.5), name
            across = view.axes[0] @ (
                one.fit.joints[hips[0]].track[0] - one.fit.joints[hips[1]].track[0]
            )
            if name != "side":
                assert np.sign(right - left) == np.sign(across), name
