"""One HTML page that shows a fit: verdict, the moving figure, joint table, coverage, decisions.

The page is one file and loads nothing. Labels and names come out of a file that anyone may have made: all
text is escaped, and the content security policy lets nothing run but the viewer, by its hash.
"""

from __future__ import annotations

import base64
import hashlib
import json
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

import numpy as np

from mocap_skel.clip import Clip
from mocap_skel.export.registry import Chosen, Format, Options, Rendered, Source
from mocap_skel.joints.centre import JointFit
from mocap_skel.labels.association import Assignment
from mocap_skel.report.coverage import COLOURS, coverage_map
from mocap_skel.report.ellipsoid import ERRORS
from mocap_skel.report.scene import LARGEST, Scene, scene
from mocap_skel.report.terminal import JOINT_HEAD, joint_cells
from mocap_skel.results.series import marker_tracks, radial
from mocap_skel.results.verdict import verdict
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import counted
from mocap_skel.version import __version__

TRUST = {
    "yes": ("●", "shown by the movement"),
    "weak": ("◆", "shown in part, anatomy has its share"),
    "no": ("○", "not shown by the movement: anatomy's, or place holders"),
    "none": ("–", "not fitted"),
}
_SUFFIX = ".report.html"


@dataclass(frozen=True, eq=False)
class Shown:
    """What a page is made of.

    Attributes:
        clip: the recording.
        assignment: the subject's markers.
        fit: in the clip's own axes.
        decided: what was decided about the file and its labels before the fit, one sentence each.
        command: the call that made the page.
    """

    clip: Clip
    assignment: Assignment
    fit: SkeletonFit
    decided: tuple[str, ...]
    command: str


def page(shown: Shown) -> str:
    """The whole page."""
    fit = shown.fit
    made = scene(shown.clip, shown.assignment, fit)
    style, script = _asset("style.css"), _asset("viewer.bundle.js")
    who = f" · {fit.subject}" if fit.subject else ""
    return Template(_asset("template.html")).substitute(
        policy=(
            f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
            "base-uri 'none'; form-action 'none'"
        ),
        style=style,
        script=script,
        title=text(Path(fit.clip).name + who),
        verdict=_verdict(fit),
        trust="".join(_trust(fit.joints)),
        table=_table(fit.joints),
        coverage="".join(_coverage(shown)),
        notes=_list((*shown.decided, *fit.notes)),
        facts=_facts(shown, made),
        version=text(__version__),
        deviations=f"{ERRORS:g}",
        largest=f"{100 * LARGEST:g} cm",
        scene=_json(made.about),
        samples=base64.b64encode(made.packed).decode(),
    )


def text(value: object) -> str:
    """Anything as HTML text or attribute; what has no place in either is shown as �.

    Control characters, halves of surrogate pairs and the marks that turn the direction of writing round
    could make a label look like what it is not.
    """
    return escape("".join(_plain(c) for c in str(value)))


def _plain(c: str) -> str:
    return "\ufffd" if unicodedata.category(c) in ("Cc", "Cf", "Cs") else c


def _json(value: object) -> str:
    """JSON that no HTML parser takes for anything else: ASCII without < > &."""
    dumped = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return dumped.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _asset(name: str) -> str:
    return (files("mocap_skel.report") / "page" / name).read_text(encoding="utf-8")


def _hash(inline: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()}"


def _verdict(fit: SkeletonFit) -> str:
    """The first line of the page, in plain words."""
    return "<br>".join(text(sentence) for sentence in verdict(fit))


def _of(joint: JointFit) -> str:
    return joint.shown if joint.fitted else "none"


def _trust(joints: Sequence[JointFit]) -> Iterable[str]:
    """The joints by verdict, the names of each as one line."""
    for known, (sign, meaning) in TRUST.items():
        names = [joint.joint for joint in joints if _of(joint) == known]
        if names:
            word = "" if known == "none" else f"{known}: "
            yield (
                f'<li class="{known}"><span class="sign">{sign}</span><b>{word}{len(names)}</b> '
                f"{text(meaning)}<br><small>{text(', '.join(names))}</small></li>"
            )


def _table(joints: Sequence[JointFit]) -> str:
    """The joint table of the terminal; each row picks its joint in the viewer."""
    head = "".join(f'<th scope="col">{text(name)}</th>' for name in JOINT_HEAD)
    rows = []
    for i, joint in enumerate(joints):
        name, known, *cells = joint_cells(joint)
        verdict = _of(joint)
        rows.append(
            f'<tr class="{verdict}" data-joint="{i}"><th scope="row"><button>{text(name)}</button></th>'
            f'<td><span class="sign">{TRUST[verdict][0]}</span>{text(known if joint.fitted else "not fitted")}</td>'
            + "".join(f"<td>{text(cell)}</td>" for cell in cells)
            + "</tr>"
        )
    return f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"


def _coverage(shown: Shown) -> Iterable[str]:
    fit = shown.fit
    places = {joint.joint: i for i, joint in enumerate(fit.joints)}
    for about in radial(fit, marker_tracks(shown.clip, shown.assignment, fit)):
        joint, picture = about.joint, coverage_map(about)
        sign, _ = TRUST[joint.shown]
        key = ", ".join(
            f'<span class="m{m % len(COLOURS)}">{text(name)}</span>'
            for m, name in enumerate(joint.markers)
        )
        yield (
            f'<figure data-joint="{places[joint.joint]}">{picture}<figcaption><b>{text(joint.joint)}</b> '
            f'<span class="{joint.shown}"><span class="sign">{sign}</span>{joint.shown}</span>'
            f"<br>θ {np.degrees(joint.angle):.0f}° · {key}</figcaption></figure>"
        )


def _list(sentences: Iterable[str]) -> str:
    items = "".join(f"<li>{text(sentence)}</li>" for sentence in dict.fromkeys(sentences))
    return f"<ul>{items}</ul>" if items else "<p>Nothing out of the ordinary.</p>"


def _facts(shown: Shown, made: Scene) -> str:
    clip, fit = shown.clip, shown.fit
    columns = [c for of in shown.assignment.columns.values() for c in of.values()]
    missing = float(clip.missing()[columns].mean()) if columns else 0.0
    last = clip.first_frame + clip.frames - 1
    left = sum(len(one.frames) for one in fit.left_out)
    facts = {
        "clip": clip.name,
        "subject": fit.subject,
        "skeleton": fit.skeleton.name,
        "frames": f"{clip.frames} ({clip.first_frame} to {last}) at {clip.rate:g} Hz, "
        f"{clip.frames / clip.rate:.1f} s",
        "unit, vertical axis": f"{clip.unit}, {clip.up} up",
        "markers": f"{len(columns)} assigned, {100 * missing:.1f} % of their samples missing",
        "left out of the fit": counted(left, "sample") if left else "",
        "points that are no markers": "; ".join(
            f"{len(labels)} {reason}" for reason, labels in clip.left_out.items()
        ),
        "marker noise": f"{1e3 * fit.sigma:.2f} mm",
        "on this page": f"positions rounded to {1e3 * made.step:g} mm"
        + (f", one of {made.every} frames" if made.every > 1 else ", every frame"),
        "command": shown.command,
        "made by": f"mocap-skel {__version__}",
    }
    return "".join(
        f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in facts.items() if value
    )


def _write(fit: SkeletonFit, options: Options, source: Source) -> Rendered:
    del options
    assert source.assignment is not None, "the page shows the markers of a call that knows them"
    shown = Shown(source.clip, source.assignment, fit, source.decided, source.command)
    return Rendered({_SUFFIX: page(shown)})


# A result like any other, but of a command of its own: `fit --format` does not offer it.
PAGE = Chosen(
    Format(
        "html",
        (_SUFFIX,),
        Options,
        f"walk{_SUFFIX}",
        "a page rounds positions, and leaves out frames of a long clip",
        _write,
    ),
    Options(),
)
