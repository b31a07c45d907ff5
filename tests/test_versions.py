"""`make test-lowest`: which versions it installs, and what it takes for the same file."""

import subprocess
import sys

import pytest
from lowest import EXTRAS, lowest
from recordings import ROOT
from versions import differences


def test_every_library_says_its_lowest_version():
    found = lowest()
    assert {"c3d", "click", "ezc3d", "numpy", "pandas", "scipy", "tqdm"} < set(found)
    # ezc3d 1.5.16 crashes, and up to 1.7.1 a residual of -0.0 is a missing point. With numpy 1.26, c3d 0.5.0 reads
    # nothing, so that another reader takes its place, and pandas 2.0 calls what numpy warns of.
    assert (found["ezc3d"], found["c3d"], found["pandas"]) == ("1.7.2", "0.5.2", "2.1")
    said = subprocess.run(
        [sys.executable, ROOT / "tests" / "lowest.py"], check=True, capture_output=True, text=True
    ).stdout.splitlines()
    assert f"numpy=={found['numpy']}" in said and len(said) > len(found)


def test_a_library_without_a_lowest_version_is_refused(tmp_path):
    text = (ROOT / "pyproject.toml").read_text()
    (tmp_path / "p.toml").write_text(text.replace('"tqdm>=4.60"', '"tqdm"'))
    with pytest.raises(AssertionError, match="tqdm: a lowest version is missing"):
        lowest(tmp_path / "p.toml")
    assert "dev" not in EXTRAS


def test_what_is_the_same_file():
    assert differences("a.csv", b"x,1.0", b"x,1.0") == ("", False)
    assert differences("a.csv", b"x,1.0", b"x,1.00001") == ("a.csv", True)
    assert differences("a.bvh", b"x 1.0 2", b"x 1.0001 2") == (
        "a.bvh in 1 of 3 words, by 1.0e-04 at most", False,
    )  # fmt: skip
    assert differences("a.bvh", b"x 1.0", b"x 1.1")[1]
    assert differences("a.bvh", b"x 1.0", b"y 1.0")[1]
    assert differences("a.bvh", b"x 1.0", b"")[1]
