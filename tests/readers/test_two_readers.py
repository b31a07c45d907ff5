"""Our reading of C3D and two libraries: all give the same, of every machine and kind of number."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from c3d_bytes import BLOCK, MACHINES, c3d_file, cloud
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from recordings import ASSOCIATIONS, CLIPS
from references import by_ezc3d, by_us, read_alike

from mocap_skel import artificial as art
from mocap_skel.errors import ClipError
from mocap_skel.readers import read_clip
from mocap_skel.readers.formats.c3d import with_c3d


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("scale", [-0.1, 0.05])
@pytest.mark.parametrize("analogs", [0, 5])
def test_every_machine_and_kind_of_number(path, machine, scale, analogs, capfd):
    points, residuals = cloud(), np.zeros((20, 3))
    residuals[3, 1] = -1
    c3d_file(
        path, points, residuals=residuals, scale=scale, machine=machine, analogs=analogs, first=300
    )
    # ezc3d has no way to read MIPS numbers.
    read_alike(path, ezc3d=machine != "MIPS")
    raw = by_us(path)
    points[3, 1] = np.nan
    np.testing.assert_allclose(raw.points, points, rtol=1e-6, atol=max(scale, 0) / 2)
    assert (raw.rate, raw.first_frame) == (100.0, 300)
    assert "read with" not in " ".join(read_clip(path).notes)
    assert capfd.readouterr() == ("", "")


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 9),
    first=st.integers(1, 65000),
    kind=st.sampled_from([(m, s, a) for m in ("INTEL", "DEC") for s in (-1, 0.1) for a in (0, 3)]),
)
def test_all_agree(path, seed, count, first, kind):
    rng = np.random.default_rng(seed)
    machine, scale, analogs = kind
    points = rng.choice([0.0, *rng.normal(0, 500, 20)], (count, 4, 3))
    residuals = rng.choice([-1.0, 0.0, 3.0], (count, 4))
    # Where every point is said to be missing, we take none of them to be.
    assume((residuals >= 0).any())
    c3d_file(
        path,
        points,
        residuals=residuals,
        machine=machine,
        scale=scale,
        analogs=analogs,
        first=first,
    )
    read_alike(path)


def test_all_agree_on_an_artificial_clip(path):
    faults = art.Faults(sigma=0.001, dropout=0.2)
    one = art.record(art.human(), art.marker_set("cmu"), art.walk(2, 100), faults, first_frame=77)
    art.write_c3d(art.merge({"Ann": one, "Bob": one}), path)
    read_alike(path)


def test_the_frames_against_py_c3ds_own_loop(path):
    import c3d

    residuals = np.zeros((20, 3))
    residuals[4, 2] = -1
    c3d_file(path, cloud(), residuals=residuals, analogs=2, UNITS="mm", DESCRIPTIONS=["a"] * 3)
    raw = with_c3d.read(path)
    with path.open("rb") as file, pytest.warns(UserWarning, match="ANALOG"):
        theirs = np.array([points for _, points, _ in c3d.Reader(file).read_frames()])
    np.testing.assert_array_equal(raw.invalid, theirs[..., 3] == -1)
    np.testing.assert_array_equal(raw.points[~raw.invalid], theirs[~raw.invalid][:, :3])


def test_damaged_parameters_are_refused_and_never_get_out(path):
    """Any byte of the parameters changed: a clip or a ClipError, nothing else, nothing printed."""
    whole = c3d_file(path, cloud(count=3)).read_bytes()
    rng = np.random.default_rng(5)
    for at in rng.integers(BLOCK, 2 * BLOCK, 300):
        path.write_bytes(whole[:at] + bytes([rng.integers(256)]) + whole[at + 1 :])
        with suppress(ClipError):
            assert with_c3d.read(path).points.shape[2] == 3


@pytest.mark.parametrize("reader", [by_ezc3d, by_us])
def test_a_residual_of_minus_zero_is_a_point(path, reader):
    residuals = np.full((20, 3), -0.0)
    residuals[4, 1] = -1
    raw = reader(c3d_file(path, cloud(), residuals=residuals))
    assert np.argwhere(raw.invalid).tolist() == [[4, 1]]


@pytest.mark.parametrize("name", sorted(ASSOCIATIONS))
def test_all_agree_on_bundled_clips(samples, name):
    read_alike(samples / f"{name}.c3d")


# --- Real recordings ----------------------------------------------------------------------------


def real(name):
    path = CLIPS / name
    if not path.exists():
        pytest.skip(f"no {path}")
    return path


@pytest.mark.real
def test_the_same_trial_in_two_byte_orders():
    intel = read_clip(real("odd_files/Eb015pi.c3d"))
    sgi = read_clip(real("odd_files/Eb015si.c3d"))
    np.testing.assert_array_equal(intel.points, sgi.points)
    for name in ("labels", "subjects", "rate", "first_frame", "unit", "up", "left_out"):
        assert getattr(intel, name) == getattr(sgi, name)


@pytest.mark.real
def test_what_ezc3d_refuses():
    clip = read_clip(real("odd_files/Dance.c3d"))
    assert clip.points.shape == (499, 40, 3)
    assert "the file says 500 frames and has 499; read with py-c3d" in clip.notes


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "markers", "left_out"),
    [
        *[("cmu/01_01", 42, 0), ("cmu/basketball", 41, 0), ("hdm05/HDM_dg_06-03_03_120", 41, 3)],
        *[("functional_hip/FunctionalLHip", 74, 0), ("functional_hip/FunctionalWalk", 74, 72)],
        *[("functional_knee/right_knee", 73, 0), ("odd_files/sub_labels", 50, 64)],
        *[("plug_in_gait/HC055A01", 125, 188), ("plug_in_gait/HC055A34", 103, 188)],
        *[("two_subjects/kinematics_tennis_serve_2players", 78, 0)],
    ],
)
def test_markers_of_real_clips(name, markers, left_out):
    clip = read_clip(real(f"{name}.c3d"))
    assert len(clip.labels) == markers
    assert sum(map(len, clip.left_out.values())) == left_out
    # Plug-in Gait's set, or the like of it, has nothing that looks like a bone.
    assert {"LFHD", "C7", "LKNE"} & set(clip.labels) or "right_knee" in name


@pytest.mark.real
def test_zeros_of_a_real_clip():
    notes = read_clip(real("functional_hip/FunctionalLHip.c3d")).notes
    assert "missing: 59926" in " ".join(notes)
