"""What a caller may choose for a fit, and which choices do not go together."""

from __future__ import annotations

import numpy as np

from mocap_skel.joints.centre import BEST
from mocap_skel.segments.noise import NOISES
from mocap_skel.spherefit import METHODS, NOISELESS

# Where what the motion does not show comes from.
PRIORS = ("skeleton", "none")
POSES = ("least-squares", "triad")
# Only these take away any but the same noise in all directions and of all markers.
SHAPED = (BEST, "ugdk", "mgdk", "sgdk")


# These look at the samples one by one; of other clips there are none.
BY_SAMPLES = ("igdk", "lls", "mle")


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
