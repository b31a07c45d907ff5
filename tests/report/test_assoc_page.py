"""The page of an association in a real browser: markers are picked, named and saved, and the file fits."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from commands import call, files, run
from labelled import CLIP, CMU, RECORDING, more, on, renamed
from recordings import SAMPLES

from mocap_skel import associate, read_association, read_clip
from mocap_skel.artificial.write import write_c3d
from mocap_skel.errors import CallError
from mocap_skel.pipeline.job import Job
from mocap_skel.pipeline.naming import name_markers
from mocap_skel.pipeline.page_start import page_start
from mocap_skel.report.assoc_page import MOST_FRAMES, assoc_page
from mocap_skel.report.scene import MISSING, unpack
from mocap_skel.results.assoc_start import start_from_file, start_from_guess

NASTY = "</script><img src=x onerror=alert(1)>\u202e&"
LEG = ("THI", "KNE", "SHN", "ANK", "HEE", "TOE", "MT5")
SIDES = ("Left", "Right")
in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


def opened(browser, folder, clip, start=None):
    """The page of a clip, standing still in its first frame."""
    path = folder / "page.html"
    path.write_text(assoc_page(clip, start or start_from_guess(clip)), encoding="utf-8")
    browser.open(path)
    browser.run("mocapSkel.play(false); mocapSkel.go(0)")
    browser.wait("mocapSkel.drawn === 0")
    return path


def read_back(text, folder):
    (folder / "map.txt").write_text(text, encoding="utf-8")
    return read_association(folder / "map.txt")


def rules(association):
    return {rule.label: (rule.marker, rule.segment) for rule in association.rules}


def place(browser, column):
    """Where a marker is in the window, in pixels."""
    return browser.run(
        "(() => { mocapSkel.draw(); const { left, top } = document.querySelector('canvas').getBoundingClientRect();"
        f"const [x, y] = mocapSkel.stage.screen(mocapSkel.cloud.markerPlaces[{column}]); return [left + x, top + y] }})()"
    )


def drag(browser, start, end, shift=False):
    held = {"button": "left", "clickCount": 1, "modifiers": 8 if shift else 0, "buttons": 1}
    for kind, (x, y) in (
        ("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end),
    ):  # fmt: skip
        browser.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **held)


def selected(browser):
    return sorted(browser.run("[...mocapSkel.selected]"))


def type_name(browser, name):
    """What typing into the field and leaving it does."""
    browser.run(
        f"(() => {{ const field = document.querySelector('#name'); field.value = {json.dumps(name)};"
        "field.dispatchEvent(new Event('change')) })()"
    )


def test_the_page_has_at_most_so_many_frames_and_their_places():
    clip = read_clip(SAMPLES / "range_of_motion.c3d")
    html = assoc_page(clip, start_from_guess(clip))
    scene, samples = (
        re.search(rf'<script type="[a-z/]+" id="{name}">(.*?)</script>', html, re.S)[1]
        for name in ("scene", "samples")
    )
    about = json.loads(scene)
    assert about["frames"] <= MOST_FRAMES and about["every"] == -(-clip.frames // MOST_FRAMES)
    rows = unpack(base64.b64decode(samples), about["frames"])
    steps = rows.reshape(-1, 3, about["frames"]).transpose(2, 0, 1)[:, : len(clip.labels)]
    lab = np.where(steps == MISSING, np.nan, steps * about["step"])
    lab += np.array(about["middle"])[: len(clip.labels)]
    np.testing.assert_allclose(lab, clip.points[:: about["every"]], atol=about["step"] / 2 + 1e-6)
    # Level, and of length one.
    assert np.linalg.norm(about["front"]) == pytest.approx(1, abs=1e-3) and about["front"][2] == 0


def test_the_command_writes_a_page_and_never_over_another_file(tmp_path):
    done = run("assoc", "page", SAMPLES / "nearly_still.c3d", "-o", "page.html", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "wrote page.html\n")
    assert "41 of 41 labels placed" in done.stderr
    again = run("assoc", "page", SAMPLES / "nearly_still.c3d", "-o", "page.html", cwd=tmp_path)
    assert again.returncode == 2 and "--overwrite" in again.stderr
    assert files(tmp_path) == ["page.html"]


@in_chromium
def test_labels_that_say_nothing_become_a_file_that_fits_as_the_shipped_one(tmp_path):
    cmu = read_association("cmu").rules
    numbers = {label: f"{i} #" for i, label in enumerate(RECORDING.labels)}
    write_c3d(RECORDING, tmp_path / "named.c3d")
    write_c3d(replace(RECORDING, labels=tuple(numbers.values())), tmp_path / "walk.c3d")
    clip = read_clip(tmp_path / "walk.c3d")
    with Browser(tmp_path / "profile") as browser:
        opened(browser, tmp_path, clip)
        assert "0 of 41 markers placed" in browser.run(
            "document.querySelector('#counts').textContent"
        )
        for rule in cmu:
            column = RECORDING.labels.index(rule.label)
            browser.run(f"document.querySelector('[data-marker=\"{column}\"]').click()")
            browser.run(
                f"(() => {{ const one = document.querySelector('#segment'); one.value = '{rule.segment}';"
                "one.dispatchEvent(new Event('change')) })()"
            )
            type_name(browser, rule.marker)
        saved = tmp_path / "saved"
        browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(saved))
        browser.run("document.querySelector('#save').click()")
        browser.wait("document.querySelector('#state').textContent === 'saved'")
        text = browser.run("mocapSkel.text()")
        # The file is there when the browser has written it.
        browser.wait("new Promise((done) => setTimeout(() => done(true), 500))")
        assert browser.messages == []
    assert (saved / "map.txt").read_text(encoding="utf-8") == text
    found = rules(read_association(saved / "map.txt"))
    assert found == {numbers[rule.label]: (rule.marker, rule.segment) for rule in cmu}
    for name, association, folder in (("named", "cmu", "a"), ("walk", saved / "map.txt", "b")):
        done = call(
            "fit", f"{name}.c3d", "--assoc", association, "-o", folder, "--format", "csv", "--format", "bvh",
            cwd=tmp_path,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    written = files(tmp_path / "a")
    assert len(written) >= 3
    for one in written:
        other = one.replace("named", "walk")
        # Tables name the clip in no line; a BVH has no name at all.
        assert (tmp_path / "a" / one).read_bytes() == (tmp_path / "b" / other).read_bytes(), one


@in_chromium
def test_a_clip_of_two_legs_has_both_on_its_page_and_the_saved_file_fits_both(tmp_path):
    legs = [i for i, x in enumerate(CLIP.labels) if x[1:] in LEG]
    clip = replace(CLIP, points=CLIP.points[:, legs], labels=tuple(CLIP.labels[i] for i in legs),
                   subjects=("",) * len(legs))  # fmt: skip
    rng = np.random.default_rng(1)
    clip = more(clip, {f"{s[0]}GTR": on(f"Upper{s}Leg", [0.06, 0.02, -0.05], rng) for s in SIDES})
    shown, start = page_start(clip, Job(None))
    assert (start.figure, start.doubts) == ("human", ())
    assert "of the figure left_leg and right_leg" in start.said
    with Browser(tmp_path / "profile") as browser:
        opened(browser, tmp_path, shown, start)
        counts = browser.run("document.querySelector('#counts').textContent")
        assert "16 of 16 markers placed" in counts
        saved = read_back(browser.run("mocapSkel.text()"), tmp_path)
    assert {rule.segment for rule in saved.rules} == {CMU[clip.labels[i]][0] for i in range(14)}
    told, guessed = name_markers(clip, saved), name_markers(clip, None)
    assert told.clip.subjects == guessed.clip.subjects
    for one, other in zip(told.associations, guessed.associations, strict=True):
        assert (one.skeleton.name, rules(one)) == (other.skeleton.name, rules(other))


def test_the_page_begins_with_what_a_fit_takes_or_with_what_is_not_enough_for_one(monkeypatch):
    few = renamed(CLIP, {label: f"x{i}" for i, label in enumerate(CLIP.labels) if i % 3})
    with pytest.raises(CallError, match="not sure"):
        Job(None).named(few)
    _, start = page_start(few, Job(None))
    assert 0 < sum(bool(p.segment) for p in start.placed) < 41
    assert "of 41 labels placed" in start.said
    # A shipped file that knows more of them is what a fit takes, and the page.
    numbers = {label: f"C{i}" for i, label in enumerate(CLIP.labels)}
    rules = tuple(replace(r, label=numbers[r.label]) for r in read_association("cmu").rules)
    shipped = replace(read_association("cmu"), rules=rules)
    monkeypatch.setattr("mocap_skel.labels.shipped._all", lambda: {"numbers": shipped})
    clip, start = page_start(renamed(CLIP, numbers), Job(None))
    assert "the shipped file numbers has 41 labels of the clip" in start.said
    assert {p.segment for p in start.placed} == {r.segment for r in rules} and start.doubts == ()
    assert clip.labels == tuple(numbers.values())


@in_chromium
def test_where_the_guess_knows_nothing_the_page_says_where_to_begin_and_nothing_is_lost(tmp_path):
    clip = replace(CLIP, labels=tuple(f"{i} #" for i in range(41)))
    leaves = (
        "(() => { const event = new Event('beforeunload', { cancelable: true }); dispatchEvent(event);"
        "return !event.defaultPrevented })()"
    )
    with Browser(tmp_path / "profile") as browser:
        opened(browser, tmp_path, clip)
        assert browser.run("document.querySelector('#step').textContent").startswith(
            "No label is known yet. Begin with these"
        )
        browser.run("document.querySelector('#next').click()")
        group = selected(browser)
        # They are on one segment, which is what moving together means.
        cmu = rules(read_association("cmu"))
        assert len(group) > 2 and len({cmu[CLIP.labels[i]][1] for i in group}) == 1
        assert browser.run(leaves) is True
        browser.run("mocapSkel.place('Chest')")
        assert browser.run(leaves) is False
        browser.run("mocapSkel.undo()")
        assert browser.run(leaves) is True
        browser.run("mocapSkel.place('Chest')")
        browser.call("Page.setDownloadBehavior", behavior="deny")
        browser.run("document.querySelector('#save').click()")
        assert browser.run(leaves) is True
        # Going back behind what was saved is a change again.
        browser.run("mocapSkel.undo()")
        assert browser.run(leaves) is False
        browser.run("mocapSkel.select([])")
        assert "No label is known" in browser.run("document.querySelector('#step').textContent")
        browser.run("mocapSkel.place('Chest', [0]); mocapSkel.select([])")
        assert "40 markers are not placed" in browser.run(
            "document.querySelector('#step').textContent"
        )


@in_chromium
@pytest.mark.parametrize("size", [(390, 844), (844, 390)])
def test_on_a_phone_nothing_is_cut_off_and_the_help_is_there(tmp_path, size):
    with Browser(tmp_path / "profile", *size) as browser:
        opened(browser, tmp_path, CLIP)
        assert browser.run("document.documentElement.scrollWidth") <= size[0]
        view, play, help_ = browser.run(
            "['#view', '#play', '#help summary'].map((one) => document.querySelector(one).getBoundingClientRect())"
            ".map((box) => [box.height, box.bottom])"
        )
        assert view[0] >= 140 and view[1] < size[1] and play[1] <= size[1] and help_[0] > 0


@in_chromium
def test_an_exchange_is_listed_put_right_measured_and_undone(tmp_path):
    clip = renamed(CLIP, {"LKNE": "RFIN", "RFIN": "LKNE"})
    start = start_from_file(clip, read_association("cmu"))
    with Browser(tmp_path / "profile") as browser:
        opened(browser, tmp_path, clip, start)
        before = browser.run("mocapSkel.text()")
        browser.run("document.querySelector('[data-doubt]').click()")
        pair = sorted(clip.labels.index(label) for label in ("LKNE", "RFIN"))
        assert selected(browser) == pair
        browser.run(
            "mocapSkel.pick(mocapSkel.data.about.markers.findIndex((m) => m.label === 'RFIN'))"
        )
        # It is offered to the segment that it moves with, first.
        assert browser.run("document.querySelector('[data-fit]').dataset.fit") == "UpperLeftLeg"
        # The other one had that name: the two are exchanged.
        type_name(browser, "LKNE")
        said = browser.run("document.querySelector('#change').textContent")
        was, now = map(float, re.search(r"UpperLeftLeg: ([\d.]+) mm → ([\d.]+) mm", said).groups())
        # Noise of 1 mm in two markers: their distance has a standard deviation of √2 mm, to a tenth of it.
        assert was > 50 and now == pytest.approx(2**0.5, rel=0.15)
        right = rules(read_back(browser.run("mocapSkel.text()"), tmp_path))
        assert right["RFIN"] == ("LKNE", "UpperLeftLeg") and right["LKNE"] == ("RFIN", "RightHand")
        assert "0 of 1 left" in browser.run("document.querySelector('#doubts-head').textContent")
        browser.run("document.querySelector('#undo').click()")
        assert browser.run("mocapSkel.text()") == before
        assert browser.run("document.querySelector('#undo').disabled") is True
    assert rules(read_back(before, tmp_path)) == rules(read_association("cmu"))


@in_chromium
def test_markers_are_picked_in_the_picture_by_mouse_box_and_finger(tmp_path):
    clip = replace(CLIP, labels=tuple(f"m{i}" for i in range(41)))
    with Browser(tmp_path / "profile") as browser:
        opened(browser, tmp_path, clip)
        browser.run("document.querySelector('[data-view=front]').click()")
        head = sorted(CLIP.labels.index(x) for x in ("LFHD", "RFHD", "LBHD", "RBHD"))
        at = place(browser, head[0])
        drag(browser, at, at)
        assert selected(browser)[0] in head
        assert browser.run(
            "mocapSkel.cloud.trails.visible || (mocapSkel.draw(), mocapSkel.cloud.trails.visible)"
        )
        camera = "mocapSkel.stage.camera.position.toArray().map((x) => x.toFixed(4)).join()"
        stood = browser.run(camera)
        corners = np.array([place(browser, i) for i in head])
        browser.press("Escape")
        assert selected(browser) == []
        drag(browser, (corners.min(0) - 12).tolist(), (corners.max(0) + 12).tolist(), shift=True)
        assert selected(browser) == head
        # The box is drawn in place of a turn of the camera; without shift the drag turns it, and picks nothing.
        assert browser.run(camera) == stood
        drag(browser, [60, 300], [160, 320])
        browser.wait(f"{camera} !== '{stood}'")
        assert selected(browser) == head
        browser.run("mocapSkel.place('Head')")
        found = rules(read_back(browser.run("mocapSkel.text()"), tmp_path))
        assert found == {f"m{i}": (f"m{i}", "Head") for i in head}
        # One finger on a marker; the group that moves with it.
        browser.press("Escape")
        x, y = place(browser, head[1])
        browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
        browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        browser.wait("mocapSkel.selected.size === 1")
        assert selected(browser)[0] in head
        browser.run("document.querySelector('#mates').click()")
        assert selected(browser) == head
        browser.run("document.querySelector('#ignore').click()")
        ignored = read_back(browser.run("mocapSkel.text()"), tmp_path).ignored
        assert sorted(ignored) == sorted(f"m{i}" for i in head)
        assert browser.messages == []


@in_chromium
def test_keys_step_play_and_undo_but_not_while_a_name_is_typed(tmp_path):
    with Browser(tmp_path / "profile") as browser:
        opened(browser, tmp_path, CLIP)
        browser.press("ArrowRight")
        browser.wait("mocapSkel.drawn === 1")
        browser.press(" ", "Space")
        assert browser.run("mocapSkel.playing") is True
        browser.press(" ", "Space")
        browser.run(
            "mocapSkel.pick(0); mocapSkel.ignore(); document.querySelector('#unplace').click()"
        )
        browser.run("mocapSkel.place('Hips')")
        browser.run("document.querySelector('#name').focus()")
        browser.press(" ", "Space")
        assert browser.run("mocapSkel.playing") is False
        browser.run("document.activeElement.blur()")
        browser.call("Input.dispatchKeyEvent", type="keyDown", key="z", code="KeyZ", modifiers=2)
        assert browser.run("mocapSkel.assignment.now[0].segment") == ""


@in_chromium
def test_odd_names_are_text_on_the_page_and_whole_in_the_file(tmp_path):
    odd = [NASTY, "a b", "x#y", "@skeleton", "ignore", "[ab]*?", "élan", "_own", "LKNE"]
    labels = (*odd, 'a "quote', "two\u2028lines", *CLIP.labels[11:])
    labels = (*labels[:11], *("other" if x == "LKNE" else x for x in labels[11:]))
    clip = replace(CLIP, name=f"{NASTY}.c3d", labels=labels)
    with Browser(tmp_path / "profile") as browser:
        path = opened(browser, tmp_path, clip)
        browser.run("mocapSkel.select([...Array(11).keys()]); mocapSkel.place('Hips')")
        browser.run(
            "document.querySelector('#labels').click(); document.querySelector('#text').open = true"
        )
        text = browser.run("mocapSkel.text()")
        browser.run("mocapSkel.ignore()")
        ignoring = browser.run("mocapSkel.text()")
        for column in (0, 9):
            browser.run(f"mocapSkel.select([{column}])")
        assert "cannot stand in an association file" in browser.run(
            "document.querySelector('#chosen').textContent"
        )
        for where in ("h1", "#names", "#segments"):
            shown = browser.run(f"document.querySelector('{where}').textContent")
            assert "<img src=x onerror=alert(1)>" in shown and "\u202e" not in shown
        assert browser.run("document.images.length") == 0
        assert browser.messages == [] and browser.requests == [path.resolve().as_uri()]
    # A pattern of one label takes that label alone, though it is one that others look like.
    (assignment,) = associate(clip, read_back(ignoring, tmp_path))
    assert set(assignment.ignored) == set(odd[:-1]) | {"LKNE"}
    found = rules(read_back(text, tmp_path))
    assert {label: found[label][1] for label in odd} == dict.fromkeys(odd, "Hips")
    assert found["LKNE"][0] == "LKNE_own" and found[NASTY][0] == NASTY


@in_chromium
def test_two_subjects_share_a_file_until_they_differ(tmp_path):
    clip = read_clip(SAMPLES / "two_dancers.c3d")
    cmu = rules(read_association("cmu"))
    with Browser(tmp_path / "profile") as browser:
        opened(browser, tmp_path, clip)
        choose = "(() => {{ const one = document.querySelector('#subject'); one.value = {}; one.dispatchEvent(new Event('change')) }})()"
        seen = "mocapSkel.cloud.markerPlaces.map((p, i) => (p.seen ? i : -1)).filter((i) => i >= 0)"
        browser.run(choose.format(1))
        browser.run("mocapSkel.draw()")
        assert {clip.subjects[i] for i in browser.run(seen)} == {"Ben"}
        column = [f"{s}:{x}" for s, x in zip(clip.subjects, clip.labels, strict=True)].index(
            "Ben:T10"
        )
        browser.run(f"mocapSkel.pick({column}); mocapSkel.ignore()")
        assert browser.run("mocapSkel.fileName") == "map.txt"
        both = read_back(browser.run("mocapSkel.text()"), tmp_path)
        assert rules(both) == {x: y for x, y in cmu.items() if x != "T10"}
        assert [one.ignored for one in associate(clip, both)] == [("T10",), ("T10",)]
        # From now on for Ben alone: his labels have his prefix, and Anna's are not in his file.
        browser.run(
            "mocapSkel.undo(); document.querySelector('#together').click(); mocapSkel.ignore()"
        )
        assert browser.run("mocapSkel.fileName") == "map.Ben.txt"
        (ben,) = associate(clip, read_back(browser.run("mocapSkel.text()"), tmp_path))
        assert ben.subject == "Ben" and sum(map(len, ben.columns.values())) == 40
        browser.run(choose.format(0))
        assert browser.run("mocapSkel.fileName") == "map.Anna.txt"
        (anna,) = associate(clip, read_back(browser.run("mocapSkel.text()"), tmp_path))
        assert anna.subject == "Anna" and sum(map(len, anna.columns.values())) == 41


@in_chromium
def test_what_this_clip_does_not_show_stays_in_the_file(tmp_path):
    path = tmp_path / "lab.txt"
    path.write_text(
        "@skeleton right_leg\nRTHI RTHI\nRKNE RKNE\nGONE RANK\nRHEE mine RightFoot\nignore *HD\n"
    )
    given = read_association(path)
    with Browser(tmp_path / "profile") as browser:
        opened(browser, tmp_path, CLIP, start_from_file(CLIP, given))
        back = read_back(browser.run("mocapSkel.text()"), tmp_path)
    assert rules(back) == rules(given)
    assert (back.ignored, back.figure) == (given.ignored, "right_leg")
