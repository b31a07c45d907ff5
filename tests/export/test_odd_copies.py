"""Copies of files as few write them: other machines, bytes behind the frames, too many points, too long lists."""

import struct
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from c3d_bytes import BLOCK, c3d_file, parameter
from recordings import SAMPLES, fit_clip

from mocap_skel import read_clip
from mocap_skel.errors import ExportError
from mocap_skel.export.c3d_copy import c3d_copy
from mocap_skel.export.parameters import MOST_TEXTS, Parameters
from mocap_skel.readers.formats.c3d.survey import survey


@cache
def still():
    """The first 40 frames of a bundled clip."""
    clip = read_clip(SAMPLES / "nearly_still.c3d")
    return replace(clip, points=clip.points[:40])


def written(path, **more):
    """That clip as a file, byte by byte; millimetres."""
    clip = still()
    seen = np.isfinite(clip.points[..., 0])
    points = np.where(seen[..., None], 1000 * clip.points, 0.0)
    residuals = np.where(seen, 0.0, -1.0)
    names = list(clip.labels)
    c3d_file(path, points, residuals=residuals, rate=clip.rate, LABELS=names, **more)
    return path


def copied(path):
    clip = read_clip(path)
    fit = fit_clip(clip)
    made, notes = c3d_copy(fit, clip, path)
    target = path.with_name("copy.c3d")
    target.write_bytes(made)
    return fit, target, notes


@pytest.mark.parametrize("machine", ["INTEL", "DEC", "MIPS"])
@pytest.mark.parametrize("scale", [-1.0, 0.1])
def test_numbers_of_every_machine_are_added_to(tmp_path, machine, scale):
    source = written(tmp_path / "a.c3d", machine=machine, scale=scale)
    fit, target, _ = copied(source)
    here, there = survey(source), survey(target)
    assert (there.layout.machine, there.layout.width) == (machine, here.layout.width)
    count = here.layout.points
    points = there.read(0, 40)[..., :3] * (scale if scale > 0 else 1.0)
    for place, (_, track) in enumerate(fit.tracks(), count):
        # Half a step of integers in millimetres, or the rounding of 32 bits; the reader's own is 32 bits too.
        np.testing.assert_allclose(
            points[:, place], 1000 * track, atol=0.0501 if scale > 0 else 2e-4
        )
    order = ">H" if machine == "MIPS" else "<H"
    head = target.read_bytes()[:BLOCK]
    assert struct.unpack_from(order, head, 2) == (count + len(list(fit.tracks())),)
    (block,) = struct.unpack_from(order, head, 16)
    assert (block - 1) * BLOCK == there.layout.start
    assert target.stat().st_size % BLOCK == 0


def test_what_stands_behind_the_frames_is_taken_along(tmp_path):
    tail = bytes(range(256)) * 8
    source = written(tmp_path / "a.c3d", tail=tail)
    _, target, _ = copied(source)
    assert target.read_bytes().rstrip(b"\0").endswith(tail)
    assert read_clip(target).frames == 40


def test_a_file_with_fewer_descriptions_than_points_gets_those_of_the_new_ones_in_their_places(
    tmp_path,
):
    source = written(tmp_path / "a.c3d", DESCRIPTIONS=["first", "second"])
    fit, target, _ = copied(source)
    group = survey(target).section.groups["POINT"]
    said = group["DESCRIPTIONS"]
    own = len(still().labels)
    assert [text.strip() for text in said[:3]] == ["first", "second", ""]
    assert said[own].startswith("joint centre by mocap-skel") and len(said) == own + len(
        list(fit.tracks())
    )


def test_zeros_before_the_header_are_not_copied(tmp_path):
    source = tmp_path / "a.c3d"
    source.write_bytes(bytes(BLOCK) + written(tmp_path / "b.c3d").read_bytes())
    with pytest.raises(ExportError, match=f"{BLOCK} zeros stand before its header") as caught:
        copied(source)
    assert "the other formats hold the skeleton" in caught.value.hint


def test_no_two_points_of_a_copy_have_one_label(tmp_path, monkeypatch):
    source = written(tmp_path / "a.c3d")
    clip = read_clip(source)
    fit = fit_clip(clip)
    # A joint that is called as a segment's origin is, and a label that stands in the file's second list.
    named = replace(fit, joints=(replace(fit.joints[0], joint="Hips_O"), *fit.joints[1:]))
    real = survey(source)
    point = real.section.groups["POINT"] | {"LABELS2": ["Anna:LeftHip"]}
    found = replace(
        real, section=replace(real.section, groups=real.section.groups | {"POINT": point})
    )
    monkeypatch.setattr(
        "mocap_skel.export.c3d_copy.survey", lambda path: found if path == source else survey(path)
    )
    _, notes = c3d_copy(named, clip, source, axes=True)
    assert "C3D: labels that the file has already get a number: LeftHip_2, Hips_O_2" in notes


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda s: replace(s, layout=replace(s.layout, points=0xFFFF)),
            "65555 points a frame are more than the format has numbers for",
        ),
        (
            lambda s: replace(
                s, section=replace(s.section, groups=s.section.groups | {"ROTATION": {"USED": [2]}})
            ),
            "rotations beside its points",
        ),
        (
            lambda s: replace(s, section=replace(s.section, start=s.layout.start + BLOCK)),
            "its parameters stand behind its points",
        ),
        (
            lambda s: replace(s, section=replace(s.section, faults=("a \x1b[2J name",))),
            r"damaged parameters \(a \?\[2J name\)",
        ),
    ],
    ids=["too many points", "rotations", "parameters behind", "faults"],
)
def test_what_the_survey_finds_and_no_copy_can_keep_is_refused(
    tmp_path, monkeypatch, change, words
):
    source = written(tmp_path / "a.c3d")
    clip = read_clip(source)
    fit = fit_clip(clip)
    found = change(survey(source))
    monkeypatch.setattr("mocap_skel.export.c3d_copy.survey", lambda path: found)
    # So many labels would not fit either; that is another test.
    monkeypatch.setattr(Parameters, "set_texts", lambda *args: None)
    with pytest.raises(ExportError, match=words):
        c3d_copy(fit, clip, source)


FRONT = bytes([1, 80, 1, 84])


def group(name, number, locked=False):
    length = 256 - len(name) if locked else len(name)
    return bytes([length, 256 - number]) + name.encode() + struct.pack("<hb", 3, 0)


def section(*records):
    return Parameters(FRONT + b"".join(records) + b"\0\0", "INTEL")


def own(name, value):
    return parameter(1, name, value, "INTEL")


class TestParameters:
    def test_what_is_not_changed_stays_byte_for_byte(self):
        locked = group("POINT", 1, locked=True)
        data = FRONT + locked + own("USED", 3) + own("LABELS", ["A", "B"]) + b"\0\0"
        walk = Parameters(data, "INTEL")
        assert walk.to_bytes()[4 : len(data)] == data[4:]
        walk.set_number("USED", 5)
        at = data.index(b"USED") + 8
        want = data[:at] + struct.pack("<h", 5) + data[at + 2 :]
        assert walk.to_bytes()[4 : len(data)] == want[4:]

    def test_a_section_does_not_shrink(self):
        walk = Parameters(bytes([1, 80, 7, 84]) + group("POINT", 1) + b"\0\0", "INTEL")
        made = walk.to_bytes()
        assert len(made) == 7 * BLOCK and made[2] == 7

    def test_names_in_small_letters_are_the_same_names(self):
        walk = section(group("Point", 1), own("Used", 3))
        walk.set_number("USED", 5)
        assert own("Used", 5) in walk.to_bytes()

    def test_a_list_that_stays_the_same_is_left_alone_however_it_is_laid_out(self):
        # Two texts of two letters in three dimensions.
        plain = own("LABELS", ["AA", "BB"])
        (step,) = struct.unpack_from("<h", plain, 8)
        odd = plain[:8] + struct.pack("<hbB", step + 1, -1, 3) + bytes([2, 1, 2]) + b"AABB\0"
        walk = section(group("POINT", 1), odd)
        walk.set_texts("LABELS", [b"AA", b"BB"])
        assert odd in walk.to_bytes()

    def test_a_list_keeps_its_description_and_its_width(self):
        said = own("LABELS", ["AA", "BB"])
        # A description of four letters in place of none, and the step to the next entry longer by it.
        (step,) = struct.unpack_from("<h", said, 8)
        said = said[:8] + struct.pack("<h", step + 4) + said[10:-1] + b"\4NOTE"
        walk = section(group("POINT", 1), said)
        walk.set_texts("LABELS", [b"A", b"B", b"C"])
        assert walk.texts("LABELS") == [b"A ", b"B ", b"C "]
        assert walk.to_bytes().rstrip(b"\0").endswith(b"A B C \4NOTE")

    @pytest.mark.parametrize(
        ("records", "change", "words"),
        [
            ([group("ANALOG", 2)], None, "0 groups POINT"),
            ([group("POINT", 1), group("POINT", 2)], None, "2 groups POINT"),
            (
                [group("POINT", 1), own("USED", 1), own("USED", 2)],
                lambda p: p.set_number("USED", 3),
                "POINT:USED 2 times",
            ),
            (
                [group("POINT", 1), own("USED", "three")],
                lambda p: p.set_number("USED", 3),
                "POINT:USED cannot be 3",
            ),
            (
                [group("POINT", 1), own("LABELS", 3)],
                lambda p: p.texts("LABELS"),
                "POINT:LABELS is no list of text",
            ),
            (
                [group("POINT", 1)],
                lambda p: p.set_texts("LABELS", [b"x" * 256]),
                "POINT:LABELS would be too long",
            ),
            (
                [group("POINT", 1)],
                lambda p: p.set_texts("LABELS", [b"x" * 200] * 200),
                "POINT:LABELS would be too long",
            ),
        ],
    )  # fmt: skip
    def test_what_the_format_cannot_hold_is_refused(self, records, change, words):
        with pytest.raises(ExportError, match=words):
            change(section(*records))

    def test_a_byte_holds_no_more_than_127(self):
        byte = own("USED", 3).replace(b"\x02\x00\x03\x00", b"\x01\x00\x03", 1)
        (step,) = struct.unpack_from("<h", byte, 6)
        byte = byte[:6] + struct.pack("<h", step - 1) + byte[8:]
        walk = section(group("POINT", 1), byte)
        walk.set_number("USED", 127)
        with pytest.raises(ExportError, match="cannot be 128"):
            walk.set_number("USED", 128)

    def test_more_blocks_than_a_byte_counts_are_refused(self):
        walk = section(group("POINT", 1))
        for number in range(1, 9):
            walk.set_texts(f"LIST{'' if number == 1 else number}", [b"y" * 100] * MOST_TEXTS)
        with pytest.raises(ExportError, match="no room for more points"):
            walk.to_bytes()
