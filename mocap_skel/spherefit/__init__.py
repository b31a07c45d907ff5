"""Closed-form sphere fits. This room knows numpy and nothing else: no marker set, no file, no command."""

from mocap_skel.spherefit.bounds import centre_covariance, coverage_angle, effective_counts
from mocap_skel.spherefit.estimators import (
    DegenerateSphereError,
    SphereFit,
    allowed_sigma,
    gdke,
    mgdk,
    pratt,
    radial_variance,
    sgdk,
    ugdk,
)
from mocap_skel.spherefit.moments import Moments, merge_moments, sphere_moments

__all__ = [
    "DegenerateSphereError",
    "Moments",
    "SphereFit",
    "allowed_sigma",
    "centre_covariance",
    "coverage_angle",
    "effective_counts",
    "gdke",
    "merge_moments",
    "mgdk",
    "pratt",
    "radial_variance",
    "sgdk",
    "sphere_moments",
    "ugdk",
]
