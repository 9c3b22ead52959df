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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.special import log_ndtr, logsumexp
from scipy.stats import qmc

from buckler.studies.kit.published import IMPACT_FORCE, IMPACT_SPEED, SENSOR_RANGE, SENSOR_VOLTAGE, VOLTAGE_FORCES
from buckler.studies.striking.emulator import RANGES, STRAIGHT, Emulator

Array = np.ndarray[Any, Any]
DEAD_BAND = (0.0, 1.8)
"""Prior of the voltage below which the motor does not turn, V; uniform."""
BOW = (1e-3, RANGES["bow"][1])
"""Prior of a bow, over the strip's length; like those of stiffness, motor and compliance uniform in its logarithm."""
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
                low, high = BOW if name == "bow" else RANGES[name]
                found[name] = low * (high / low) ** x
        return found


def hypotheses(causes: Sequence[str] = CAUSES, pairs: bool = True) -> list[Hypothesis]:
    """The stop alone, with each cause, and with pairs of them."""
    found = [Hypothesis(()), *(Hypothesis((cause,)) for cause in causes)]
    if pairs:
        two = [(a, b) for i, a in enumerate(causes) for b in causes[i + 1 :]]
        found += [Hypothesis(pair) for pair in two if set(pair) != {"motor", "compliance"}]
    return found


def crank_speed(voltage: float | None, dead_band: Any, reference: float) -> Any:
    """Speed, rad/s: proportional to the voltage less the dead band, 1.25 rad/s at the reference voltage."""
    if voltage is None:
        return IMPACT_SPEED + 0 * np.asarray(dead_band)
    return IMPACT_SPEED * (voltage - dead_band) / (reference - dead_band)


def asked(values: Mapping[str, Array], voltage: float | None, reference: float) -> tuple[str, dict[str, Array]]:
    """Table of the emulator, without gravity, and points of its axes, for values of a hypothesis at a reading."""
    some = values["stop_stiffness"]
    point = {"stop_stiffness": some, "speed": crank_speed(voltage, values.get("dead_band", 0.0 * some), reference)}
    point["bow"] = values.get("bow", np.full_like(some, STRAIGHT))
    drive = next((name for name in ("motor", "compliance") if name in values), "")
    if drive:
        point[drive] = values[drive]
    return drive or "rigid", point


def predicted(
    emulator: Emulator, values: Mapping[str, Array], voltage: float | None, reference: float, what: str = "peak"
) -> Array:
    """A number of a strike, for each of the values of a hypothesis, shape (points,)."""
    table, point = asked(values, voltage, reference)
    if "gravity" not in values:
        return emulator(table, what, **point)
    return np.where(values["gravity"] < 0, *(emulator(f"{table}{g}", what, **point) for g in ("-y", "+y")))


def where(found: Posterior, count: int, reference: float, seed: int) -> list[tuple[str, dict[str, float]]]:
    """Strikes that a posterior is about: table and point, for so many of its samples at every reading."""
    chosen = np.random.default_rng(seed).choice(len(found.values["stop_stiffness"]), count, replace=False)
    strikes = []
    for reading in READINGS:
        table, point = asked(found.values, reading.voltage, reference)
        for i in chosen:
            sign = {-1.0: "-y", 1.0: "+y"}.get(float(found.values["gravity"][i]), "") if "gravity" in found.values else ""
            strikes.append((f"{table}{sign}", {name: float(x[i]) for name, x in point.items()}))
    return strikes


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
    log_evidence, error : float
        Natural logarithm, and its standard error.
    values : dict of str to array, shape (samples,)
        Drawn from the posterior.
    best : dict of str to float
        Where the likelihood is largest.
    forces : array, shape (readings, samples)
        Predicted, at the samples.
    """

    hypothesis: Hypothesis
    log_evidence: float
    error: float
    values: dict[str, Array]
    best: dict[str, float]
    forces: Array


def posterior(
    emulator: Emulator, hypothesis: Hypothesis, *, points: int, samples: int, sd: float, model_error: float, reference: float,
    seed: int,
) -> Posterior:  # fmt: skip
    """Integrate over the priors by `SCRAMBLES` Sobol' sets of so many points, a power of two, and draw samples."""
    draw = np.random.default_rng(seed)
    unit = np.concatenate([qmc.Sobol(len(hypothesis.axes), rng=draw).random(points) for _ in range(SCRAMBLES)])
    values = hypothesis.values(unit)
    forces = np.stack([predicted(emulator, values, reading.voltage, reference) for reading in READINGS])
    log_l = log_likelihood(list(forces), sd, model_error)
    parts = logsumexp(log_l.reshape(SCRAMBLES, points), axis=1) - np.log(points)
    evidence = float(logsumexp(parts) - np.log(SCRAMBLES))
    scatter = np.exp(parts - evidence)
    weights = np.exp(log_l - log_l.max())
    chosen = draw.choice(len(unit), samples, p=weights / weights.sum())
    top = int(np.argmax(log_l))
    return Posterior(
        hypothesis, evidence, float(scatter.std(ddof=1) / np.sqrt(SCRAMBLES)),
        {name: x[chosen] for name, x in values.items()}, {name: float(x[top]) for name, x in values.items()}, forces[:, chosen],
    )  # fmt: skip


def probabilities(found: Sequence[Posterior]) -> Array:
    """Of the hypotheses, alike before the readings."""
    logs = np.array([each.log_evidence for each in found])
    return np.exp(logs - logsumexp(logs))


def information(readings: Sequence[Array], weights: Array, sd: float, seed: int = 0) -> float:
    """Expected information about which hypothesis holds, in bits, from one reading of this error.

    Parameters
    ----------
    readings : one array of shape (samples,) for each hypothesis
        What it predicts, over its posterior.
    weights : array, shape (hypotheses,)
        Probability of each.
    sd : float
        Of the reading, normal.
    """
    draw, total = np.random.default_rng(seed), 0.0
    for k, (mine, weight) in enumerate(zip(readings, weights, strict=True)):
        if weight < 1e-6:
            continue
        read = mine + sd * draw.standard_normal(len(mine))
        densities = np.stack([np.exp(-0.5 * ((read[:, None] - other[None]) / sd) ** 2).mean(axis=1) for other in readings])
        total += weight * float(np.mean(np.log2(np.maximum(densities[k], 1e-300) / np.maximum(weights @ densities, 1e-300))))
    return total
