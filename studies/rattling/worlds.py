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
from math import pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest, qmc

from buckler.studies.kit.published import DAMPING_UNITS
from buckler.studies.rattling import buffering_world as world
from buckler.studies.rattling.assumptions import BODIES, DAMPINGS, JOINTS, KINDS

Array = np.ndarray[Any, Any]
DIRECTIONS = {"-y": -pi / 2, "+y": pi / 2, "-x": pi, "+x": 0.0}
"""Of gravity in the plane, from the frame."""
STANDARD = 9.81
COUNTS = {"2 + 1": (2, 1), "3 + 1": (3, 1), "6 + 3": (6, 3)}
"""Bending and axial modes of a free rocker."""


@dataclass(frozen=True)
class Assumption:
    """One thing left open: words to choose from alike, or a number alike in its logarithm from `low` to `high`.

    Attributes
    ----------
    factor, unit : float, str
        What a number is shown in.
    """

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


def drawn(count: int, seed: int, **shared: Any) -> Worlds:
    """Draw worlds from a scrambled Sobol' sequence; the first of them are the same for any count.

    Parameters
    ----------
    count : int
        A power of two keeps the set even.
    seed : int
        Of the scrambling.
    **shared
        Parameters of every world.
    """
    sobol = qmc.Sobol(len(ASSUMPTIONS), rng=np.random.default_rng(seed))
    points = sobol.random_base2(max(0, (count - 1).bit_length()))[:count]
    values = [{a.name: a.draw(x) for a, x in zip(ASSUMPTIONS, point, strict=True)} for point in points]
    return Worlds(values, [parameters(each, number, **shared) for number, each in enumerate(values)])


def parameters(values: dict[str, Any], number: int, **shared: Any) -> world.Parameters:
    """One world's parameters; its number makes its seeds its own."""
    down = values["gravity"]
    return world.Parameters(
        gravity=0.0 if down == "off" else STANDARD,
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


def wilson(hits: int, of: int, level: float = 0.05) -> tuple[float, float]:
    """Wilson's interval of a share, of confidence 1 - level."""
    if not of:
        return 0.0, 1.0
    found = binomtest(hits, of).proportion_ci(1 - level, "wilson")
    return float(found.low), float(found.high)


class Split(NamedTuple):
    """The split of one assumption that divides best: its number, which values are on the first side, and what is gained.

    Attributes
    ----------
    place : int
        Among `ASSUMPTIONS`.
    side : tuple of float, or float
        Codes of the words on the first side, or the number below which it lies.
    gain : float
        Fall of the Gini impurity, times the worlds.
    """

    place: int
    side: tuple[float, ...] | float
    gain: float

    def first(self, codes: Array) -> Array:
        """Which worlds are on the first side."""
        column = codes[:, self.place]
        return np.isin(column, self.side) if isinstance(self.side, tuple) else column < self.side


def _impurity(hits: Array, of: Array) -> Array:
    """2 n p (1 - p)."""
    return 2 * hits * (1 - hits / np.maximum(of, 1))


def _best_of(codes: Array, answers: Array, place: int, least: int) -> Split:
    """Best split of one assumption; words are ordered by their share, numbers by themselves; then one cut decides."""
    column, words = codes[:, place], bool(ASSUMPTIONS[place].words)
    kinds = np.unique(column)
    hits, of = (np.array([(w * (column == k)).sum() for k in kinds]) for w in (answers, np.ones_like(answers)))
    order = np.argsort(hits / of, kind="stable") if words else np.arange(len(kinds))
    left_hits, left = np.cumsum(hits[order])[:-1], np.cumsum(of[order])[:-1]
    gain = _impurity(hits.sum(), of.sum()) - _impurity(left_hits, left) - _impurity(hits.sum() - left_hits, of.sum() - left)
    gain[(left < least) | (of.sum() - left < least)] = -1.0
    if not gain.size or gain.max() < 0:
        return Split(place, (), -1.0)
    cut = int(np.argmax(gain))
    if words:
        return Split(place, tuple(sorted(kinds[order[: cut + 1]].tolist())), float(gain[cut]))
    low, high = kinds[cut], kinds[cut + 1]
    return Split(place, float(sqrt(low * high)), float(gain[cut]))


def best_split(codes: Array, answers: Array, *, least: int = 8, shuffles: int = 19, seed: int = 0) -> Split | None:
    """The split that divides best, or None if shuffled answers are divided as well: chance of a false one 1/(shuffles + 1).

    Parameters
    ----------
    codes : array, shape (worlds, assumptions)
    answers : array of 0 and 1, shape (worlds,)
    least : int
        Worlds on either side.
    """

    def best(a: Array) -> Split:
        return max((_best_of(codes, a, k, least) for k in range(codes.shape[1])), key=lambda split: split.gain)

    if answers.min(initial=1.0) == answers.max(initial=0.0):
        return None
    found, draw = best(answers), np.random.default_rng(seed)
    if found.gain <= max((best(draw.permutation(answers)).gain for _ in range(shuffles)), default=0.0):
        return None
    return found


class Tree(NamedTuple):
    """Two questions: the first of all worlds, the second of either side; None where no question divides."""

    root: Split | None
    branches: tuple[Split | None, Split | None]


def grown(codes: Array, answers: Array, seed: int = 0) -> Tree:
    """The tree of depth two."""
    root = best_split(codes, answers, seed=seed)
    if root is None:
        return Tree(None, (None, None))
    side = root.first(codes)
    first, second = (best_split(codes[k], answers[k], seed=seed + 1) for k in (side, ~side))
    return Tree(root, (first, second))


def leaves(tree: Tree, codes: Array) -> list[tuple[str, Array]]:
    """What leads to each end of the tree, in words, and which worlds are there."""
    everywhere = np.ones(len(codes), dtype=bool)
    if tree.root is None:
        return [("all worlds", everywhere)]
    found = []
    for split, side, branch in zip((tree.root,) * 2, (True, False), tree.branches, strict=True):
        here = split.first(codes) == side
        for inner in (True, False) if branch else (True,):
            there = here & (branch.first(codes) == inner) if branch else here
            words = [_words(split, side)] + ([_words(branch, inner)] if branch else [])
            found.append((", ".join(words), there))
    return found


def _words(split: Split, first: bool) -> str:
    """One side of a split."""
    assumption = ASSUMPTIONS[split.place]
    if first:
        return assumption.question(split.side)
    if isinstance(split.side, tuple):
        rest = tuple(float(k) for k in range(len(assumption.words)) if k not in split.side)
        return assumption.question(rest)
    return assumption.question(split.side).replace(" below ", " from ")


def sentence(share: float, low: float, high: float, tree: Tree, codes: Array, answers: Array) -> str:
    """Verdict of one claim."""
    if low > 0.5:
        verdict = "holds in most worlds" if low < 0.95 else "holds in nearly every world"
    else:
        verdict = "fails in most worlds" if high < 0.5 else "holds in about half of the worlds"
        verdict = "fails in nearly every world" if high < 0.05 else verdict
    text = f"{verdict} ({share:.0%}, {low:.0%} to {high:.0%})"
    if tree.root is None:
        return f"{text}; no single assumption decides it"
    parts = [f"{answers[here].mean():.0%} with {words}" for words, here in leaves(tree, codes) if here.any()]
    return f"{text}: " + "; ".join(parts)
