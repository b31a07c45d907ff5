"""--measure and --measures on the command line."""

import pytest
from commands import STILL, call

from mocap_skel.measures import measures_of


def fitted(*more, cwd):
    return call("fit", STILL, "--assoc", "cmu", "-o", "-", *more, cwd=cwd)


def test_measures_are_given_one_by_one_or_in_a_file(tmp_path):
    (tmp_path / "ann.toml").write_text('knee_width = "11.2cm"\nright_ankle_width = "80 mm"\n')
    done = fitted("--measures", "ann.toml", "--measure", "right_knee_width=0.108m", cwd=tmp_path)
    said = "left knee width 11.2 cm, right knee width 10.8 cm, right ankle width 8 cm"
    assert done.returncode == 0 and said in done.stderr
    assert done.stdout != fitted(cwd=tmp_path).stdout


@pytest.mark.parametrize("command", ["fit", "calibrate", "report", "draw"])
@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("knee_widht=10cm", "there is no measure 'knee_widht' (did you mean knee_width"),
        ("knee_width=10", "'10' is no length; give it with its unit, like 10.2cm"),
        ("knee_width=10inch", "'10inch' is no length"),
        ("knee_width=102cm", "no person has 102cm (4 to 20 cm)"),
        ("knee_width", "a name and a length are needed, knee_width=10.2cm"),
    ],
)
def test_what_is_no_measure_is_told(tmp_path, command, said, message):
    more = {"draw": ("--frame", "1", "-o", "a.png"), "calibrate": ("-o", "a.json")}.get(command, ())
    done = call(command, STILL, "--assoc", "cmu", "--measure", said, *more, cwd=tmp_path)
    assert done.returncode == 2 and message in done.stderr, done.stderr


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("knee_width = 10.2", "bad.toml: measure knee_width: '10.2' is no length"),
        ("kneewidth = '10cm'", "bad.toml: there is no measure 'kneewidth'"),
        ("knee_width = ", "bad.toml:1:14: Invalid value"),
    ],
)
def test_a_wrong_file_is_named(tmp_path, text, message):
    (tmp_path / "bad.toml").write_text(text)
    done = fitted("--measures", "bad.toml", cwd=tmp_path)
    assert done.returncode == 2 and message in done.stderr, done.stderr
    assert fitted("--measures", "none.toml", cwd=tmp_path).returncode == 2


def test_without_a_side_both_are_meant_and_the_later_one_counts():
    assert measures_of(["height=1.7m"]) == {"height": 1.7}
    assert measures_of(["left_leg_length=90cm", "leg_length=88cm"]) == {
        "left_leg_length": 0.88,
        "right_leg_length": 0.88,
    }
