"""One HTML page that shows a fit: verdict, the moving figure, joint table, coverage, decisions.

The page is one file and loads nothing. Labels and names come out of a file that anyone may have made: all
text is escaped, and the content security policy lets nothing run but the viewer, by its hash.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template

import numpy as np

from mocap_skel.angles.joint_angles import joint_angles
from mocap_skel.clip import Clip
from mocap_skel.export.registry import Chosen, Format, Options, Rendered, Source
from mocap_skel.gait.events import foot_events
from mocap_skel.joints.joint_fit import JointFit
from mocap_skel.joints.verdicts import VERDICTS
from mocap_skel.labels.association import Assignment
from mocap_skel.report.angle_section import angle_section
from mocap_skel.report.bands import EVENT, Band, bands_of, event_bands, legend, meanings, strip
from mocap_skel.report.coverage import COLOURS, coverage_map
from mocap_skel.report.ellipsoid import ERRORS
from mocap_skel.report.headline import Finding, findings
from mocap_skel.report.inline import asset, in_json, policy, text
from mocap_skel.report.looks import ALARM, LOOKS, style_of_verdicts
from mocap_skel.report.moving import Moving, moving
from mocap_skel.report.rig_section import rig_section
from mocap_skel.report.scene import LARGEST, Scene, scene
from mocap_skel.report.terminal import JOINT_HEAD, joint_cells
from mocap_skel.results.series import marker_tracks, radial
from mocap_skel.results.tables import joint_rows
from mocap_skel.results.verdict import in_short, verdict
from mocap_skel.rig.quality import Quality
from mocap_skel.skeleton_fit import SkeletonFit
from mocap_skel.text import counted
from mocap_skel.version import __version__

_SUFFIX = ".report.html"


@dataclass(frozen=True, eq=False)
class PageContent:
    """What a page is made of.

    Attributes:
        clip: the recording.
        assignment: the subject's markers.
        fit: in the clip's own axes.
        decided: what was decided about the file and its labels before the fit, one sentence each.
        command: the call that made the page.
        static: the same subject in a static clip, whose mean pose is neutral for angles; None without one.
    """

    clip: Clip
    assignment: Assignment
    fit: SkeletonFit
    decided: tuple[str, ...]
    command: str
    static: SkeletonFit | None = None


def page(content: PageContent) -> str:
    """The text of the whole page, one HTML file that loads nothing."""
    fit, shown = content.fit, moving(content.fit)
    events = foot_events(fit, content.clip)
    bands = (*bands_of(shown), *event_bands(events.events, fit.frame_numbers))
    found = findings(fit, shown)
    made = scene(content.clip, content.assignment, shown.fit, shown.floor, bands)
    style, script = style_of_verdicts() + asset("style.css"), asset("viewer.bundle.js")
    who = f" · {fit.subject}" if fit.subject else ""
    return Template(asset("template.html")).substitute(
        policy=policy(script, style),
        style=style,
        script=script,
        title=text(Path(fit.clip).name + who),
        short=_short(fit, found),
        behind=_behind(found),
        more=_more(found),
        played=_played(shown, bands),
        verdict=_verdict(fit),
        counts="".join(_counts(fit.joints)),
        **{shown: f'<span class="{shown}">{_sign(shown)}{shown}</span>' for shown in VERDICTS},
        table=_table(fit.joints),
        bands=strip(bands, len(fit.frame_numbers), int(fit.frame_numbers[0])),
        legend=legend(bands),
        rig=rig_section(shown),
        angles=angle_section(joint_angles(fit, content.static), events.events),
        coverage="".join(_coverage(content)),
        notes=_list((*content.decided, *fit.notes, *(events.notes if events.events else ()))),
        facts=_facts(content, made),
        version=text(__version__),
        deviations=f"{ERRORS:g}",
        largest=f"{100 * LARGEST:g} cm",
        scene=in_json(made.about),
        samples=base64.b64encode(made.packed).decode(),
    )


def _short(fit: SkeletonFit, found: Sequence[Finding]) -> str:
    """The one line at the top of the page: what is worst, or that all is well."""
    return _finding(found[0]) if found else text(in_short(fit))


def _behind(found: Sequence[Finding]) -> str:
    """The other findings, as a list."""
    items = "".join(f"<li>{_finding(one)}</li>" for one in found[1:])
    return f'<ol id="findings">{items}</ol>' if items else ""


def _more(found: Sequence[Finding]) -> str:
    """What is behind the line at the top, in a few words."""
    more = f"{len(found) - 1} more to look at, which" if len(found) > 1 else "Which"
    return f"{more} joints to trust, and what to film"


def _finding(one: Finding) -> str:
    """Its sentence, with a button that goes to its frame."""
    go = (
        "" if one.frame is None else f' <button data-frame="{one.frame}">frame {one.frame}</button>'
    )
    return f'<span class="alarm">{ALARM.sign}</span>\u00a0{text(one.words)}{go}'


def _played(shown: Moving, bands: Sequence[Band]) -> str:
    """What kind of figure the page plays, and what is marked over its time line."""
    if shown.animation is None:
        return (
            "The figure has the free poses of the fit, each frame by itself: bones may change their lengths, and gaps "
            "stay gaps. There is no rigid figure, so fit writes no BVH and no GLB of this clip."
        )
    figure = (
        "The figure is the rigid one that fit writes as BVH and GLB: bones of constant length, gaps bridged, movement "
        "above what the body does taken away."
    )
    if all(band.kind == EVENT for band in bands):
        figure = f"{figure} Nothing had to be filled or repaired in this clip."
    if not bands:
        return figure
    return (
        f"{figure} The bands above the time line are stretches of frames: {text(meanings(bands))}. Point at a band to "
        "read of which segments, pick it to go there; the buttons below go from one to the next."
    )


def _verdict(fit: SkeletonFit) -> str:
    """The sentences behind that line: which joints to trust, what to film."""
    return "<br>".join(text(sentence) for sentence in verdict(fit, joint_rows(fit, angles=False)))


def _shown(joint: JointFit) -> str:
    """The key of `LOOKS`."""
    return joint.shown if joint.fitted else "none"


def _sign(shown: str) -> str:
    return f'<span class="sign">{LOOKS[shown].sign}</span>'


def _counts(joints: Sequence[JointFit]) -> Iterable[str]:
    """One item for yes, weak, no and not fitted: how many joints, what it means, their names."""
    for shown, look in LOOKS.items():
        names = [joint.joint for joint in joints if _shown(joint) == shown]
        if names:
            word = "" if shown == "none" else f"{shown}: "
            yield (
                f'<li class="{shown}">{_sign(shown)}<b>{word}{len(names)}</b> '
                f"{text(look.meaning)}<br><small>{text(', '.join(names))}</small></li>"
            )


def _table(joints: Sequence[JointFit]) -> str:
    """The joint table of the terminal with all columns; each row picks its joint in the viewer."""
    head = "".join(f'<th scope="col">{text(name)}</th>' for name in JOINT_HEAD)
    rows = []
    for i, joint in enumerate(joints):
        name, word, *cells = joint_cells(joint)
        shown = _shown(joint)
        rows.append(
            f'<tr class="{shown}" data-joint="{i}"><th scope="row"><button>{text(name)}</button></th>'
            f'<td class="first">{_sign(shown)}{text(word if joint.fitted else "not fitted")}</td>'
            + "".join(_cell(head, cell) for head, cell in zip(JOINT_HEAD[2:], cells, strict=True))
            + "</tr>"
        )
    return f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"


def _cell(head: str, cell: str) -> str:
    """A cell that also has its column's name, for a phone that shows rows as cards."""
    first = ' class="first"' if head == "s.e. mm" else ""
    return f'<td{first} data-head="{text(head)}">{text(cell)}</td>'


def _coverage(content: PageContent) -> Iterable[str]:
    fit = content.fit
    places = {joint.joint: i for i, joint in enumerate(fit.joints)}
    for about in radial(fit, marker_tracks(content.clip, content.assignment, fit)):
        joint, picture = about.joint, coverage_map(about)
        key = ", ".join(
            f'<span class="m{m % len(COLOURS)}">{text(name)}</span>'
            for m, name in enumerate(joint.markers)
        )
        yield (
            f'<figure data-joint="{places[joint.joint]}">{picture}<figcaption><b>{text(joint.joint)}</b> '
            f'<span class="{joint.shown}">{_sign(joint.shown)}{joint.shown}</span>'
            f"<br>θ {np.degrees(joint.angle):.0f}° · {key}</figcaption></figure>"
        )


def _list(sentences: Iterable[str]) -> str:
    items = "".join(f"<li>{text(sentence)}</li>" for sentence in dict.fromkeys(sentences))
    return f"<ul>{items}</ul>" if items else "<p>Nothing out of the ordinary.</p>"


def _facts(content: PageContent, made: Scene) -> str:
    clip, fit = content.clip, content.fit
    columns = [c for of in content.assignment.columns.values() for c in of.values()]
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
        "command": content.command,
        "made by": f"mocap-skel {__version__}",
    }
    return "".join(
        f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in facts.items() if value
    )


@dataclass(frozen=True)
class PageOptions(Options):
    """What a page may be told: nothing; but it has a rigid figure."""

    def quality(self, fit: SkeletonFit) -> Quality | None:
        """How good the figure is that the page plays."""
        return moving(fit).quality


def _write(fit: SkeletonFit, options: Options, source: Source) -> Rendered:
    del options
    assert source.assignment is not None, "the page shows the markers of a call that knows them"
    content = PageContent(
        source.clip, source.assignment, fit, source.decided, source.command, source.static
    )
    return Rendered({_SUFFIX: page(content)})


# A result like any other, but of a command of its own: `fit --format` does not offer it.
PAGE = Chosen(
    Format(
        "html",
        (_SUFFIX,),
        PageOptions,
        f"walk{_SUFFIX}",
        "a page rounds positions, and leaves out frames of a long clip",
        _write,
    ),
    PageOptions(),
)
