"""Causes of the measured impact forces: what each predicts, how well the readings bear it out, what else would tell them apart.

A hypothesis is a stop of unknown stiffness and one or two further causes, each with a prior. The likelihood of a reading is
normal about the predicted force; that of a reading beyond the sensor's range, which is a bound, the chance to stay below it.
Evidence is the likelihood's mean over the priors, by Sobol' points. The information that a further reading is expected to give
about which hypothesis holds is its mutual information with the hypotheses, after the readings there are.

References
----------
D. J. C. MacKay, Information Theory, Inference, and Learning Algorithms, Cambridge (2003), ch. 28: model comparison.
D. V. Lindley, On a measure of the information provided by an experiment, doi 10.1214/aoms/1177728069.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.special import log_ndtr, logsumexp
from scipy.stats import qmc

from buckler.mbs.geometry import Array
from buckler.mbs.laws.pieces import Reals

from ..kit.published import IMPACT_FORCE, IMPACT_SPEED, SENSOR_RANGE, SENSOR_VOLTAGE, VOLTAGE_FORCES

DEAD_BAND = (0.0, 1.8)
"""Prior of the voltage below which the motor does not turn, V; uniform."""
RANGES = {"stop_stiffness": (1e3, 2e5), "bow": (1e-3, 0.03), "motor": (0.2, 20.0), "compliance": (1e-3, 1.0)}
"""Priors, uniform in the logarithm: N/m, 1, N m s, rad/(N m)."""
FLOOR = 1e-3
"""Least force, N, or time, s, that is interpolated; also where a strike does not happen."""
SCRAMBLES = 8
"""Sobol' sets of a hypothesis; their scatter gives the error of its evidence."""
CAUSES = ("bow", "gravity", "motor", "dead_band", "compliance")


class Reading(NamedTuple):
    """A measured force, N: at a voltage, V, or at the known crank speed; or a bound it did not exceed."""

    force: float
    voltage: float | None
    bound: bool = False


READINGS = (
    Reading(IMPACT_FORCE, None),
    *(Reading(force, voltage) for voltage, force in VOLTAGE_FORCES.items()),
    Reading(SENSOR_RANGE, SENSOR_VOLTAGE, bound=True),
)
"""Figs 5, 10 and 11, and the range of the sensor at the highest voltage."""


@dataclass(frozen=True)
class Hypothesis:
    """A stop of unknown stiffness and these causes, at most two, of which one of motor and compliance."""

    causes: tuple[str, ...]

    @property
    def name(self) -> str:
        """`stop`, or the causes joined."""
        return "_".join(self.causes) or "stop"

    @property
    def axes(self) -> tuple[str, ...]:
        """What is unknown, in the order of the unit cube."""
        return ("stop_stiffness", *self.causes)

    def values(self, unit: Array) -> dict[str, Array]:
        """Values at points of the unit cube, shape (points, axes)."""
        found = {}
        for name, x in zip(self.axes, unit.T, strict=True):
            if name == "gravity":
                found[name] = np.where(x < 0.5, -1.0, 1.0)
            elif name == "dead_band":
                found[name] = DEAD_BAND[0] + (DEAD_BAND[1] - DEAD_BAND[0]) * x
            else:
                low, high = RANGES[name]
                found[name] = low * (high / low) ** x
        return found


def hypotheses(causes: Sequence[str] = CAUSES, pairs: bool = True) -> list[Hypothesis]:
    """The stop alone, with each cause, and with pairs of them."""
    found = [Hypothesis(()), *(Hypothesis((cause,)) for cause in causes)]
    if pairs:
        two = [(a, b) for i, a in enumerate(causes) for b in causes[i + 1 :]]
        found += [Hypothesis(pair) for pair in two if set(pair) != {"motor", "compliance"}]
    return found


def crank_speed(voltage: float | None, dead_band: Reals, reference: float) -> Reals:
    """Speed, rad/s: proportional to the voltage less the dead band, 1.25 rad/s at the reference voltage."""
    if voltage is None:
        return IMPACT_SPEED + 0 * np.asarray(dead_band)
    return IMPACT_SPEED * (voltage - dead_band) / (reference - dead_band)


class Strikes:
    """Numbers of strikes over the unit cube of a hypothesis: simulated at some points, interpolated between them.

    Logarithms, over those of the unknowns, by thin plates with a power law below them; for gravity's two directions apart.
    """

    def __init__(self, hypothesis: Hypothesis, simulate: Callable[[Mapping[str, Array]], Array]) -> None:
        self.hypothesis, self.simulate = hypothesis, simulate
        self.unit, self.logs = np.empty((0, len(hypothesis.axes))), np.empty((0, 0))

    def add(self, unit: Array) -> Array:
        """Simulate at further points; how far the readings' forces were off there before, shape (points, readings)."""
        found = np.log(np.maximum(np.nan_to_num(self.simulate(self.hypothesis.values(unit)), nan=FLOOR), FLOOR))
        off = np.expm1(self(unit) - found)[:, : len(READINGS)] if len(self.logs) else np.full((len(unit), len(READINGS)), np.nan)
        self.unit = np.vstack([self.unit, unit])
        self.logs = np.vstack([self.logs.reshape(-1, found.shape[1]), found])
        return off

    def __call__(self, unit: Array) -> Array:
        """Logarithms at points, shape (points, numbers)."""
        out = np.empty((len(unit), self.logs.shape[1]))
        smooth = [k for k, name in enumerate(self.hypothesis.axes) if name != "gravity"]
        (mine, side), ups = (self._up(x) for x in (self.unit, unit)), (False, True)
        for up in ups:
            if (side == up).any():
                known = mine == up
                shape = RBFInterpolator(self.unit[known][:, smooth], self.logs[known], kernel="thin_plate_spline")
                out[side == up] = shape(unit[side == up][:, smooth])
        return np.clip(out, self.logs.min(axis=0) - 1.0, self.logs.max(axis=0) + 1.0)

    def spread(self, unit: Array, count: int) -> Array:
        """So many of some points, each the farthest from those simulated and chosen so far: no two are near each other."""
        chosen, apart = list[Array](), np.linalg.norm(unit[:, None] - self.unit[None], axis=2).min(axis=1)
        for _ in range(count):
            chosen.append(unit[np.argmax(apart)])
            apart = np.minimum(apart, np.linalg.norm(unit - chosen[-1], axis=1))
        return np.array(chosen)

    def _up(self, unit: Array) -> Array:
        """Whether gravity pulls the other way."""
        axes = self.hypothesis.axes
        return unit[:, axes.index("gravity")] >= 0.5 if "gravity" in axes else np.zeros(len(unit), dtype=bool)


def log_likelihood(forces: Sequence[Array], sd: float, model_error: float) -> Array:
    """Of all `READINGS`, for predicted forces of each; sd of a reading, N, and relative error of the prediction."""
    total = 0.0
    for reading, force in zip(READINGS, forces, strict=True):
        spread = np.hypot(sd, model_error * force)
        z = (reading.force - force) / spread
        total = total + (log_ndtr(z) if reading.bound else -0.5 * z**2 - np.log(spread * np.sqrt(2 * np.pi)))
    return np.asarray(total)


class Posterior(NamedTuple):
    """What the readings make of a hypothesis.

    Attributes
    ----------
    log_evidence, error : natural logarithm, and its standard error
    unit : drawn from the posterior, in the unit cube, shape (samples, axes)
    best : where the likelihood is largest, likewise, shape (axes,)
    numbers : of the strikes at the samples: forces of the readings, then the others, shape (samples, numbers)
    """

    hypothesis: Hypothesis
    log_evidence: float
    error: float
    unit: Array
    best: Array
    numbers: Array

    @property
    def forces(self) -> Array:
        """Of the readings, N, shape (readings, samples)."""
        return self.numbers[:, : len(READINGS)].T


def posterior(
    strikes: Callable[[Array], Array],
    hypothesis: Hypothesis,
    *,
    points: int,
    samples: int,
    sd: float,
    model_error: float,
    seed: int,
) -> Posterior:
    """Integrate over the priors by `SCRAMBLES` Sobol' sets of so many points, a power of two, and draw samples.

    `strikes` gives the logarithms of the strikes' numbers at points of the unit cube, those of the readings first.
    """
    draw = np.random.default_rng(seed)
    unit = np.concatenate([qmc.Sobol(len(hypothesis.axes), rng=draw).random(points) for _ in range(SCRAMBLES)])
    numbers = np.exp(strikes(unit))
    log_l = log_likelihood(list(numbers.T[: len(READINGS)]), sd, model_error)
    parts = logsumexp(log_l.reshape(SCRAMBLES, points), axis=1) - np.log(points)
    evidence = float(logsumexp(parts) - np.log(SCRAMBLES))
    weights = np.exp(log_l - log_l.max())
    chosen = draw.choice(len(unit), samples, p=weights / weights.sum())
    scatter = float(np.exp(parts - evidence).std(ddof=1) / np.sqrt(SCRAMBLES))
    return Posterior(hypothesis, evidence, scatter, unit[chosen], unit[np.argmax(log_l)], numbers[chosen])


def probabilities(found: Sequence[Posterior]) -> Array:
    """Of the hypotheses, alike before the readings."""
    logs = np.array([each.log_evidence for each in found])
    return np.exp(logs - logsumexp(logs))


def information(readings: Sequence[Array], weights: Array, sd: float, seed: int = 0) -> float:
    """Expected information about which hypothesis holds, in bits, from one reading of this error.

    Parameters
    ----------
    readings : what it predicts, over its posterior, shape (samples,) for each hypothesis
    weights : probability of each, shape (hypotheses,)
    sd : of the reading, normal
    """
    draw, total = np.random.default_rng(seed), 0.0
    for k, (mine, weight) in enumerate(zip(readings, weights, strict=True)):
        if weight < 1e-6:
            continue
        read = mine + sd * draw.standard_normal(len(mine))
        densities = np.stack([np.exp(-0.5 * ((read[:, None] - other[None]) / sd) ** 2).mean(axis=1) for other in readings])
        total += weight * float(np.mean(np.log2(np.maximum(densities[k], 1e-300) / np.maximum(weights @ densities, 1e-300))))
    return total
