"""C3D write-back: a copy of the recording with the skeleton's points behind its own."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from mocap_skel.angles.joint_angles import anatomical_frames
from mocap_skel.clip import AXES, Clip
from mocap_skel.errors import ClipError, ExportError, OutputError
from mocap_skel.export.parameters import Parameters
from mocap_skel.readers import read_clip
from mocap_skel.readers.formats.c3d.contents import number
from mocap_skel.readers.formats.c3d.machine import encoded
from mocap_skel.readers.formats.c3d.point_lists import AXES_LIST, SKELETON_LIST
from mocap_skel.readers.formats.c3d.section import BLOCK
from mocap_skel.readers.formats.c3d.survey import Survey, survey
from mocap_skel.readers.units import metres_in
from mocap_skel.results.tables import axis_ends, track_kinds
from mocap_skel.segments.pose import Array
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import counted, listed, printable, stem

# Metres from a segment's origin to the tips of its axes.
AXIS = 0.1
_SAID = {"joint": "joint centre", "origin": "segment origin", "end": "segment end"}
_INTEGERS = np.iinfo(np.int16)
_ELSEWHERE = "the other formats hold the skeleton without the file"


@dataclass(frozen=True, eq=False)
class _Point:
    """A point to add.

    Attributes:
        label: without the subject.
        track: (frames, 3), metres in the clip's axes, NaN = missing.
        said: its description.
        among: the parameter that lists it.
    """

    label: str
    track: Array
    said: str
    among: str = SKELETON_LIST


def c3d_copy(
    fit: SkeletonFit,
    clip: Clip,
    path: Path,
    *,
    axes: bool = False,
    static: SkeletonFit | None = None,
) -> tuple[bytes, tuple[str, ...]]:
    """The recording's file with more points: the tracks of skeleton.csv, in the file's unit and axes.

    Nothing else changes: analog values, parameters, events, frame numbers and the old points are
    copied byte for byte. POINT:JOINT_CENTRES and POINT:SEGMENT_AXES list the new points, so that a
    reader can tell them from markers; their descriptions say whether the movement shows the joint. A label that the
    file has already gets a number: LeftHip_2.

    Args:
        fit: in the clip's own axes.
        clip: what it was fitted to, as read from `path`.
        path: the file.
        axes: also each segment's origin and the tips of its anatomical axes, 10 cm away: Hips_O, _X, _Y, _Z. The
            origin is the joint towards the parent. A segment without anatomical axes has those of its pose. Where
            the clip shows the axis on which a joint turns, also its tip, 10 cm from the joint: LeftKnee_A.
        static: the subject in a static clip, whose landmarks count too.

    Returns:
        The file's content, and notes.

    Raises:
        ExportError: the file is damaged, or cut off, or says too much that is wrong of itself.
        OutputError: there is no place for a temporary file.
    """
    try:
        found = survey(path)
        content = path.read_bytes()[found.base :]
    except (OSError, ClipError) as error:
        if stem(path) != path.stem or path.suffix.lower() != ".c3d":
            raise ExportError(
                f"{path}: a copy with the skeleton's points needs an unpacked C3D file"
            ) from error
        raise ExportError(f"{path}: cannot be read once more: {error}") from error
    try:
        frames = _frames(found, clip, content)
        points = [*_tracks(fit), *(_axes(fit, static) if axes else ())]
        labels, notes = _labels(fit, points, found)
        parameters = Parameters(content[found.section.start :], found.layout.machine)
        _tell(parameters, found, points, labels)
        data, lost = _values(points, found, clip)
        if lost:
            notes.append(f"C3D: samples that its integers cannot hold, left out: {lost}")
        if found.layout.width == 2:
            step = found.scale * (metres_in(clip.unit) or 1.0) * 1000
            notes.append(f"C3D: the file has integers, so the skeleton is rounded to {step:.3g} mm")
        made = _joined(found, content, parameters, frames, data)
    except ExportError as error:
        raise ExportError(f"{path}: {error.message}", error.hint or _ELSEWHERE) from error
    _check(made, found, clip, data)
    return made, tuple(notes)


def _frames(found: Survey, clip: Clip, content: bytes) -> NDArray[np.uint8]:
    """The file's frames as bytes, (frames, stride), without the padding of its last block.

    Raises:
        ExportError: points cannot be added without making wrong what is wrong already.
    """
    layout, section = found.layout, found.section
    hint = f"a copy would only carry the damage on; {_ELSEWHERE}"
    if section.faults:
        fault = printable(section.faults[0])
        raise ExportError(f"damaged parameters ({fault}) are not written anew", hint)
    if found.base:
        raise ExportError(f"{found.base} zeros stand before its header", hint)
    if layout.room < layout.declared or clip.frames < layout.sure:
        whole = min(layout.room, clip.frames)
        raise ExportError(
            f"it says {layout.declared} frames, of which {whole} were read: not copied", hint
        )
    if number(section.groups.get("ROTATION", {}).get("USED")):
        raise ExportError("it holds rotations beside its points")
    if section.start > layout.start:
        raise ExportError("its parameters stand behind its points")
    flat = np.frombuffer(content, np.uint8)[layout.start :][: clip.frames * layout.stride]
    flat = np.pad(flat, (0, clip.frames * layout.stride - len(flat)))
    return flat.reshape(clip.frames, layout.stride)


def _tracks(fit: SkeletonFit) -> Iterable[_Point]:
    shown = {joint.joint: joint.shown for joint in fit.joints}
    for name, kind, track in track_kinds(fit):
        verdict = f", shown: {shown[name]}" if kind == "joint" else ""
        yield _Point(name, track, f"{_SAID[kind]} by mocap-skel{verdict}")


def _axes(fit: SkeletonFit, static: SkeletonFit | None) -> Iterable[_Point]:
    anatomical = anatomical_frames(fit, static)
    for segment in fit.segments.values():
        pose, found = segment.pose, anatomical.get(segment.name)
        origin = pose.origin if segment.joint is None else pose.to_lab(segment.joint)
        turn = pose.rotation if found is None else pose.rotation @ found.axes
        kind = "segment" if found is None else "anatomical"
        yield _Point(f"{segment.name}_O", origin, "segment origin by mocap-skel", AXES_LIST)
        for axis, name in enumerate("XYZ"):
            tip = origin + AXIS * turn[:, :, axis]
            said = f"{kind} {name.lower()} axis by mocap-skel"
            yield _Point(f"{segment.name}_{name}", tip, said, AXES_LIST)
    for joint in fit.joints:
        ends = axis_ends(fit, joint, AXIS)
        if ends is not None and joint.turns_on is not None:
            error = np.degrees(joint.turns_on.standard_error)
            said = f"axis of {joint.joint} by mocap-skel, s.e. {error:.1f} degrees"
            yield _Point(f"{joint.joint}_A", ends[1], said, AXES_LIST)


def _labels(fit: SkeletonFit, points: list[_Point], found: Survey) -> tuple[list[str], list[str]]:
    """The points' labels, which no other point has, whosever it is; and a note on changed ones."""
    group = found.section.groups.get("POINT", {})
    taken = {text.rpartition(":")[2].strip() for text in _every(group)}
    prefix = f"{fit.subject}:" if fit.subject else ""
    labels, changed = [], []
    for point in points:
        label, number_ = point.label, 2
        while label in taken:
            label = f"{point.label}_{number_}"
            number_ += 1
        if label != point.label:
            changed.append(label)
        taken.add(label)
        labels.append(prefix + label)
    if not changed:
        return labels, []
    return labels, [f"C3D: labels that the file has already get a number: {listed(changed)}"]


def _every(group: dict[str, object]) -> Iterable[str]:
    for name, value in group.items():
        if name.startswith("LABELS") and isinstance(value, list):
            yield from value


def _tell(parameters: Parameters, found: Survey, points: list[_Point], labels: list[str]) -> None:
    """What the parameters say of the new points."""
    here = found.layout.points
    for name, new in (("LABELS", labels), ("DESCRIPTIONS", [p.said for p in points])):
        # By their places: some files have fewer texts than points, some more.
        old = parameters.texts(name)
        old += [b""] * (here - len(old))
        rows = [*old[:here], *(text.encode() for text in new), *old[here:]]
        parameters.set_texts(name, rows)
    for name in (SKELETON_LIST, AXES_LIST):
        mine = [label for label, p in zip(labels, points, strict=True) if p.among == name]
        if mine:
            before = parameters.texts(name)
            rows = [*before, *(text.encode() for text in mine)]
            parameters.set_texts(name, rows, "points computed by mocap-skel, no markers")
    parameters.set_number("USED", here + len(points))


def _values(points: list[_Point], found: Survey, clip: Clip) -> tuple[NDArray[np.generic], int]:
    """(frames, points, 4) as the file has them, and how many samples its integers cannot hold."""
    tracks = np.stack([p.track for p in points], axis=1) / (metres_in(clip.unit) or 1.0)
    # The copy keeps the file's own axes, so what was negated for the fit is turned back.
    tracks = tracks * [-1.0 if axis == clip.mirror else 1.0 for axis in AXES]
    if found.layout.width == 2:
        tracks = np.round(tracks / found.scale)
    seen = np.isfinite(tracks).all(axis=2)
    lost = 0
    if found.layout.width == 2:
        with np.errstate(invalid="ignore"):
            held = (tracks >= _INTEGERS.min) & (tracks <= _INTEGERS.max)
        lost = int((seen & ~held.all(axis=2)).sum())
        seen &= held.all(axis=2)
    values = np.concatenate([tracks, np.zeros((*seen.shape, 1))], axis=2)
    values[~seen] = (0.0, 0.0, 0.0, -1.0)
    return values.astype(np.float32 if found.layout.width == 4 else np.int16), lost


def _joined(
    found: Survey,
    content: bytes,
    parameters: Parameters,
    frames: NDArray[np.uint8],
    data: NDArray[np.generic],
) -> bytes:
    layout, section = found.layout, found.section
    count = layout.points + data.shape[1]
    if count > 0xFFFF:
        raise ExportError(f"{count} points a frame are more than the format has numbers for")
    start = max(layout.start, section.start + len(parameters.to_bytes()))
    parameters.set_number("DATA_START", start // BLOCK + 1)
    front = bytearray((content[: section.start] + parameters.to_bytes()).ljust(start, b"\0"))
    order = ">" if layout.machine == "MIPS" else "<"
    struct.pack_into(f"{order}H", front, 2, count)
    struct.pack_into(f"{order}H", front, 16, start // BLOCK + 1)
    kind = "f4" if layout.width == 4 else "i2"
    new = np.frombuffer(encoded(data.ravel(), kind, layout.machine), np.uint8)
    new = new.reshape(len(frames), -1)
    own = 4 * layout.points * layout.width
    body = np.concatenate([frames[:, :own], new, frames[:, own:]], axis=1).tobytes()
    # Some files go on behind their frames.
    rest = content[layout.start + frames.size :]
    body += rest if len(rest) >= BLOCK else b""
    return bytes(front) + body + bytes(-len(body) % BLOCK)


def _check(made: bytes, found: Survey, clip: Clip, data: NDArray[np.generic]) -> None:
    """Read what would be written, as strictly as any file.

    Raises:
        ExportError: it is not the same clip with more points.
    """
    try:
        with TemporaryDirectory(prefix="mocap-skel-") as folder:
            copy = Path(folder) / "copy.c3d"
            copy.write_bytes(made)
            try:
                again = read_clip(copy, unit=clip.unit, rate=clip.rate, mirror=clip.mirror or None)
            except ClipError as error:
                why = error.message.removeprefix(f"{copy}: ")
                raise ExportError(
                    f"{found.path}: a copy of it could not be read: {why}", _ELSEWHERE
                ) from error
            there = survey(copy)
            new = there.read(0, clip.frames)[:, found.layout.points :]
    except OSError as error:
        raise OutputError(f"{error.filename or 'temporary file'}: {error.strerror}") from error
    ours, theirs = there.layout, found.layout
    same = (
        (ours.machine, ours.width, ours.analogs) == (theirs.machine, theirs.width, theirs.analogs)
        and ours.points == theirs.points + data.shape[1]
        and (again.labels, again.subjects) == (clip.as_read or (clip.labels, clip.subjects))
        and (again.first_frame, again.frames) == (clip.first_frame, clip.frames)
        and np.array_equal(new, data.astype(np.float32))
        # Two readers may have read them, one of them in 32 bits.
        and np.allclose(again.points, clip.points, rtol=1e-5, atol=1e-9, equal_nan=True)
    )
    if not same:
        what = counted(found.layout.points, "point")
        raise ExportError(
            f"{found.path}: what it says of its {what} is too doubtful to add some", _ELSEWHERE
        )
