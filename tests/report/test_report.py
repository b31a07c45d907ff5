"""The HTML page: what it holds, that nothing in a file can break out of it, and that its numbers are right."""

import base64
import dataclasses
import hashlib
import json
import re
import subprocess
import sys
from functools import cache
from html import escape

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from recordings import ASSOCIATIONS, SAMPLES, clip_of, known

from mocap_skel import associate, fit_skeleton, read_clip
from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
from mocap_skel.report.coverage import RADIUS, flattened
from mocap_skel.report.html import PageContent, page
from mocap_skel.report.scene import MISSING, MOST_STEPS, STEP, pack, step_of, steps_of, unpack
from mocap_skel.results.tables import joint_rows
from mocap_skel.results.verdict import verdict

NASTY = '</script><img src=x onerror=alert(1)>\u202e"&\ud800'
in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


def shown_of(clip, association="cmu"):
    found = known(association)
    assignment = associate(clip, found)[0]
    fit = fit_skeleton(clip, assignment, found.skeleton)
    return PageContent(clip, assignment, fit, ("read <well>",), "mocap-skel report")


@cache
def shown(name):
    return shown_of(read_clip(SAMPLES / f"{name}.c3d"), ASSOCIATIONS[name])


@cache
def nasty():
    """A clip in which name, subject, an unassigned label and notes try to break out of the page."""
    good = shown("nearly_still").clip
    clip = dataclasses.replace(
        good,
        name=f"{NASTY}.c3d",
        points=np.concatenate([good.points, good.points[:, :1]], axis=1),
        labels=(*good.labels, NASTY),
        subjects=("",) * (len(good.labels) + 1),
        left_out={NASTY: (NASTY,)},
    )
    one = shown_of(clip)
    fit = dataclasses.replace(one.fit, subject=NASTY, notes=(NASTY, *one.fit.notes))
    return dataclasses.replace(one, fit=fit, decided=(NASTY,), command=NASTY)


def block(html, name):
    return re.search(rf'<script type="[a-z/]+" id="{name}">(.*?)</script>', html, re.S)[1]


def rows_of(html):
    about = json.loads(block(html, "scene"))
    return about, unpack(base64.b64decode(block(html, "samples")), about["frames"])


@pytest.mark.parametrize("name", ["range_of_motion", "gaps"])
def test_the_numbers_on_the_page_are_the_tracks_to_half_a_step(name):
    one = shown(name)
    about, rows = rows_of(page(one))
    assert about["step"] == STEP and about["every"] == 1
    positions = rows[: 3 * about["points"]].reshape(-1, 3, about["frames"]).transpose(0, 2, 1)
    lab = np.where(
        positions == MISSING, np.nan, positions * STEP + np.array(about["middle"])[:, None]
    )
    tracks = [track for _, track in one.fit.tracks()]
    markers = [one.clip.points[:, marker["column"]] for marker in about["markers"]]
    # Half a step, and the middle's own micrometre.
    np.testing.assert_allclose(lab, np.stack([*tracks, *markers]), atol=STEP / 2 + 1e-6)
    axes = rows[3 * about["points"] :].reshape(-1, 2, 3, about["frames"])
    for segment, xy in zip(about["segments"], axes, strict=True):
        there = one.fit.segments[segment].pose.rotation[:, :, :2].transpose(2, 1, 0)
        np.testing.assert_allclose(
            np.where(xy == MISSING, np.nan, xy / MOST_STEPS), there, atol=0.51 / MOST_STEPS
        )


def test_ellipsoids_are_two_standard_errors_along_the_axes_of_the_parents_frame():
    one = shown("range_of_motion")
    about, _ = rows_of(page(one))
    for joint, drawn in zip(one.fit.joints, about["joints"], strict=True):
        axes, radii = np.array(drawn["ellipsoid"]["axes"]).T, np.array(drawn["ellipsoid"]["radii"])
        assert about["segments"][drawn["ellipsoid"]["segment"]] == joint.parent
        assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-5)
        # The page has the radii to a micrometre.
        back = axes * (radii / 2) ** 2 @ axes.T
        np.testing.assert_allclose(back, joint.covariance, atol=2e-6 * radii.max())


def test_packing_is_undone_exactly_and_a_long_way_takes_larger_steps():
    rng = np.random.default_rng(1)
    rows = rng.integers(MISSING, MOST_STEPS, (7, 50), endpoint=True).astype(np.int16)
    np.testing.assert_array_equal(unpack(pack(rows), 50), rows)
    assert step_of(np.array([1.0, -3.2, np.nan])) == STEP
    assert step_of(np.array([13.0])) == 4 * STEP
    np.testing.assert_array_equal(steps_of(np.array([0.01, np.nan]), STEP), [100, MISSING])


def test_nothing_out_of_a_file_becomes_markup_or_script():
    html = page(nasty())
    assert "<img" not in html and "</script><" not in block(html, "scene")
    assert html.count("</script>") == 3
    assert "\u202e" not in html and html.encode()
    assert json.loads(block(html, "scene"))["markers"][-1]["label"] == NASTY
    assert "read &lt;well&gt;" in page(shown("nearly_still"))


def test_the_policy_lets_nothing_run_but_the_viewer_and_nothing_load():
    html = page(shown("nearly_still"))
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', html)[1]
    assert policy.startswith("default-src 'none';") and "unsafe" not in policy
    for tag in ("script", "style"):
        inline = re.findall(rf"<{tag}>(.*?)</{tag}>", html, re.S)
        assert len(inline) == 1
        digest = base64.b64encode(hashlib.sha256(inline[0].encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy
    assert not re.search(
        r"""(?:src|href|action)\s*=\s*["']?\w|url\(|@import""",
        re.sub(r"<script>.*?</script>", "", html, flags=re.S),
    )
    assert "Permission is hereby granted" in html


def test_the_page_has_verdict_table_notes_and_facts():
    one = shown("two_dancers")
    html = page(one)
    sentences = "<br>".join(escape(sentence) for sentence in verdict(one.fit, joint_rows(one.fit)))
    assert f'<p id="verdict">{sentences}</p>' in html
    for joint in one.fit.joints:
        assert f"<button>{joint.joint}</button>" in html
        assert f"<b>{joint.joint}</b>" in html
    assert "700 (101 to 800) at 50 Hz, 14.0 s" in html
    for note in one.fit.notes:
        assert note.split(":")[0] in html


def test_three_thousand_frames_of_sixty_points_are_under_five_megabytes():
    motion = range_of_motion(seconds=51.0, rate=60.0)
    recording = record(human(), marker_set("cmu"), motion, Faults(sigma=1e-3), seed=3)
    clip = clip_of(recording)
    more = 60 - clip.points.shape[1]
    rng = np.random.default_rng(3)
    others = (
        clip.points[:, :more] + rng.normal(0.0, 1e-3, clip.points[:, :more].shape) + [0.1, 0, 0]
    )
    clip = dataclasses.replace(
        clip,
        points=np.concatenate([clip.points, others], axis=1)[:3000],
        labels=(*clip.labels, *(f"other{i}" for i in range(more))),
        subjects=("",) * 60,
    )
    assert clip.points.shape == (3000, 60, 3)
    html = page(shown_of(clip))
    assert len(html.encode()) < 5e6
    assert json.loads(block(html, "scene"))["every"] == 1


def test_the_map_keeps_areas():
    rng = np.random.default_rng(5)
    # Evenly over a cap of 60 degrees: even over its disc too, whose radius is 2 sin 30° of 2.
    z = rng.uniform(0.5, 1.0, 40_000)
    turn = rng.uniform(0, 2 * np.pi, z.size)
    flat = np.sqrt(1 - z**2)
    cap = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    reach = np.linalg.norm(flattened(cap[:, None])[:, 0], axis=1) / RADIUS
    assert reach.max() == pytest.approx(0.5, abs=0.01)
    # A share of n samples has a standard deviation below 0.5/√n = 0.0025.
    for inner in (0.1, 0.2, 0.3, 0.4):
        assert (reach < inner).mean() == pytest.approx((inner / 0.5) ** 2, abs=0.0125)


def test_the_command_writes_a_page_for_each_subject(tmp_path):
    call = [
        sys.executable,
        "-m",
        "mocap_skel",
        "report",
        str(SAMPLES / "two_dancers.c3d"),
        "-a",
        "cmu",
    ]
    done = subprocess.run([*call, "-o", "out"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "two_dancers.Anna.report.html", "two_dancers.Ben.report.html",
    ]  # fmt: skip
    assert "mocap-skel report" in (tmp_path / "out/two_dancers.Ben.report.html").read_text("utf-8")
    again = subprocess.run([*call, "-o", "out"], cwd=tmp_path, capture_output=True, text=True)
    assert again.returncode == 2 and "--overwrite" in again.stderr


@in_chromium
def test_it_plays_in_a_real_browser(tmp_path):
    path = tmp_path / "page.html"
    path.write_text(page(shown("gaps")), encoding="utf-8")
    with Browser(tmp_path / "profile") as browser:
        browser.open(path)
        browser.run("mocapSkel.play(true)")
        before = browser.run("mocapSkel.drawn")
        browser.wait(f"mocapSkel.drawn > {before} + 5")
        browser.press(" ", "Space")
        assert browser.run("mocapSkel.playing") is False
        at = browser.run("mocapSkel.frame")
        browser.press("ArrowRight")
        browser.wait(f"mocapSkel.drawn === {at + 1}")
        assert f"frame {at + 2} ·" in browser.run("document.querySelector('#where').textContent")
        colours = browser.run(
            "(() => { mocapSkel.draw(); const g = mocapSkel.stage.renderer.getContext(), w = g.drawingBufferWidth,"
            "h = g.drawingBufferHeight, p = new Uint8Array(4 * w * h);"
            "g.readPixels(0, 0, w, h, g.RGBA, g.UNSIGNED_BYTE, p);"
            "return new Set(new Uint32Array(p.buffer)).size })()"
        )
        # Background and grid alone are few; a lit figure has many shades.
        assert colours > 50
        browser.run("document.querySelector('tr[data-joint=\"3\"]').click()")
        assert "RightElbow" in browser.run("document.querySelector('#picked').textContent")
        assert browser.messages == []
        assert browser.requests == [path.resolve().as_uri()]


@in_chromium
def test_a_file_full_of_tricks_only_shows_them_as_text(tmp_path):
    path = tmp_path / "page.html"
    path.write_text(page(nasty()), encoding="utf-8")
    with Browser(tmp_path / "profile") as browser:
        browser.open(path)
        assert browser.run("document.images.length") == 0
        assert "<img src=x onerror=alert(1)>" in browser.run(
            "document.querySelector('h1').textContent"
        )
        assert browser.messages == []
        assert browser.requests == [path.resolve().as_uri()]
