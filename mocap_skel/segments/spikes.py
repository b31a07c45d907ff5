"""Spikes: a marker that is somewhere else for one frame, told by its own path alone.

Three markers of a segment judge each other by their distances (`trouble`). One or two cannot: which of two moved is
open, and one alone has no mate. But nobody is thrown for one frame and comes back as if nothing had been: the paths
before and after a spike lead to the same place, and the sample is not there. In a quick movement, a throw or a
kick, they lead to different places, or the sample lies where one of the two leads.
"""

from __future__ import annotations

import numpy as np

from mocap_skel.segments.pose import Array
from mocap_skel.segments.shape import median
from mocap_skel.segments.trouble import SKIN, SPREADS, Mask

# So many times as far as the path around it bends or the two sides disagree. In 22 public clips, throws and
# serves among them, the plain spikes have 3.4 or more, and no other sample has more than 1.7.
_CLEARLY = 3.0


def spikes(x: Array) -> Mask | None:
    """Samples at which a marker is off its own path for a single frame.

    The path on both sides of a sample is continued to it: from the two samples before it, from the two after it, and
    by the cubic through all four (the filter of Hampel 1974 with a path in place of a level). All three have to
    miss the sample by more than skin moves at once, by far more than they usually miss, and by far more than the
    path bends just before and after.

    Args:
        x: (M, 3, F), metres, NaN = missing.

    Returns:
        The samples (M, F), or None where there are none. A sample whose two neighbours on either side are not
        all seen is not judged.

    >>> import numpy as np
    >>> x = np.zeros((1, 3, 200))
    >>> x[0, 0] = np.sin(np.linspace(0.0, 6.0, 200))
    >>> x[0, 1, 50] += 0.09
    >>> np.argwhere(spikes(x)).tolist()
    [[0, 50]]
    """
    if x.shape[2] < 5:
        return None
    bend = x[..., 2:] - 2 * x[..., 1:-1] + x[..., :-2]
    square = np.einsum("mdf,mdf->mf", bend, bend)
    # A spike bends the path by twice its height.
    with np.errstate(invalid="ignore"):
        marker, at = np.nonzero(square[:, 1:-1] > (2 * SKIN) ** 2)
    if not len(at):
        return None
    at += 2
    usual = SPREADS * np.sqrt(median(square))
    before, here, after = (bend[marker, :, at - 1 + i] for i in (-1, 0, 1))
    # The second difference beside a sample is how far the line through its neighbours misses it.
    missed = np.min(
        [_length(before), _length(after), _length(before - 2 * here + after) / 6], axis=0
    )
    last = bend.shape[2] - 1
    # Where the clip begins or a marker was missing, one side alone tells how the path bends.
    around = np.fmax(
        np.where(at >= 3, np.sqrt(square[marker, np.maximum(at - 3, 0)]), np.nan),
        np.where(at < last, np.sqrt(square[marker, np.minimum(at + 1, last)]), np.nan),
    )
    around = np.fmax(around, _length(before - after))
    with np.errstate(invalid="ignore"):
        found = missed > np.maximum(np.maximum(SKIN, usual[marker]), _CLEARLY * around)
    if not found.any():
        return None
    out = np.zeros((len(x), x.shape[2]), dtype=np.bool_)
    out[marker[found], at[found]] = True
    return out


def _length(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("nd,nd->n", vectors, vectors)))
