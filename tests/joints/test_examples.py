"""The examples in the docstrings of the joints' public functions are true."""

import doctest
from importlib import import_module

import pytest

FACES = {
    "centre": ("fit_centre",),
    "evidence": ("merged",),
    "hinge": ("hinge_shift", "inward"),
    "posterior": ("combine", "with_shared_point"),
    "priors": ("expected_joint", "subject_size"),
    "skin": ("skin_error",),
    "two_sided": ("shared_point",),
    "verdicts": ("by_movement", "by_numbers", "worst"),
}


@pytest.mark.parametrize("name", FACES)
def test_the_example_of_each_public_function_is_true(name):
    module = import_module(f"mocap_skel.joints.{name}")
    for face in FACES[name]:
        found = doctest.DocTestFinder().find(getattr(module, face), face, globs=vars(module).copy())
        tried = doctest.DocTestRunner().run(found[0])
        assert tried.attempted > 0
        assert tried.failed == 0
