"""Closed-form sphere fits: moments, estimators, noise, bounds.

Here belongs what knows points only: no marker set, no file, no command. It may import numpy (SciPy for the
MLE, when it is asked for), `errors` and `extras`.

The thesis is J. K. Knight, Rotation Points from Motion Capture Data Using a Closed Form Solution, 2008;
docs/method.md has its equations, docs/estimators.md what each estimator costs and gains.

Example:
    >>> import numpy as np
    >>> from mocap_skel.artificial.spheres import cap
    >>> from mocap_skel.spherefit import fit_sphere
    >>> rng = np.random.default_rng(0)
    >>> x = cap(rng, (2000,), np.pi / 3, radius=0.2) + 0.001 * rng.normal(size=(2000, 3))
    >>> fit = fit_sphere(x, "pratt")
    >>> print(np.abs(fit.centre).max() < 0.001, fit.radius.round(3), fit.sigma.round(3))
    True 0.2 0.001
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
