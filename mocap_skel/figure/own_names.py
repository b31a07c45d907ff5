"""A figure in a clip's own names: its landmarks called as the clip's markers are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from mocap_skel.figure.prior_tables import Prior, Shift
from mocap_skel.figure.skeleton import Segment, Skeleton


def in_own_names(skeleton: Skeleton, own: Mapping[str, str]) -> Skeleton:
    """The skeleton with other names for some of its markers and landmarks.

    Args:
        skeleton: the figure.
        own: name in the skeleton → name of the marker; names that are not in it stay.

    >>> from mocap_skel.figure.skeleton import read_skeleton
    >>> figure = in_own_names(read_skeleton("human"), {"SACR": "back"})
    >>> figure.landmarks["PelvisBack"]
    (('RBWT', 'LBWT'), ('back',), ('RPelvis',))
    """
    if not own:
        return skeleton

    def named(names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(own.get(name, name) for name in names)

    def shift(one: Shift) -> Shift:
        return replace(
            one, line=named(one.line), across=named(one.across), of=named(one.of),
            toward=named(one.toward), upper=named(one.upper), straight=named(one.straight),
            hanging=named(one.hanging),
        )  # fmt: skip

    def prior(one: Prior) -> Prior:
        return replace(one, mean=named(one.mean), shifts=tuple(map(shift, one.shifts)))

    def segment(one: Segment) -> Segment:
        return replace(
            one, markers=named(one.markers), ends=named(one.ends), sole=named(one.sole),
            priors=tuple(map(prior, one.priors)),
        )  # fmt: skip

    return replace(
        skeleton,
        segments=tuple(map(segment, skeleton.segments)),
        landmarks={name: tuple(map(named, sets)) for name, sets in skeleton.landmarks.items()},
        measures={
            name: (own.get(a, a), own.get(b, b)) for name, (a, b) in skeleton.measures.items()
        },
        sizes=tuple((own.get(a, a), own.get(b, b), length) for a, b, length in skeleton.sizes),
    )
