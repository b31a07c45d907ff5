"""Libraries that only some commands need."""

import json
import sys

import pytest

from mocap_skel.errors import MissingExtraError
from mocap_skel.extras import extra


class TestExtras:
    def test_a_library_that_is_there_is_given(self):
        assert extra("json", "any") is json

    def test_one_that_is_not_is_an_error_with_the_command_that_installs_it(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "scipy.optimize", None)
        with pytest.raises(MissingExtraError, match="needs scipy, which is not installed") as error:
            extra("scipy.optimize", "mle")
        assert error.value.hint == "pip install 'mocap-skel[mle]'"
