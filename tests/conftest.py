"""Fixtures of all tests."""

import signal

import pytest
from recordings import CLIPS, SAMPLES


@pytest.fixture(scope="session")
def samples():
    """The folder of the bundled clips."""
    return SAMPLES


@pytest.fixture(scope="session")
def shared_clips():
    """The folder of real recordings, which is no part of the project."""
    if not CLIPS.is_dir():
        pytest.skip(f"no real recordings in {CLIPS}")
    return CLIPS


@pytest.fixture
def interruptible():
    """Let programs that a test starts see Ctrl-C: what is started from a job in the background ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
