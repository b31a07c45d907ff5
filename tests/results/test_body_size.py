"""A unit that does not go with the numbers is named, with the one that does."""

import pytest
from recordings import SAMPLES

from mocap_skel import associate, read_association, read_clip
from mocap_skel.results.body_size import wrong_size


@pytest.mark.parametrize(
    "parts", [None, ("UpperLeftLeg", "LowerLeftLeg", "LeftFoot"), ("LowerLeftArm", "LeftHand")]
)
@pytest.mark.parametrize("unit", ["m", "cm", "ft"])
def test_a_body_or_a_limb_of_it_in_a_wrong_unit_names_the_right_one(parts, unit):
    cmu = read_association("cmu")
    for told in (unit, "mm"):
        clip = read_clip(SAMPLES / "range_of_motion.c3d", unit=told)
        columns = associate(clip, cmu)[0].columns
        found = wrong_size(clip, {s: columns[s] for s in parts or columns})
        assert (found is None) if told == "mm" else found.hint.startswith("with --unit mm it is 1.")
