"""A calibration as a file that people can read: JSON, its format with a version, lengths in metres."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mocap_skel.errors import CallError, ours
from mocap_skel.figure.skeleton import Skeleton
from mocap_skel.joints.calibration import (
    CalibratedJoint,
    Calibration,
    ClipEvidence,
    JointEvidence,
    Labels,
    Template,
)
from mocap_skel.joints.evidence import Evidence
from mocap_skel.joints.two_sided import SharedPoint
from mocap_skel.segments.pose import Array
from mocap_skel.spherefit import Moments
from mocap_skel.text import check_values, read_text, unreadable

FORMAT = "mocap-skel calibration 1"
LARGEST = 1 << 29
"""Bytes of a file that is read: one clip with all markers of a body has about 60,000. Picked by eye."""
# What is larger than any sum over a clip of numbers of metres, and still far from what a computer can hold.
_BEYOND = 1e30
# Of its largest entry: what rounding leaves of the symmetry of a matrix, and of an eigenvalue that is 0.
_ROUNDED = 1e-9
_MOMENTS: dict[str, tuple[int, ...]] = {
    "count": (), "mean": (3,), "covariance": (3, 3), "third": (3,), "fourth": (),
}  # fmt: skip
_EVIDENCE: dict[str, tuple[int, ...]] = {
    "noise": (3, 3), "leverage": (3, 3), "skew": (3,), "still": (3, 3), "effective": (), "smooth": (),
}  # fmt: skip


def calibration_json(calibration: Calibration, joints: Sequence[CalibratedJoint]) -> str:
    """The file's text. `joints` is for people to read; what a fit uses is under `clips`."""
    content = {
        "format": FORMAT,
        "skeleton": calibration.skeleton,
        "unit": "m",
        "labels": _labels(calibration.labels),
        "joints": {j.joint.joint: _summary(j) for j in joints},
        "clips": [_clip(clip) for clip in calibration.clips],
    }
    return _laid_out(content) + "\n"


def _labels(labels: Labels | None) -> dict[str, Any] | None:
    if labels is None:
        return None
    return {
        "source": labels.source, "figure": labels.figure, "ignored": list(labels.ignored),
        "markers": {label: list(marker) for label, marker in labels.markers.items()},
    }  # fmt: skip


def _summary(found: CalibratedJoint) -> dict[str, Any]:
    joint = found.joint
    return {
        "parent": joint.parent, "child": joint.child, "in_the_frame_of_clip": found.clip,
        "centre": joint.centre.tolist(), "covariance": joint.covariance.tolist(),
        "shown": joint.shown, "markers": list(joint.markers), "shares": found.shares,
    }  # fmt: skip


def _clip(clip: ClipEvidence) -> dict[str, Any]:
    return {
        "clip": clip.clip, "subject": clip.subject, "frames": clip.frames, "rate": clip.rate,
        "digest": clip.digest,
        "segments": {
            name: {
                "markers": {m: place.tolist() for m, place in t.markers.items()},
                "joint": None if t.joint is None else t.joint.tolist(),
                "rigid": t.rigid,
            }
            for name, t in clip.segments.items()
        },
        "joints": {name: _joint(joint) for name, joint in clip.joints.items()},
    }  # fmt: skip


def _joint(joint: JointEvidence) -> dict[str, Any]:
    e = joint.evidence
    markers = {}
    for i, name in enumerate(joint.markers):
        one = {key: getattr(e.moments, key)[i].tolist() for key in _MOMENTS}
        markers[name] = one | {key: getattr(e, key)[i].tolist() for key in _EVIDENCE}
    shared = e.shared and {
        "centre": e.shared.centre.tolist(), "turns": e.shared.turns.tolist(),
        "residual": e.shared.residual,
    }  # fmt: skip
    return {
        "parent": joint.parent, "child": joint.child, "sigma": e.sigma, "markers": markers,
        "shared": shared,
    }  # fmt: skip


def _laid_out(value: Any, depth: int = 0) -> str:
    """JSON with a line for each key, and lists of numbers on one."""
    if isinstance(value, dict) and value:
        pad = "  " * (depth + 1)
        inner = ",\n".join(
            f"{pad}{json.dumps(k, ensure_ascii=False)}: {_laid_out(v, depth + 1)}"
            for k, v in value.items()
        )
        return "{\n" + inner + "\n" + "  " * depth + "}"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        pad = "  " * (depth + 1)
        inner = ",\n".join(pad + _laid_out(v, depth + 1) for v in value)
        return "[\n" + inner + "\n" + "  " * depth + "]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def read_calibration(path: Path, skeleton: Skeleton | None = None) -> Calibration:
    """Read a calibration.

    Args:
        path: the file.
        skeleton: the figure that it is to be used for.

    Raises:
        CallError: there is no such file, it is no calibration, of another figure, or something in it is
            wrong; the message says where.
    """
    text = read_text(path, CallError, LARGEST)
    with ours(path, CallError, dict.fromkeys((ValueError, RecursionError), _no_calibration)):
        content = json.loads(text)
    check_values(content, path, CallError)
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        found = content.get("format") if isinstance(content, dict) else None
        raise CallError(
            f"{path}: is no calibration: format {found!r} instead of {FORMAT!r}",
            "mocap-skel calibrate writes one",
        )
    door = _Door(path)
    door.keys(content, {"format", "skeleton", "unit", "labels", "joints", "clips"}, "the file")
    if content["unit"] != "m":
        raise door.wrong("unit", f"must be 'm', got {content['unit']!r}")
    name = door.text(content["skeleton"], "skeleton")
    clips = tuple(
        door.clip(entry, f"clips[{i}]")
        for i, entry in enumerate(door.a(content["clips"], list, "clips"))
    )
    digests = [clip.digest for clip in clips]
    for i, digest in enumerate(digests):
        if digest in digests[:i]:
            raise door.wrong(f"clips[{i}].digest", "is that of another clip: it would count twice")
    calibration = Calibration(name, clips, door.labels(content["labels"], "labels"))
    if skeleton is not None:
        check_figure(path, calibration, skeleton)
    return calibration


def _no_calibration(error: Exception) -> tuple[str, str]:
    return f"is no calibration: {unreadable(error)}", "mocap-skel calibrate writes one"


def check_figure(path: Path, calibration: Calibration, skeleton: Skeleton) -> None:
    """Raise an error if a calibration is not of a figure.

    Args:
        path: of its file, for the message.
        calibration: what was read.
        skeleton: the figure that it is to be used for.

    Raises:
        CallError: it is of another figure, or has joints that this one does not have.
    """
    if calibration.skeleton != skeleton.name:
        raise CallError(
            f"{path}: is of the skeleton {calibration.skeleton!r}, not of {skeleton.name!r}",
            "calibrate with the same association file and --skeleton",
        )
    joints = {s.joint: s for s in skeleton.segments if s.joint}
    for clip in calibration.clips:
        for name, joint in clip.joints.items():
            own = joints.get(name)
            if own is None or (own.parent, own.name) != (joint.parent, joint.child):
                raise CallError(
                    f"{path}: {clip.clip}: the skeleton {skeleton.name!r} has no joint {name} from "
                    f"{joint.parent} to {joint.child}"
                )
            if joint.parent not in clip.segments:
                raise CallError(f"{path}: {clip.clip}: {name}: no segment {joint.parent} beside it")


class _Door:
    """Checks of values, each with its place in the file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def wrong(self, where: str, what: str) -> CallError:
        return CallError(f"{self.path}: {where} {what}")

    def a(self, value: Any, kind: type, where: str) -> Any:
        if not isinstance(value, kind):
            raise self.wrong(where, f"must be a {kind.__name__}, got {value!r:.40}")
        return value

    def text(self, value: Any, where: str) -> str:
        return str(self.a(value, str, where))

    def keys(self, value: Any, wanted: set[str], where: str) -> None:
        self.a(value, dict, where)
        for key in sorted(wanted ^ set(value)):
            what = f"lacks {key!r}" if key in wanted else f"has an unknown key {key!r}"
            raise self.wrong(where, what)

    def numbers(self, value: Any, shape: tuple[int, ...], where: str) -> Array:
        try:
            found = np.array(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            found = np.empty(0)
        if found.shape != shape or not (np.abs(found) < _BEYOND).all():
            raise self.wrong(where, f"must be numbers of shape {shape}, got {value!r:.40}")
        return found

    def spread(self, value: Any, where: str) -> Array:
        """A variance in all directions: symmetric, and none of its eigenvalues negative."""
        found = self.numbers(value, (3, 3), where)
        rounded = _ROUNDED * np.abs(found).max()
        if np.abs(found - found.T).max() > rounded:
            raise self.wrong(where, "must be symmetric")
        if np.linalg.eigvalsh(found)[0] < -rounded:
            raise self.wrong(where, "must have no negative eigenvalue: it is a variance")
        return found

    def not_negative(self, value: Any, where: str) -> float:
        found = float(self.numbers(value, (), where))
        if found < 0:
            raise self.wrong(where, f"must not be negative, got {found:g}")
        return found

    def labels(self, entry: Any, where: str) -> Labels | None:
        if entry is None:
            return None
        self.keys(entry, {"source", "figure", "markers", "ignored"}, where)
        markers = {}
        for label, named in self.a(entry["markers"], dict, f"{where}.markers").items():
            at = f"{where}.markers.{label}"
            words = [self.text(word, at) for word in self.a(named, list, at)]
            if len(words) != 2 or not all(words):
                raise self.wrong(at, f"must be a marker and its segment, got {named!r:.40}")
            markers[label] = words[0], words[1]
        ignored = self.a(entry["ignored"], list, f"{where}.ignored")
        return Labels(
            self.text(entry["source"], f"{where}.source"),
            self.text(entry["figure"], f"{where}.figure"),
            markers, tuple(self.text(one, f"{where}.ignored") for one in ignored),
        )  # fmt: skip

    def clip(self, entry: Any, where: str) -> ClipEvidence:
        wanted = {"clip", "subject", "frames", "rate", "digest", "segments", "joints"}
        self.keys(entry, wanted, where)
        segments = {
            name: self.template(t, f"{where}.segments.{name}")
            for name, t in self.a(entry["segments"], dict, f"{where}.segments").items()
        }
        joints = {
            name: self.joint(j, f"{where}.joints.{name}")
            for name, j in self.a(entry["joints"], dict, f"{where}.joints").items()
        }
        return ClipEvidence(
            self.text(entry["clip"], f"{where}.clip"),
            self.text(entry["subject"], f"{where}.subject"),
            int(self.not_negative(entry["frames"], f"{where}.frames")),
            self.not_negative(entry["rate"], f"{where}.rate"),
            self.text(entry["digest"], f"{where}.digest"), segments, joints,
        )  # fmt: skip

    def template(self, entry: Any, where: str) -> Template:
        self.keys(entry, {"markers", "joint", "rigid"}, where)
        markers = {
            m: self.numbers(place, (3,), f"{where}.markers.{m}")
            for m, place in self.a(entry["markers"], dict, f"{where}.markers").items()
        }
        joint = entry["joint"]
        return Template(
            markers,
            None if joint is None else self.numbers(joint, (3,), f"{where}.joint"),
            self.not_negative(entry["rigid"], f"{where}.rigid"),
        )

    def joint(self, entry: Any, where: str) -> JointEvidence:
        self.keys(entry, {"parent", "child", "sigma", "markers", "shared"}, where)
        markers = self.a(entry["markers"], dict, f"{where}.markers")
        for name, one in markers.items():
            self.keys(one, {*_MOMENTS, *_EVIDENCE}, f"{where}.markers.{name}")
            for key in ("count", "fourth", "effective", "smooth"):
                self.not_negative(one[key], f"{where}.markers.{name}.{key}")
            if one["smooth"] > 1 + _ROUNDED:
                raise self.wrong(
                    f"{where}.markers.{name}.smooth", "is a share: it must be 1 at most"
                )
            if one["effective"] > (1 + _ROUNDED) * one["count"]:
                what = f"must not be more than its {one['count']:g} samples"
                raise self.wrong(f"{where}.markers.{name}.effective", what)
        if not markers:
            raise self.wrong(f"{where}.markers", "is empty")

        def all_of(key: str, shape: tuple[int, ...]) -> Array:
            places = ((one[key], f"{where}.markers.{name}.{key}") for name, one in markers.items())
            if shape == (3, 3):
                return np.array([self.spread(*at) for at in places])
            return np.array([self.numbers(value, shape, at) for value, at in places])

        moments = Moments(**{key: all_of(key, shape) for key, shape in _MOMENTS.items()})
        parts = {key: all_of(key, shape) for key, shape in _EVIDENCE.items()}
        evidence = Evidence(
            moments=moments,
            sigma=self.not_negative(entry["sigma"], f"{where}.sigma"),
            shared=self.shared(entry["shared"], f"{where}.shared"),
            **parts,
        )
        return JointEvidence(
            self.text(entry["parent"], f"{where}.parent"),
            self.text(entry["child"], f"{where}.child"),
            tuple(markers),
            evidence,
        )

    def shared(self, entry: Any, where: str) -> SharedPoint | None:
        if entry is None:
            return None
        self.keys(entry, {"centre", "turns", "residual"}, where)
        return SharedPoint(
            self.numbers(entry["centre"], (3,), f"{where}.centre"),
            self.spread(entry["turns"], f"{where}.turns"),
            self.not_negative(entry["residual"], f"{where}.residual"),
        )
