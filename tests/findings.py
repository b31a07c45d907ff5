"""What the tests of the studies share: answers, scores and trials of a known law, a short clip, files as they lie."""

import csv
import io
from functools import cache, partial

import numpy as np
from recordings import clip_of
from recordings import fit_clip as fit_with_anatomy

from mocap_skel.artificial import Faults, human, marker_set, range_of_motion, record
from mocap_skel.studies import speed
from mocap_skel.studies.accuracy import Plan, Score
from mocap_skel.studies.resample import Answer

EPS = np.finfo(float).eps

# The studies are of the thesis's pure fits.
fit_clip = partial(fit_with_anatomy, prior="none")


def answer(place, samples=500, joint="LeftKnee", frame="a b c", method="MGDK", passed=0, level=0):
    x, y, z = map(float, place)
    return Answer(passed, level, samples, joint, samples, method, frame, x, y, z)


def scattered(rng, count, scale=0.01, at=(0.0, 0.0, 0.0), whole=None, draw=None, **more):
    """Answers whose deviation falls as 1/√samples (10 to 1,000), or as for a clip of so many frames."""
    samples = np.round(10 ** rng.uniform(1, 3, count)).astype(int)
    found = []
    for n in samples:
        free = 1 / n - (1 / whole if whole else 0.0)
        away = rng.normal(size=3) if draw is None else draw(rng)
        found.append(answer(at + scale * np.sqrt(free) * away, int(n), **more))
    return found


def mirrored(samples, length, joint="LeftKnee"):
    """Two answers for each number of samples, so far to either side: their mean is known exactly."""
    rng = np.random.default_rng(0)
    found = []
    for n in samples:
        way = rng.normal(size=3)
        way *= length(n) / np.linalg.norm(way)
        found += [answer(way, n, joint), answer(-way, n, joint)]
    return found


@cache
def short_clip():
    """300 frames, every joint through its range."""
    return clip_of(short_recording())


@cache
def short_recording():
    motion = range_of_motion(10, 30, seed=1)
    return record(human(), marker_set("cmu"), motion, Faults(sigma=0.001), seed=1)


def there(folder):
    return sorted(p.name for p in folder.rglob("*") if p.is_file()) if folder.exists() else []


def rows_of(path):
    return list(csv.DictReader(io.StringIO(path.read_text())))


def contents(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


CHEAP = ("gdke", "ugdk", "pratt")
GRID = Plan(
    noises=(0.001, 0.01, 0.05, 0.1), angles=(20.0, 45.0, 80.0, 135.0, 180.0), count=400, trials=100,
    methods=CHEAP,
)  # fmt: skip


def a_score(method, ratio, noise=0.01, angle=45.0, failed=0.0, criterion=True):
    return Score(method, noise, angle, 0.0, ratio * 0.1, 0.1, ratio, failed, criterion)


def a_trial(points=20_000, noise=0.1, **seconds):
    every = dict.fromkeys(speed.METHODS, 1e-3) | seconds
    return speed.Trial(points, noise, 90.0, 1.0, every)
