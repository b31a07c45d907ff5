"""What several test modules share: where the bundled clips lie, and artificial recordings as clips and fits."""

import os
from functools import cache
from pathlib import Path

import golden
import numpy as np

from mocap_skel import associate, fit_skeleton, read_association, read_clip
from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
from mocap_skel.clip import Clip
from mocap_skel.export.files import Pieces
from mocap_skel.export.registry import Rendered, Source, choose

ROOT = Path(__file__).parent.parent
SAMPLES = ROOT / "sample_data"
# Real recordings, which are no part of the project.
CLIPS = Path(os.environ.get("MOCAP_SKEL_CLIPS", ROOT.parent / "shared" / "clips"))
# Which shipped association file belongs to which bundled clip.
ASSOCIATIONS = {clip: name for name, clips in golden.CALLS.items() for clip in clips}


def clip_of(recording, name="artificial"):
    """An artificial recording as the readers would give it, without the rounding of a file."""
    prefixed = [label.rpartition(":") for label in recording.labels]
    return Clip(
        name=name,
        points=recording.points,
        labels=tuple(label for _, _, label in prefixed),
        subjects=tuple(subject for subject, _, _ in prefixed),
        rate=recording.rate,
        first_frame=recording.first_frame,
        unit="m",
        up="z",
        left_out={},
        notes=(),
    )


known = cache(read_association)


def fit_clip(clip, association="cmu", subject=None, **options):
    """Fit the first subject of a clip, or the one that is named.

    Args:
        association: a shipped one by name, or one that was read.
    """
    found = known(association) if isinstance(association, str) else association
    return fit_skeleton(clip, associate(clip, found, subject)[0], found.skeleton, **options)


def fit_recording(recording, association="cmu", subject=None, **options):
    """As `fit_clip`, of an artificial recording."""
    return fit_clip(clip_of(recording), association, subject, **options)


@cache
def fit_sample(name, subject=None):
    """The fit of a bundled clip, as the command line reads it."""
    return fit_clip(read_clip(SAMPLES / f"{name}.c3d"), ASSOCIATIONS[name], subject)


@cache
def gappy():
    """A fit with everything missing that can be: frames, a joint's branch, a number near zero."""
    motion = range_of_motion(5, 60, seed=2)
    faults = Faults(sigma=0.001, dropout=0.1, lost=("LFIN",))
    recording = record(
        human(), marker_set("cmu"), motion, faults, seed=2, first_frame=101, place=(-0.2, 0.1, 0.0)
    )
    return fit_recording(recording, prior="none")


def rendered(name, fit, clip=None, path=None, **told):
    """What a format makes of a fit; some need the clip and its file too."""
    (chosen,) = choose(name, **told)
    made = chosen.render(fit, Source(clip, path))
    whole = {s: str(c) if isinstance(c, Pieces) else c for s, c in made.files.items()}
    return Rendered(whole, made.notes)


def error_inside(fit, recording, joint):
    """How far a joint's track is from the truth, (frames, 3), along the axes of its parent's frame."""
    away = joint.track - recording.truth[joint.joint]
    return np.einsum("fji,fj->fi", fit.segments[joint.parent].pose.rotation, away)


def constant_error(fit, recording, joint):
    """Error (3,) of a joint's constant: the median over frames of the above.

    The fitted frame and the true one differ by a constant motion and by noise from frame to frame;
    the track holds both frames' noise, of which the median over frames is free.
    """
    return np.nanmedian(error_inside(fit, recording, joint), axis=0)
