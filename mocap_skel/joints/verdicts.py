"""Whether the movement shows a joint, and in plain words why not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# From the worst to the best.
VERDICTS = ("no", "weak", "yes")
# At 3 the noise is a tenth of the variance in the weakest direction, so that an error of half in the noise
# level moves the centre by a twentieth of its distance.
SAFE_RATIO = 3.0
# Metres: a standard error above it is no joint centre that a lab would publish, and skin moves by less
# than such a residual.
SAFE_ERROR = 0.01
SAFE_RESIDUAL = 0.01
# Metres: skin on a person who stands still moves that much, however smooth the clip.
LEAST_SPREAD = 0.003


class Verdict(NamedTuple):
    """What the movement shows of a joint: one of `VERDICTS`, and the reason, "" for yes."""

    shown: str
    reason: str = ""


def by_movement(rank: int, weakest: float, residual: float, over_noise: float) -> Verdict:
    """Whether the movement is wide enough to show the joint.

    The thesis's criterion, σ < √λ_min, with the noise that is really there: the radial residual, and
    the spread that the noise of the parent's frame makes out of nothing.

    Args:
        rank: how many directions were solved, 0 to 3.
        weakest: √λ_min, the standard deviation of the markers in their weakest direction, metres.
        residual: root mean square of the radial residuals, metres.
        over_noise: smallest ratio, over directions, of the markers' spread to what noise alone makes.

    >>> by_movement(rank=3, weakest=0.05, residual=0.002, over_noise=40.0)
    Verdict(shown='yes', reason='')
    >>> by_movement(rank=2, weakest=0.0, residual=0.002, over_noise=1.0).reason
    'turns about one axis only: not shown along it'
    """
    if rank == 0:
        return Verdict("no", "hardly moves")
    if rank == 1:
        return Verdict("no", "moves along one line only")
    if rank == 2:
        return Verdict("no", "turns about one axis only: not shown along it")
    if weakest < LEAST_SPREAD:
        return Verdict(
            "no", f"moves only {1e3 * weakest:.1f} mm in one direction: skin alone does that"
        )
    # Variances add up: a spread of √2 times the noise is as much movement as noise.
    if weakest <= residual or over_noise <= np.sqrt(2.0):
        return Verdict("no", "moves less than its noise in one direction")
    if weakest <= SAFE_RATIO * residual or over_noise <= SAFE_RATIO:
        return Verdict(
            "weak", f"moves only {100 * weakest:.1f} cm in one direction, little above its noise"
        )
    return Verdict("yes")


def by_numbers(residual: float, error: float) -> Verdict:
    """Whether the residual and the standard error of a fitted joint deserve trust.

    Args:
        residual: root mean square of the radial residuals, metres.
        error: standard error in the worst direction, metres, without what skin adds.

    >>> by_numbers(residual=0.002, error=0.03)
    Verdict(shown='weak', reason='standard error 3.0 cm in one direction')
    """
    if residual > SAFE_RESIDUAL:
        return Verdict(
            "weak",
            f"its markers do not keep their distance ({100 * residual:.1f} cm): swapped or wrongly "
            "assigned?",
        )
    if error > SAFE_ERROR:
        return Verdict("weak", f"standard error {100 * error:.1f} cm in one direction")
    return Verdict("yes")


def by_error(error: float) -> Verdict:
    """Whether a joint's whole standard error, skin and anatomy counted in, deserves a "yes".

    Args:
        error: in the worst direction, metres.

    >>> by_error(0.004).shown, by_error(0.016).reason
    ('yes', 'standard error 1.6 cm in one direction with skin')
    """
    if error > SAFE_ERROR:
        return Verdict("weak", f"standard error {100 * error:.1f} cm in one direction with skin")
    return Verdict("yes")


def wide_enough(weakest: float, residual: float) -> bool:
    """Whether the movement was made that shows a joint: what is left of its error, more of the same does not take away.

    Args:
        weakest: √λ_min, the standard deviation of the markers in their weakest direction, metres.
        residual: root mean square of the radial residuals, metres.

    >>> wide_enough(0.045, 0.003), wide_enough(0.008, 0.005)
    (True, False)
    """
    return weakest > max(SAFE_RATIO * residual, LEAST_SPREAD)


def worst(*verdicts: Verdict) -> Verdict:
    """The worst of some verdicts; of equal ones the first.

    >>> worst(Verdict("yes"), Verdict("weak", "a"), Verdict("weak", "b"))
    Verdict(shown='weak', reason='a')
    """
    return min(verdicts, key=lambda verdict: VERDICTS.index(verdict.shown))
