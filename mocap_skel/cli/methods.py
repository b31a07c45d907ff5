"""mocap-skel methods: the thesis's table of estimators, measured on this machine."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from mocap_skel.cli import options, say


@click.command("methods", epilog="Example: mocap-skel methods")
@click.option(
    "--trials", type=click.IntRange(2), default=100, show_default=True, help="For the accuracy."
)
@options.seed
@options.as_json
def command(trials: int, seed: int, as_json: bool) -> int:
    """Compare the sphere fits: the thesis's Table 4, with figures measured now, in some seconds.

    Columns: operations a sample by the thesis; time by GDKE's for 100,000 points on one core; error by the
    Cramér-Rao bound (1 is the bound) on a whole sphere, on a cap of half-angle 45 degrees and on one of 20
    degrees with more noise; relative error for an exact sphere far from the origin. 'mocap-skel study'
    goes into each of them.
    """
    from mocap_skel.studies.parallel import use_one_core

    use_one_core()
    from mocap_skel.report.terminal import table
    from mocap_skel.studies import table4
    from mocap_skel.studies.flops import figure_flops

    rows = list(table4.methods(seed, trials))
    if as_json:
        for row in rows:
            say(json.dumps(asdict(row), allow_nan=False, ensure_ascii=False))
        return 0
    conditions = [f"σ/r {noise:g}, {angle:g}°" for noise, angle in table4.CONDITIONS]
    head = ["method", "flops", "time", *conditions, "digits", "for it", "against it"]
    cells = [
        [
            row.name,
            f"{row.flops}N" if row.flops else "-",
            "-" if row.time is None else f"{row.time:.2f}",
            *(
                "-" if row.errors is None else f"{e:.2f}"
                for e in row.errors or (0,) * len(conditions)
            ),
            "-" if row.digits is None else f"{row.digits:.0e}",
            row.for_it,
            row.against_it,
        ]
        for row in rows
    ]
    say(table(head, cells, frozenset({0, len(head) - 2, len(head) - 1})))
    say(
        f"\nseed {seed}, {trials} trials of 1000 points know an error to {71 / trials**0.5:.0f} %; time: {table4.POINTS:,} points, GDKE = 1; "
        "σ/r ...: error by the Cramér-Rao bound; digits: relative error of an exact sphere of "
        f"{100 * table4.RADIUS:g} cm, {table4.DISTANCE:g} m from the origin"
    )
    say(
        f"A figure of 14 segments and 5 leaves takes {figure_flops(14, 5)} operations a frame (241), the "
        f"standard one of 15 and 5 {figure_flops(15, 5)}."
    )
    if any(row.time is None for row in rows):
        say("MLE: needs SciPy: pip install 'mocap-skel[mle]'")
    return 0
