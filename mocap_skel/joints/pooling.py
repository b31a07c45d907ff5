"""What the samples of several clips count beside each other: by what each clip's skin leaves it to know."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocap_skel.joints.choices import Estimation
from mocap_skel.joints.evidence import Evidence
from mocap_skel.joints.samples import Frame, Gathered, JointSamples
from mocap_skel.joints.skin import skin_error
from mocap_skel.joints.sphere import fit_markers
from mocap_skel.joints.verdicts import LEAST_SPREAD
from mocap_skel.spherefit import DegenerateSphereError

# A variance from the three or four markers of a segment is known to a factor of two (chi-squared of as many
# degrees of freedom): within it clips are alike, and their samples count alike.
ALIKE = 0.5


def by_skin(clips: Sequence[Evidence], looseness: float) -> list[float]:
    """How much a sample of each clip counts, 1 for the clip whose samples tell most.

    What skin does in a clip does not average out over its frames, so that a longer clip knows no more. The samples
    of a clip count by what skin and noise leave its own centre to know, one over the variance of that: a wide
    movement is never outvoted by a small one, which has less to weigh in its moments already.

    Args:
        clips: their evidence, each with its effective samples, in one frame.
        looseness: how far the joint is from a ball, as `Segment.looseness`.
    """
    if len(clips) < 2:
        return [1.0] * len(clips)
    variances = [_variance(one, looseness) for one in clips]
    known = [v for v in variances if v is not None]
    least = min(known, default=1.0)
    # A clip that shows nothing by itself has nothing that could be too sure.
    return [1.0 if v is None or least > ALIKE * v else least / v for v in variances]


def _variance(evidence: Evidence, looseness: float) -> float | None:
    """Variance of the clip's own centre, m², over the directions that it shows; None where it shows none."""
    seen = evidence[evidence.count > 0]
    if not len(seen.count) or not seen.count.max() >= 4:
        return None
    nothing = JointSamples(
        np.full((1, len(seen.count), 3), np.nan), seen.sigma, seen.sigma, Frame(None)
    )
    own = nothing.evidence()
    try:
        sphere = fit_markers(Gathered(nothing, own, seen), Estimation())
    except DegenerateSphereError:
        return None
    covariance = sphere.covariance(shown=False) + skin_error(sphere, looseness).covariance
    solved = sphere.solved
    spread = solved.T @ np.einsum("p,pij->ij", seen.freedom, seen.moments.covariance) @ solved
    least = float(np.linalg.eigvalsh(spread)[0] / seen.freedom.sum()) if sphere.rank else 0.0
    if least < LEAST_SPREAD**2:
        # Skin alone moves the markers so far: nothing is known of the joint that could be weighed.
        return None
    return float(np.trace(solved.T @ covariance @ solved)) / sphere.rank
