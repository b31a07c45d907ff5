"""Choices that do not go together with a calibration; those of noise and sigma are in tests/fit."""

import pytest

from mocap_skel.joints.choices import check_method
from mocap_skel.spherefit import METHODS


def test_methods_that_look_at_samples_one_by_one_take_no_calibration():
    """A calibration holds moments: no samples for a running estimate, a linear system or a search."""
    for method in ("best", *METHODS):
        check_method(method, "rigid", None)
        if method in ("igdk", "lls", "mle"):
            with pytest.raises(ValueError, match=f"{method} needs every sample"):
                check_method(method, "rigid", None, calibrated=True)
        else:
            check_method(method, "rigid", None, calibrated=True)
