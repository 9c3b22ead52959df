"""Worlds of the crank-rocker: a Sobol' set over what the paper leaves open, the share of worlds in which a claim holds, and why.

**Holds** in a world: the flexible rocker's number is smaller than the rigid one's by `margin` at least. The share of worlds has
Wilson's interval. **Decided by**: a tree of two questions, each the one split of one assumption that divides the worlds best
(Gini). A question counts only if it divides better than it does in all but one of twenty shuffled copies of the answers.

References
----------
E. B. Wilson, Probable inference, the law of succession, and statistical inference, doi 10.1080/01621459.1927.10502953.
L. Breiman et al., Classification and Regression Trees, doi 10.1201/9781315139470.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import pi
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest, qmc

from buckler.mbs.geometry import Array

from ..kit.published import DAMPING_UNITS, GRAVITY
from . import buffering_world as world
from .assumptions import BODIES, DAMPINGS, JOINTS, KINDS

DIRECTIONS = {"-y": -pi / 2, "+y": pi / 2, "-x": pi, "+x": 0.0}
"""Of gravity in the plane, from the frame."""
COUNTS = {"2 + 1": (2, 1), "3 + 1": (3, 1), "6 + 3": (6, 3)}
"""Bending and axial modes of a free rocker."""


@dataclass(frozen=True)
class Assumption:
    """One thing left open: words to choose from alike, or a number alike in its logarithm from `low` to `high`."""

    name: str
    words: tuple[str, ...] = ()
    low: float = 0.0
    high: float = 0.0
    factor: float = 1.0
    unit: str = ""

    def draw(self, x: float) -> Any:
        """Value at x in [0, 1)."""
        if self.words:
            return self.words[min(int(x * len(self.words)), len(self.words) - 1)]
        return self.low * (self.high / self.low) ** x

    def code(self, value: Any) -> float:
        """As a number that a split can divide: place among the words, or the number itself."""
        return float(self.words.index(value)) if self.words else float(value)

    def question(self, splits: tuple[float, ...] | float) -> str:
        """What it says in words to be on a split's first side."""
        if isinstance(splits, tuple):
            return f"{self.name} {' or '.join(self.words[int(k)] for k in splits)}"
        return f"{self.name} below {self.factor * splits:.3g} {self.unit}".rstrip()


ASSUMPTIONS = (
    Assumption("gravity", ("off", *DIRECTIONS)),
    *(Assumption(f"pin {joint}", BODIES[joint]) for joint in JOINTS),
    Assumption("pin radius", low=2.8e-3, high=1e-2, factor=1e3, unit="mm"),
    Assumption("modal damping", tuple(DAMPINGS)),
    Assumption("damping ratio", low=2e-3, high=5e-2),
    Assumption("friction thresholds", low=0.1, high=1.0, factor=0.1, unit="m/s (static)"),
    Assumption("modes", KINDS),
    Assumption("number of modes", tuple(COUNTS)),
    Assumption("rocker's frequency", low=0.9, high=1.1, unit="of the bar's"),
    Assumption("c_max in", tuple(DAMPING_UNITS)),
    Assumption("bending plane", ("20 mm", "5 mm")),
    Assumption("clearance", low=5e-5, high=5e-4, factor=1e3, unit="mm"),
)
"""Everything that is varied, in the order of the Sobol' set; metrics name them by their place, from 0."""
DEPTHS = {"20 mm": 20e-3, "5 mm": 5e-3}


class Worlds(NamedTuple):
    """Values of all `ASSUMPTIONS` in each world, and the parameters that they make."""

    values: list[dict[str, Any]]
    cases: list[world.Parameters]

    @property
    def codes(self) -> Array:
        """Values as numbers, shape (worlds, assumptions)."""
        return np.array([[a.code(each[a.name]) for a in ASSUMPTIONS] for each in self.values])


def drawn(count: int, seed: int, **shared: object) -> Worlds:
    """Draw worlds from a Sobol' sequence scrambled by a seed; the first are the same for any count, a power of two is even."""
    sobol = qmc.Sobol(len(ASSUMPTIONS), rng=np.random.default_rng(seed))
    points = sobol.random_base2(max(0, (count - 1).bit_length()))[:count]
    values = [{a.name: a.draw(x) for a, x in zip(ASSUMPTIONS, point, strict=True)} for point in points]
    return Worlds(values, [parameters(each, number, **shared) for number, each in enumerate(values)])


def parameters(values: dict[str, Any], number: int, **shared: Any) -> world.Parameters:
    """One world's parameters; its number makes its seeds its own."""
    down = values["gravity"]
    return world.Parameters(
        gravity=0.0 if down == "off" else GRAVITY,
        gravity_angle=DIRECTIONS.get(down, -pi / 2),
        pin_on=tuple(f"{joint}.{values[f'pin {joint}']}" for joint in JOINTS),
        pin=values["pin radius"],
        modal_damping=values["modal damping"],
        rocker_damping=values["damping ratio"],
        friction_thresholds=values["friction thresholds"],
        modes_of=values["modes"],
        bending=COUNTS[values["number of modes"]][0],
        axial=COUNTS[values["number of modes"]][1],
        frequency_factor=values["rocker's frequency"],
        damping_unit=values["c_max in"],
        in_plane_depth=DEPTHS[values["bending plane"]],
        clearance=values["clearance"],
        seed=number,
        **shared,
    )


def wilson(hits: int, of: int) -> tuple[float, float]:
    """Wilson's interval of a share, of confidence 0.95."""
    if not of:
        return 0.0, 1.0
    found = binomtest(hits, of).proportion_ci(0.95, "wilson")
    return float(found.low), float(found.high)


class Split(NamedTuple):
    """One assumption's place among `ASSUMPTIONS`, and its first side: codes of words, or the number below which it lies."""

    place: int
    side: tuple[float, ...] | float

    def first(self, codes: Array) -> Array:
        """Which worlds are on the first side."""
        column = codes[:, self.place]
        return np.isin(column, self.side) if isinstance(self.side, tuple) else column < self.side

    def words(self, first: bool) -> str:
        """One side of it."""
        assumption = ASSUMPTIONS[self.place]
        if first or not isinstance(self.side, tuple):
            return assumption.question(self.side).replace(" below ", " below " if first else " from ")
        return assumption.question(tuple(float(k) for k in range(len(assumption.words)) if k not in self.side))


def splits(codes: Array) -> list[Split]:
    """Every way to part the worlds by one assumption: its words in two sets, or its numbers below and from one."""
    found = []
    for place, assumption in enumerate(ASSUMPTIONS):
        kinds = np.unique(codes[:, place])
        sizes = range(1, len(kinds)) if assumption.words else ()
        sides = [side for size in sizes for side in combinations(kinds.tolist(), size)]
        found += [Split(place, side) for side in sides or np.sqrt(kinds[1:] * kinds[:-1]).tolist()]
    return found


def _impurity(hits: Array, of: Array | int) -> Array:
    """2 n p (1 - p)."""
    return 2 * hits * (1 - hits / np.maximum(of, 1))


def best_split(codes: Array, answers: Array, *, least: int = 8, shuffles: int = 19, seed: int = 0) -> Split | None:
    """The split that divides best, or None if shuffled answers are divided as well: chance of a false one 1/(shuffles + 1).

    Codes have shape (worlds, assumptions), answers of 0 and 1 (worlds,); either side holds `least` worlds. Of words, the first
    side is that of fewer answers of 1.
    """
    if answers.min(initial=1.0) == answers.max(initial=0.0):
        return None
    every, draw = splits(codes), np.random.default_rng(seed)
    first = np.array([split.first(codes) for split in every], dtype=float)
    drawn = np.stack([answers, *(draw.permutation(answers) for _ in range(shuffles))], axis=1)
    all_hits, count = answers.sum(), len(answers)
    hits, of = first @ drawn, first.sum(axis=1, keepdims=True)
    gain = _impurity(all_hits, count) - _impurity(hits, of) - _impurity(all_hits - hits, count - of)
    gain = np.where(np.minimum(of, count - of) < least, -1.0, gain)
    best, *by_chance = gain.max(axis=0)
    if best <= max(by_chance, default=0.0):
        return None
    return every[min(np.flatnonzero(np.isclose(gain[:, 0], best)), key=lambda k: hits[k, 0] / of[k, 0])]


class Tree(NamedTuple):
    """What divides all worlds best, None if nothing does; what leads to each end of two questions, and which worlds are there."""

    root: Split | None
    ends: list[tuple[str, Array]]


def grown(codes: Array, answers: Array) -> Tree:
    """The tree of depth two."""
    root, ends = best_split(codes, answers), []
    if root is None:
        return Tree(None, [("all worlds", np.ones(len(codes), dtype=bool))])
    for side in (True, False):
        here = root.first(codes) == side
        branch = best_split(codes[here], answers[here], seed=1)
        if branch is None:
            ends.append((root.words(side), here))
        else:
            ends += [(f"{root.words(side)}, {branch.words(x)}", here & (branch.first(codes) == x)) for x in (True, False)]
    return Tree(root, ends)


def sentence(share: float, low: float, high: float, tree: Tree, answers: Array) -> str:
    """Verdict of one claim."""
    if low > 0.5:
        verdict = "holds in most worlds" if low < 0.95 else "holds in nearly every world"
    else:
        verdict = "fails in most worlds" if high < 0.5 else "holds in about half of the worlds"
        verdict = "fails in nearly every world" if high < 0.05 else verdict
    text = f"{verdict} ({share:.0%}, {low:.0%} to {high:.0%})"
    if tree.root is None:
        return f"{text}; no single assumption decides it"
    parts = [f"{answers[here].mean():.0%} with {words}" for words, here in tree.ends if here.any()]
    return f"{text}: " + "; ".join(parts)
