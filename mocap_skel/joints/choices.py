"""What a caller may choose for a fit, and which choices do not go together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_skel.segments.noise import NOISES
from mocap_skel.spherefit import METHODS, NOISELESS

# The method that suits a joint: UGDK, MGDK or SGDK, and no sphere that the data do not show.
BEST = "best"
# Where what the motion does not show comes from.
PRIORS = ("skeleton", "none")
POSES = ("least-squares", "triad")
# Only these take away any but the same noise in all directions and of all markers.
SHAPED = (BEST, "ugdk", "mgdk", "sgdk")


# These look at the samples one by one; of other clips there are none.
BY_SAMPLES = ("igdk", "lls", "mle")


@dataclass(frozen=True)
class Estimation:
    """How the centre of a joint is estimated.

    Attributes:
        method: one of `spherefit.METHODS`, or `BEST`.
        each: whether each marker's noise comes from its own radial residuals, and its samples are weighed
            by it; otherwise all markers have the clip's noise and count alike.
    """

    method: str = BEST
    each: bool = False


def check_method(method: str, noise: str, sigma: object, *, calibrated: bool = False) -> None:
    """Refuse a method, a noise, or two of them that do not go together.

    Raises:
        ValueError: says which.
    """
    if method not in (BEST, *METHODS):
        raise ValueError(f"method must be one of {(BEST, *METHODS)}, got {method!r}")
    if noise not in NOISES:
        raise ValueError(f"noise must be one of {NOISES}, got {noise!r}")
    if noise != "rigid" and sigma is not None:
        raise ValueError(f"noise {noise!r} is estimated, and sigma gives it: leave one of them out")
    if method in NOISELESS and sigma is not None:
        raise ValueError(f"{method} takes no noise: leave sigma out")
    if method not in SHAPED and (noise != "rigid" or isinstance(sigma, np.ndarray | tuple)):
        raise ValueError(f"{method} takes no noise matrix and no noise of each marker")
    if calibrated and method in BY_SAMPLES:
        raise ValueError(f"{method} needs every sample, a calibration holds moments: leave one out")
