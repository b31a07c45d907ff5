"""Fixtures of the readers' tests."""

import pytest


@pytest.fixture
def path(tmp_path):
    """Where a test writes its clip."""
    return tmp_path / "clip.c3d"
