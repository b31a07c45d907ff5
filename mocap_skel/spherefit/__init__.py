"""Closed-form sphere fits: moments, estimators, noise, bounds.

Here belongs what knows points only: no marker set, no file, no command. It may import numpy (SciPy for the
MLE, when it is asked for), `errors` and `extras`.
"""

from mocap_skel.spherefit.bounds import (
    centre_covariance,
    common_markers,
    coverage_angle,
    crlb_circle,
    crlb_sphere,
    effective_counts,
    largest_noise,
    smooth_share,
)
from mocap_skel.spherefit.estimators import (
    allowed_sigma,
    gdke,
    mgdk,
    pratt,
    radial_variance,
    sgdk,
    ugdk,
)
from mocap_skel.spherefit.least_squares import lls, mle
from mocap_skel.spherefit.methods import METHODS, NOISELESS, fit_sphere
from mocap_skel.spherefit.moments import Moments, merge_moments, moved_moments, sphere_moments
from mocap_skel.spherefit.noise import (
    MarkerNoise,
    isotropic,
    marker_noise,
    marker_weights,
    radial_noise_matrix,
)
from mocap_skel.spherefit.running import RunningFit, igdk, running_centres
from mocap_skel.spherefit.system import DegenerateSphereError, SphereFit

__all__ = [
    "METHODS",
    "NOISELESS",
    "DegenerateSphereError",
    "MarkerNoise",
    "Moments",
    "RunningFit",
    "SphereFit",
    "allowed_sigma",
    "centre_covariance",
    "common_markers",
    "coverage_angle",
    "crlb_circle",
    "crlb_sphere",
    "effective_counts",
    "fit_sphere",
    "gdke",
    "igdk",
    "isotropic",
    "largest_noise",
    "lls",
    "marker_noise",
    "marker_weights",
    "merge_moments",
    "mgdk",
    "mle",
    "moved_moments",
    "pratt",
    "radial_noise_matrix",
    "radial_variance",
    "running_centres",
    "sgdk",
    "smooth_share",
    "sphere_moments",
    "ugdk",
]
