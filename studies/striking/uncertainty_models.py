"""What varies, what it does to two mechanisms, and whose variance that is.

The slider-crank in closed form: contact force F = p(u) E I cos(phi)/L^2 at the dead centre, of the exact elastica, and
impact force m (1 + e) v/dt, of the published model. A simulation gives the impact force once more, with bow, stop stiffness,
gravity and motor, which the closed form does not know. The
crank-rocker with clearance comes from the compiled reference; where its joints rattle, a run is one draw of many.

References
----------
A. Saltelli et al., Variance based sensitivity analysis of model output, Computer Physics Communications 181 (2010)
259-270, doi 10.1016/j.cpc.2009.09.018 (the estimators of `scipy.stats.sobol_indices`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np
from scipy import stats

from buckler.elastica import pinned
from buckler.mbs import Material, Mechanism, Section, sensitivities
from buckler.mbs.elements.section import STEEL
from buckler.mbs.geometry import Array
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.laws import AdamsFriction, ExactRestitution, Impact
from buckler.mbs.library import PAPER
from buckler.mbs.sensitivity.table import Sensitivities

from ..kit.published import GRAVITY, STRIP_WIDTH
from ..kit.report import Metric
from ..kit.statistics import mean
from ..rattling.assumptions import MEASURES
from ..rattling.bars import FourBarParameters
from .assumptions import StrikeAssumptions
from .impact_models import COUPLERS, IMPACT_UNTIL, coupler, striking

LEVEL = 0.95
"""Of all confidence intervals."""
Model = Callable[[Array], Array]
"""From inputs, shape (d, n), to outputs, shape (s, n)."""
CUT = 3.0
"""Standard deviations at which the normal distribution of an input ends: parts are sorted out."""
LEVELS = 8
"""Values a contact or friction law takes in the crank-rocker, alike in probability: each is compiled."""
RESAMPLED = 400
"""Resamples of a bootstrap."""
DAMPED, ELEMENTS = 0.05, 8
"""Damping ratio of a beam's first bending mode, and its elements."""
IMPACT = "impact_force"


class Input(NamedTuple):
    """Something uncertain: normal around `mean` with standard deviation `sd`, cut off at three of them."""

    name: str
    unit: str
    mean: float
    sd: float

    @property
    def distribution(self) -> Any:
        """Frozen distribution of scipy."""
        return stats.truncnorm(-CUT, CUT, loc=self.mean, scale=self.sd)


SEED = Input("chance", "1", 0.5, 0.1)
"""Stands for the seed of a run; only that its values differ matters."""


# --- variance ---------------------------------------------------------------------------------------------------------


class Indices(NamedTuple):
    """Sobol' indices of some outputs, and their distributions.

    Attributes
    ----------
    inputs, sample : independent draws of all inputs, and the outputs there, shape (d, 2 n), (s, 2 n)
    first, total : share of the variance that goes if an input is known, and that stays if all others are, shape (s, d)
    first_range, total_range : confidence intervals, by bootstrap, shape (s, d, 2)
    """

    inputs: Array
    sample: Array
    first: Array
    total: Array
    first_range: Array
    total_range: Array

    def arrays(self, outputs: Iterable[str]) -> dict[str, Array]:
        """What goes to signals.npz, the outputs by their names."""
        return {**dict(zip(outputs, self.sample, strict=True)), **{k: x for k, x in self._asdict().items() if k != "sample"}}

    def metrics(self, outputs: Mapping[str, str], inputs: Sequence[Input]) -> dict[str, Metric]:
        """Mean, standard deviation, quantiles and indices of outputs with these units; an index's error is half its interval."""
        found: dict[str, Metric] = {}
        for s, (name, unit) in enumerate(outputs.items()):
            values = self.sample[s]
            error = float(np.sqrt(0.5 / (values.size - 1)))  # as for normal numbers
            found |= {f"{name}.mean": mean(unit, values), f"{name}.sd": Metric(float(values.std(ddof=1)), unit, error=error)}
            found |= {f"{name}.{q}%": Metric(float(np.quantile(values, q / 100)), unit) for q in (5, 50, 95)}
            for d, given in enumerate(inputs):
                for kind in ("first", "total"):
                    value, half = self.of(kind, s, d)
                    found[f"{name}.{given.name}.{kind}"] = Metric(value, "1", error=half / abs(value) if value else np.nan)
        return found

    def of(self, kind: str, s: int, d: int) -> tuple[float, float]:
        """An index, `first` or `total`, and half its interval."""
        return float(getattr(self, kind)[s, d]), float(np.ptp(getattr(self, f"{kind}_range")[s, d])) / 2


def sobol(model: Model, inputs: Sequence[Input], n: int, seed: int) -> Indices:
    """First-order and total indices from n (d + 2) evaluations, n a power of two."""
    d = len(inputs)
    unit = stats.qmc.Sobol(2 * d, rng=np.random.default_rng(seed)).random(n)
    drawn = np.stack([inputs[i % d].distribution.ppf(unit[:, i]) for i in range(2 * d)])
    a, b = drawn[:d], drawn[d:]
    mixed = np.repeat(a[None], d, axis=0)
    mixed[np.arange(d), np.arange(d)] = b
    values = model(np.concatenate([a, b, *mixed], axis=1))
    parts = values.reshape(len(values), d + 2, n)
    rng = np.random.default_rng(seed)
    first, total = _indices(parts, np.arange(n))
    again = np.array([_indices(parts, rng.integers(n, size=n)) for _ in range(RESAMPLED)])
    limits = np.moveaxis(np.quantile(again, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0), 0, -1)
    sample = parts[:, :2].reshape(len(values), -1)
    return Indices(np.concatenate([a, b], axis=1), sample, first, total, limits[0], limits[1])


def _indices(parts: Array, chosen: Array) -> tuple[Array, Array]:
    """Indices, each of shape (s, d), from some of the evaluations, parts of shape (s, d + 2, n)."""
    taken = parts[:, :, chosen]
    given = {"f_A": taken[:, 0], "f_B": taken[:, 1], "f_AB": taken[:, 2:].swapaxes(0, 1)}
    found = stats.sobol_indices(func=given, n=chosen.size)
    shape = len(parts), parts.shape[1] - 2
    return found.first_order.reshape(shape), found.total_order.reshape(shape)


def slopes(model: Model, inputs: Sequence[Input]) -> Array:
    """Relative change of each output by a relative change of each input, d ln y/d ln x, shape (s, d)."""
    mean = np.array([i.mean for i in inputs])
    steps = 1e-4 * np.diag(mean)
    up, down, middle = (model(x) for x in (mean[:, None] + steps, mean[:, None] - steps, mean[:, None]))
    return (up - down) / (2e-4 * middle)


def linear_shares(slope: Array, inputs: Sequence[Input]) -> Array:
    """First-order indices as they are for small tolerances, (d ln y/d ln x sd/mean)^2 over their sum, shape (s, d)."""
    parts = (slope * [i.distribution.std() / i.mean for i in inputs]) ** 2
    return parts / parts.sum(axis=1, keepdims=True)


# --- the slider-crank -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Striker:
    """The slider-crank: what of it is certain. Inputs in the order of `INPUTS`.

    Attributes
    ----------
    impact_duration : s, of the published model
    coupler : of the simulation: `strut`, a massless exact elastica, or `beam`
    assumed : gravity and motor of the simulation; the closed form knows neither, nor bow and stiffness of the stop
    """

    impact_duration: float
    coupler: str = "beam"
    assumed: StrikeAssumptions = field(default_factory=StrikeAssumptions)

    INPUTS: ClassVar = {
        "thickness": "m", "modulus": "Pa", "length": "m", "stop": "m", "restitution": "1", "friction": "1", "mass": "kg",
        "speed": "rad/s", "stop_stiffness": "N/m", "bow": "1",
    }  # fmt: skip
    """Names and units."""

    def closed_form(self, x: Array) -> Array:
        """Contact force at the dead centre and impact force, N, shape (2, n)."""
        thickness, modulus, length, stop, restitution, _, mass, speed, *_ = x
        crank = PAPER.crank
        rigidity = modulus * STRIP_WIDTH * thickness**3 / 12
        contact = pinned.load(1 - (stop - crank) / length) * rigidity / length**2
        angle = np.arccos((length**2 - stop**2 - crank**2) / (2 * stop * crank))
        velocity = -speed * SliderCrank(crank, length).slider_rate(angle)
        return np.stack([contact, mass * (1 + restitution) * velocity / self.impact_duration])

    def mechanism(self, **given: float) -> Mechanism:
        """The simulated one, of inputs by their names."""
        section, length = Section(STRIP_WIDTH, given["thickness"], Material(given["modulus"], STEEL.density)), given["length"]
        return striking(
            coupler(COUPLERS[self.coupler], section, length, DAMPED, given["bow"], ELEMENTS),
            self.assumed,
            stiffness=given["stop_stiffness"],
            restitution=min(given["restitution"], 1.0),
            mass=given["mass"],
            friction=given["friction"] * given["mass"] * GRAVITY,
            speed=given["speed"],
            stop=-given["stop"],
            lengths=SliderCrank(PAPER.crank, length),
        )

    def simulated(self, inputs: Sequence[Input]) -> Sensitivities:
        """Derivatives of the simulated impact force by all inputs, which give its spread to first order."""
        at = {given.name: given.mean for given in inputs}
        duration = self.assumed.lasts(IMPACT_UNTIL / at["speed"])
        by = {given.name: float(given.distribution.std()) for given in inputs}
        return sensitivities(self.mechanism, duration, by=by, of={IMPACT: "peak(B.contact_force, 1)"}, at=at)


def thickness_share(inputs: Sequence[Input]) -> float:
    """First-order index of the thickness for the contact force, exact: F = h^3 E g(L, e) has independent factors.

    Var(h^3) E[E]^2 E[g]^2/Var(F), its moments by Gauss quadrature of the densities.
    """
    nodes, weights = np.polynomial.legendre.leggauss(40)

    def rule(name: str) -> tuple[Array, Array]:
        given = next(i for i in inputs if i.name == name)
        x = given.mean + CUT * given.sd * nodes
        return x, CUT * given.sd * weights * given.distribution.pdf(x)

    (h, wh), (modulus, we), (length, wl), (stop, ws) = map(rule, ("thickness", "modulus", "length", "stop"))
    g = pinned.load(1 - (stop[None] - PAPER.crank) / length[:, None]) / length[:, None] ** 2
    first = [wh @ h**3, we @ modulus, wl @ g @ ws]
    second = [wh @ h**6, we @ modulus**2, wl @ g**2 @ ws]
    squares = np.square(first)
    return float((second[0] - squares[0]) * squares[1] * squares[2] / (np.prod(second) - np.prod(squares)))


# --- the crank-rocker -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rattler:
    """The crank-rocker: what of it is certain, and how a run of it is measured.

    Inputs: clearance, damping (c_max, N s/m) or restitution, friction (dynamic; the static one keeps its ratio), chance.
    """

    parameters: FourBarParameters
    law: str
    cycles: int
    settle: int

    def mechanism(self, clearance: float, contact: float, friction: float) -> Any:
        """The crank-rocker with these inputs."""
        p = self.parameters
        law = Impact(p.stiffness, contact, p.damping_depth) if self.law == "damping" else ExactRestitution(p.stiffness, contact)
        static = friction * p.static_friction / p.dynamic_friction
        return p.bars(gap=clearance, law=law, friction=AdamsFriction(static, friction, *p.thresholds))

    def run(self, x: Sequence[float]) -> tuple[list[float], str]:
        """Outputs of one run, means over its turns, and the name of what speaks against it."""
        from ..rattling.turns import ensemble  # loads the compiler

        clearance, contact, friction, chance = x
        seed = int(np.float64(chance).view(np.uint64))
        p = self.parameters
        made = self.mechanism(clearance, contact, friction)
        found = ensemble(made, self.cycles, [seed], settle=self.settle, tolerance=p.tolerance)
        wrong = "".join(found.notes[:1]).partition(":")[0]
        return [float(found.mean(measure)[column]) for measure, column, _ in MEASURES.values()], wrong

    def run_all(self, inputs: Array, progress: Any, label: str) -> tuple[Array, Array]:
        """Outputs, shape (s, n), and what speaks against each, shape (n,), of inputs of shape (4, n)."""
        with ThreadPoolExecutor(self.parameters.workers) as pool:
            found = list(progress(pool.map(self.run, inputs.T.tolist()), total=inputs.shape[1], label=label))
        return np.array([values for values, _ in found]).T, np.array([wrong for _, wrong in found])


def levels(values: Array, given: Input) -> Array:
    """Each value by the middle of its class, of `LEVELS` alike in probability."""
    place = np.clip((given.distribution.cdf(values) * LEVELS).astype(int), 0, LEVELS - 1)
    return np.asarray(given.distribution.ppf((place + 0.5) / LEVELS))
