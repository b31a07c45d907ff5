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
from types import SimpleNamespace

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from recordings import SAMPLES, clip_of
from reported import block, rows_of, shown, shown_of

from mocap_skel import read_clip
from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
from mocap_skel.report.bands import KINDS, Band, legend, strip
from mocap_skel.report.coverage import RADIUS, flattened
from mocap_skel.report.headline import findings
from mocap_skel.report.html import page
from mocap_skel.report.looks import LOOKS, style_of_verdicts
from mocap_skel.report.moving import moving
from mocap_skel.report.scene import AXIS, MISSING, MOST_STEPS, STEP, pack, step_of, steps_of, unpack
from mocap_skel.results.tables import axis_ends, joint_rows
from mocap_skel.results.verdict import in_short, verdict

NASTY = '</script><img src=x onerror=alert(1)>\u202e"&\ud800'
in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


@cache
def nasty():
    """A clip of which every name tries to break out of the page: of clip, subject, labels, markers, joints, notes."""
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
    # A marker and a joint as well: association and skeleton files may come from anybody, too.
    columns = {s: dict(markers) for s, markers in one.assignment.columns.items()}
    columns["UpperLeftLeg"][NASTY] = columns["UpperLeftLeg"].pop("LTHI")
    assignment = dataclasses.replace(one.assignment, columns=columns)
    skeleton = dataclasses.replace(
        one.fit.skeleton,
        name=NASTY,
        segments=tuple(
            dataclasses.replace(s, joint=NASTY, movement=NASTY) if s.joint == "LeftHip" else s
            for s in one.fit.skeleton.segments
        ),
    )
    joints = tuple(
        dataclasses.replace(
            j, joint=NASTY, reason=NASTY,
            markers=tuple(NASTY if name == "LTHI" else name for name in j.markers),
        )
        if j.joint == "LeftHip" else j
        for j in one.fit.joints
    )  # fmt: skip
    fit = dataclasses.replace(
        one.fit, subject=NASTY, skeleton=skeleton, joints=joints, notes=(NASTY, *one.fit.notes)
    )
    return dataclasses.replace(one, fit=fit, assignment=assignment, decided=(NASTY,), command=NASTY)


@pytest.mark.parametrize("name", ["range_of_motion", "gaps"])
def test_the_numbers_on_the_page_are_the_tracks_to_half_a_step(name):
    one = shown(name)
    about, rows = rows_of(page(one))
    assert about["step"] == STEP and about["every"] == 1
    positions = rows[: 3 * about["points"]].reshape(-1, 3, about["frames"]).transpose(0, 2, 1)
    lab = np.where(
        positions == MISSING, np.nan, positions * STEP + np.array(about["middle"])[:, None]
    )
    played = moving(one.fit).fit
    tracks = [track for _, track in played.tracks()]
    markers = [one.clip.points[:, marker["column"]] for marker in about["markers"]]
    # Behind the markers the ends of each axis on which a joint turns.
    shown_axes = [ends for j in played.joints if (ends := axis_ends(played, j, AXIS)) is not None]
    markers += [end for ends in shown_axes for end in ends]
    # Half a step, and the middle's own micrometre.
    np.testing.assert_allclose(lab, np.stack([*tracks, *markers]), atol=STEP / 2 + 1e-6)
    axes = rows[3 * about["points"] :].reshape(-1, 2, 3, about["frames"])
    for segment, xy in zip(about["segments"], axes, strict=True):
        there = played.segments[segment].pose.rotation[:, :, :2].transpose(2, 1, 0)
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
    about = json.loads(block(html, "scene"))
    assert about["markers"][-1]["label"] == NASTY
    (hip,) = (j for j in about["joints"] if j["name"] == NASTY)
    assert NASTY in hip["spokes"] and hip["why"] == NASTY
    # Control characters and halves of characters are no text anywhere; the rest is there to be read.
    readable = escape(NASTY.replace("\u202e", "\ufffd").replace("\ud800", "\ufffd"))
    for place in (
        f" · {readable}</h1>", f"<button>{readable}</button>",
        f'<td data-head="why">{readable}</td>', f"<b>{readable}</b>", f'">{readable}</span>',
        f"<dd>{readable}</dd>", f"<li>{readable}</li>",
    ):  # fmt: skip
        assert place in html, place
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
    # Of this dancer the waist is known to 5.7 cm, which is an alarm.
    short = re.search(r'<p id="short">(.*?)</p>', html, re.S)[1]
    assert short.startswith('<span class="alarm">') and escape(in_short(one.fit)) in short
    for joint in one.fit.joints:
        assert f"<button>{joint.joint}</button>" in html
        assert f"<b>{joint.joint}</b>" in html
    assert "700 (101 to 800) at 50 Hz, 14.0 s" in html
    for note in one.fit.notes:
        assert note.split(":")[0] in html


def test_the_facts_are_those_of_this_subject():
    one = shown("two_dancers")
    points = one.clip.points.copy()
    own = next(iter(one.assignment.columns["Head"].values()))
    others = [i for i, subject in enumerate(one.clip.subjects) if subject != one.fit.subject]
    # Half of the samples of one of 41 markers; and all of the other subject's.
    points[:350, own] = np.nan
    points[:, others] = np.nan
    html = page(
        dataclasses.replace(
            one, clip=dataclasses.replace(one.clip, points=points), decided=("twice", "twice")
        )
    )
    assert f"<dd>{one.fit.subject}</dd>" in html
    assert "<dd>41 assigned, 1.2 % of their samples missing</dd>" in html
    assert html.count("<li>twice</li>") == 1


def test_a_row_a_map_and_a_joint_of_the_figure_have_one_number():
    one = shown("two_dancers")
    html = page(one)
    names = [joint["name"] for joint in json.loads(block(html, "scene"))["joints"]]
    for tag, end in (("tr", "</button>"), ("figure", "</b>")):
        found = re.findall(rf'<{tag}[^>]* data-joint="(\d+)">.*?<b(?:utton)?>(\w+){end}', html)
        assert len(found) == 14
        assert all(names[int(number)] == name for number, name in found)


def luminance(colour):
    """Relative luminance of a colour #rrggbb, WCAG 2.1."""
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(parts <= 0.03928, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return linear @ [0.2126, 0.7152, 0.0722]


def test_words_in_the_colour_of_a_verdict_can_be_read_on_either_ground():
    style = page(shown("nearly_still")).split("</style>")[0]
    light, dark = re.findall(r"--panel: (#\w+)", style)
    for name, look in LOOKS.items():
        for ground, colour in ((light, look.text), (dark, look.dark_text)):
            high, low = sorted([luminance(ground), luminance(colour)], reverse=True)
            assert (high + 0.05) / (low + 0.05) >= 4.5, name
        assert f"--{name}: {look.text};" in style and f"--{name}-ball: {look.colour};" in style
    assert style.count(style_of_verdicts()) == 1


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


def test_the_page_plays_the_rigid_figure_and_marks_what_was_filled_in_it():
    one = shown("gaps")
    html = page(one)
    played = moving(one.fit)
    tracks = dict(played.fit.tracks())
    thigh = np.linalg.norm(tracks["LeftHip"] - tracks["LeftKnee"], axis=1)
    assert np.ptp(thigh) < 1e-9 and np.isfinite(thigh).all()
    about, _ = rows_of(html)
    assert about["floor"] == pytest.approx(played.animation.feet.floor, abs=1e-4)
    said = [b for b in played.animation.motion.bridges if b.by == "motion"]
    guessed = [(start, stop) for start, stop, words in about["bands"] if words[:7] == "guessed"]
    first = one.clip.first_frame
    assert said and all(
        any(start <= b.start + first and b.stop + first <= stop for start, stop in guessed)
        for b in said
    )
    for start, _, words in about["bands"]:
        kind = words.partition(":")[0]
        assert f'<rect class="{kind}" data-frame="{start}"' in html
    assert 'class="alarm" data-head="longest guess s"><span class="sign">▲</span>' in html


@cache
def without_a_figure():
    """Every second frame has no marker, and the gaps, 2.5 s at this rate, are too long to be bridged."""
    good = read_clip(SAMPLES / "nearly_still.c3d")
    points = good.points[:60].copy()
    points[1::2] = np.nan
    return shown_of(dataclasses.replace(good, points=points, rate=0.4))


def test_where_no_two_frames_show_a_whole_figure_the_page_has_the_free_poses_and_says_so():
    one = without_a_figure()
    played = moving(one.fit)
    assert played.fit is one.fit and played.quality is None and played.floor is None
    html = re.sub(r"<style>.*?</style>|<script>.*?</script>", "", page(one), flags=re.S)
    # The tracks on it are those of the fit, gaps and all.
    about, rows = rows_of(html)
    assert (rows[0, 1::2] == MISSING).all() and (rows[0, ::2] != MISSING).all()
    assert about["bands"] == [] and 'id="bands"' not in html and "rig-table" not in html
    words = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", "", html))
    assert "▲ No moving figure can be made of this clip" in words
    assert "fit writes no BVH and no GLB of this clip" in words
    for untrue in ("The figure is the rigid one", "bones of constant length", "bands above"):
        assert untrue not in words, untrue
    assert "The figure is the rigid one" in page(shown("gaps"))
    assert "bands above" not in page(shown("range_of_motion"))


def test_the_line_at_the_top_is_the_worst_finding_and_the_others_follow_in_order():
    one = shown("gaps")
    found = findings(one.fit, moving(one.fit))
    html = page(one)
    short = re.search(r'<p id="short">(.*?)</p>', html, re.S)[1]
    behind = re.findall(
        r"<li>(.*?)</li>", re.search(r'<ol id="findings">(.*?)</ol>', html, re.S)[1]
    )
    assert len(found) > 1
    for finding, place in zip(found, [short, *behind], strict=True):
        assert escape(finding.words) in place
        assert (f'data-frame="{finding.frame}"' in place) == (finding.frame is not None)
    badness = [finding.badness for finding in found]
    assert badness == sorted(badness, reverse=True) and badness[-1] > 0
    # A marker 31 cm off is worse than one 5 cm off, and labels that look exchanged are worse than either.
    quality = moving(one.fit).quality
    worst = dataclasses.replace(
        quality.segments[3], look_at=("worst",), worst=0.31, worst_frame=7, worst_marker="M"
    )
    less = dataclasses.replace(worst, segment=quality.segments[4].segment, worst=0.05)
    played = SimpleNamespace(quality=dataclasses.replace(quality, segments=(less, worst)))
    sure = tuple(
        dataclasses.replace(joint, covariance=1e-6 * np.eye(3), doubt="")
        for joint in one.fit.joints
    )
    first, second = findings(dataclasses.replace(one.fit, joints=sure), played)
    assert "31 cm" in first.words and "5.0 cm" in second.words and first.frame == 7
    assert first.badness == pytest.approx(0.31 / 0.04)
    doubted = (dataclasses.replace(sure[0], doubt="exchanged"), *sure[1:])
    first, *_ = findings(dataclasses.replace(one.fit, joints=doubted), played)
    assert first.words.startswith("Check the labels first")


def test_each_kind_of_band_has_its_words_and_a_colour_that_is_seen_on_either_ground():
    bands = [Band(kind, 10 * i, 10 * i + 4, ("Head",)) for i, kind in enumerate(KINDS)]
    drawn, key = strip(bands, 100, 1), legend(bands)
    style = page(shown("nearly_still")).split("</style>")[0]
    light, dark = re.findall(r"--panel: (#\w+)", style)
    for kind in KINDS:
        assert f'<rect class="{kind}"' in drawn and f'data-kind="{kind}"' in key
        assert f"rect.{kind} {{ fill: var(" in style and f"#legend .{kind}::before" in style
        name = "alarm-ball" if kind == "without" else kind
        for ground, colour in zip(
            (light, dark), re.findall(rf"--{name}: (#\w+)", style), strict=True
        ):
            high, low = sorted([luminance(ground), luminance(colour)], reverse=True)
            # WCAG 2.1, 1.4.11: what is drawn.
            assert (high + 0.05) / (low + 0.05) >= 3.0, (kind, ground)


@in_chromium
def test_a_file_full_of_tricks_only_shows_them_as_text(tmp_path):
    path = tmp_path / "page.html"
    path.write_text(page(nasty()), encoding="utf-8")
    with Browser(tmp_path / "profile") as browser:
        browser.open(path)
        assert browser.run("document.images.length") == 0
        # What is written by the script: names beside the joints, and what is picked.
        browser.run("document.querySelector('#labels').click()")
        browser.run(
            "mocapSkel.pick(mocapSkel.data.about.joints.findIndex((j) => j.name.includes('<img')))"
        )
        for place in ("h1", "#names", "#picked"):
            assert "<img src=x onerror=alert(1)>" in browser.run(
                f"document.querySelector('{place}').textContent"
            )
        assert browser.run("document.images.length") == 0
        assert browser.messages == []
        assert browser.requests == [path.resolve().as_uri()]
