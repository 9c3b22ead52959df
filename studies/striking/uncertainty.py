"""Tolerances and what they do: distributions of forces, and whose variance it is, by Sobol' indices.

Slider-crank: thickness, modulus, length and bow of the strip, place and stiffness of the stop, restitution, friction, mass
and speed, to the contact force at the dead centre (exact elastica) and to the impact force (published model; a simulation, to
first order by its derivatives, `buckler.mbs.sensitivities`). The simulated coupler is by default the bowed beam, one of those
models that the measured forces bear out (`identify`). As F goes with h^3, the share of the thickness in the contact force is
also known exactly, and must come out.

Crank-rocker with clearance joints: gap, contact damping (or restitution) and friction, to peak force and rms acceleration,
from the compiled reference.
Where its joints rattle a run is one draw of many. The seed is an input like any other here: its total
index is the share of chance, which no tolerance takes away and a longer run does. It is part of the total index of every
other input too, as any change of an input draws another motion; `total - chance` leaves it out.

References
----------
A. Saltelli et al., Variance based sensitivity analysis of model output, doi 10.1016/j.cpc.2009.09.018.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from buckler.mbs.geometry import Array
from buckler.mbs.library import PAPER_STOP
from buckler.mbs.sensitivity.table import Sensitivities

from ..kit.parameters import choice, choices, integer, quantity
from ..kit.published import DAMPING_UNITS
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.statistics import PowerLaw, power_law
from ..kit.style import COLOURS, Figure, subplots
from ..rattling.assumptions import MEASURES
from ..rattling.bars import RockerParameters
from . import uncertainty_models as models
from .assumptions import StrikeAssumptions
from .uncertainty_models import LEVEL, Indices, Input, Striker

MECHANISMS = ("slider-crank", "crank-rocker")
STOP = 1.633e4
"""Stiffness of the stop that a beam with a bow of 1 % strikes with some 27 N at 1.25 rad/s, N/m."""
FIELDS = {"friction": "guide_friction", "speed": "slider_speed", "bow": "imperfection"}
"""Inputs whose parameter is called otherwise."""

OUTPUTS = {
    "slider-crank": {"contact_force": "N", "impact_force": "N"},
    "crank-rocker": {name: unit for name, (_, _, unit) in MEASURES.items()},
}
"""Outputs of each mechanism, and their units."""
KINDS = {"first": "first order", "total": "total"}
LABELS = {
    "contact_force": "contact force", "impact_force": "impact force", "peak_force": "peak force, pin B",
    "rms_ax_coupler": "rms $a_x$, coupler", "rms_ax_rocker": "rms $a_x$, rocker",
}  # fmt: skip
"""What indices and outputs are called in figures."""


@dataclass(frozen=True)
class Parameters(RockerParameters, StrikeAssumptions):
    """Parameters of the study; sd is a standard deviation, of a normal distribution cut off at three of them."""

    mechanism: tuple[str, ...] = choices(MECHANISMS, MECHANISMS, "mechanisms", "which")
    thickness: float = quantity(3e-4, "m", 5e-5, 1e-3, "thickness of the strip", "slider-crank")
    thickness_sd: float = quantity(5e-6, "m", 1e-9, 1e-4, "its sd", "slider-crank")
    modulus: float = quantity(210e9, "Pa", 1e9, 1e12, "modulus of the strip", "slider-crank")
    modulus_sd: float = quantity(4e9, "Pa", 1e3, 1e11, "its sd", "slider-crank")
    length: float = quantity(0.310, "m", 0.28, 0.34, "length of the strip", "slider-crank")
    length_sd: float = quantity(2e-4, "m", 1e-9, 3e-3, "its sd", "slider-crank")
    stop: float = quantity(-PAPER_STOP, "m", 0.3, 0.4, "distance of the stop from the crank's pivot", "slider-crank")
    stop_sd: float = quantity(5e-4, "m", 1e-9, 5e-3, "its sd", "slider-crank")
    restitution: float = quantity(0.8, "1", 0.2, 0.97, "restitution of the stop (joints: contact = restitution)", "slider-crank")
    restitution_sd: float = quantity(0.02, "1", 1e-6, 0.06, "its sd", "slider-crank")
    guide_friction: float = quantity(0.1, "1", 0.01, 0.9, "Coulomb coefficient of the slider by its weight", "slider-crank")
    guide_friction_sd: float = quantity(0.02, "1", 1e-6, 0.1, "its sd", "slider-crank")
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider-crank")
    mass_sd: float = quantity(3e-3, "kg", 1e-9, 1, "its sd", "slider-crank")
    slider_speed: float = quantity(1.25, "rad/s", 0.1, 60, "speed of the slider-crank's crank", "slider-crank")
    slider_speed_sd: float = quantity(0.0125, "rad/s", 1e-9, 6, "its sd", "slider-crank")
    imperfection: float = quantity(0.01, "1", 1e-4, 0.05, "bow of the strip over its length (beam)", "slider-crank")
    imperfection_sd: float = quantity(0.002, "1", 1e-9, 0.01, "its sd", "slider-crank")
    impact_duration: float = quantity(3.775e-3, "s", 1e-5, 1, "duration of an impact (published model)", "slider-crank")
    stop_stiffness: float = quantity(STOP, "N/m", 1e3, 1e8, "stiffness of the stop (simulation)", "slider-crank")
    stop_stiffness_sd: float = quantity(0.05 * STOP, "N/m", 1e-3, 1e7, "its sd", "slider-crank")
    coupler: str = choice("beam", ("strut", "beam"), "coupler of the simulation", "slider-crank")
    samples: int = integer(2048, 8, 2**20, "base sample of the closed form, a power of two", "slider-crank")
    contact: str = choice(
        "damping", ("damping", "restitution"), "contact law: Impact, c_max uncertain; ExactRestitution", "joints"
    )
    clearance_sd: float = quantity(0.1, "1", 1e-6, 0.3, "sd of the clearance over its mean", "joints")
    damping_sd: float = quantity(0.1, "1", 1e-6, 0.3, "sd of c_max over its mean", "contact")
    joint_friction_sd: float = quantity(0.1, "1", 1e-6, 0.3, "sd of both joint friction coefficients over their mean", "contact")
    runs: int = integer(256, 8, 2**16, "base sample of the crank-rocker, a power of two", "crank-rocker")
    cycles: int = integer(2, 1, 10**5, "turns a run is measured for: outputs are means over them", "crank-rocker")
    settle: int = integer(1, 0, 10**5, "turns before them", "crank-rocker")
    repeats: int = integer(64, 8, 10**5, "runs of the mean mechanism, for the share of chance once more", "crank-rocker")
    seed: int = integer(0, 0, 2**31 - 1, "draws the samples", "numerics")

    def check(self) -> None:
        """Check parameters against each other."""
        for name in ("samples", "runs"):
            if getattr(self, name) & (getattr(self, name) - 1):
                raise ValueError(f"{name} = {getattr(self, name)}: must be a power of two")
        super().check()
        for name in (FIELDS.get(name, name) for name in Striker.INPUTS):
            if not 3.1 * getattr(self, f"{name}_sd") < getattr(self, name):
                raise ValueError(f"{name}_sd = {getattr(self, f'{name}_sd'):g}: three of it must leave {name} positive")
        if self.restitution + 3 * self.restitution_sd > 1:
            raise ValueError(
                f"restitution_sd = {self.restitution_sd:g}: three of it above {self.restitution:g} must not exceed 1"
            )
        if not self.dynamic_friction:
            raise ValueError("dynamic_friction = 0: an uncertain coefficient must not be zero")

    def inputs(self, mechanism: str) -> list[Input]:
        """What is uncertain of a mechanism."""
        if mechanism == "slider-crank":
            found = [(name, unit, FIELDS.get(name, name)) for name, unit in Striker.INPUTS.items()]
            return [Input(name, unit, getattr(self, own), getattr(self, f"{own}_sd")) for name, unit, own in found]
        damping = self.damping * DAMPING_UNITS[self.damping_unit]
        contact = {
            "damping": Input("damping", "N.s/m", damping, damping * self.damping_sd),
            "restitution": Input("restitution", "1", self.restitution, self.restitution_sd),
        }
        return [
            Input("clearance", "m", self.clearance, self.clearance * self.clearance_sd),
            contact[self.contact],
            Input("friction", "1", self.dynamic_friction, self.dynamic_friction * self.joint_friction_sd),
            models.SEED,
        ]


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Vary each mechanism asked for."""
    vary = {"slider-crank": slider_crank, "crank-rocker": crank_rocker}
    parts = {name: vary[name](p, progress) for name in p.mechanism}
    notes = [f"{name}: {note}" for name, part in parts.items() for note in part.notes]
    return StudyResult(
        parameters=p,
        **judged(notes),
        metrics={f"{name}.{key}": metric for name, part in parts.items() for key, metric in part.metrics.items()},
        signals={f"{name}.{key}": values for name, part in parts.items() for key, values in part.signals.items()},
        tables=[table for part in parts.values() for table in part.tables],
    )


def slider_crank(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """The slider-crank: closed form, and the impact once more by simulation; notes tell what speaks against it."""
    assumed = StrikeAssumptions(**p.shared(StrikeAssumptions))
    inputs, striker = p.inputs("slider-crank"), Striker(p.impact_duration, p.coupler, assumed)
    found = models.sobol(striker.closed_form, inputs, p.samples, p.seed)
    slope = models.slopes(striker.closed_form, inputs)
    exact = models.thickness_share(inputs)
    simulated = striker.simulated(inputs)
    first = Metric(float(found.first[0, 0]), "1", exact=exact)
    half = found.of("first", 0, 0)[1]
    notes = [f"DERIVATIVE: {row.number}: {row.note}" for row in simulated.rows if row.note]
    if abs(first.value - exact) > 3 * half:
        notes.append(f"SOBOL: share of the thickness {first.value:.3f}, exactly {exact:.3f}; raise `samples`")
    metrics = found.metrics(OUTPUTS["slider-crank"], inputs)
    metrics |= {
        "contact_force.thickness.first": first,
        "simulated.impact_force.mean": Metric(simulated.rows[0].value, "N"),
        "simulated.impact_force.sd": Metric(simulated.spread(models.IMPACT), "N"),
        **{f"simulated.impact_force.{row.number}.slope": Metric(row.relative, "1", error=row.share) for row in simulated.rows},
    }  # fmt: skip
    linear = models.linear_shares(slope, inputs)
    stated = f"{assumed.stated()}; the closed form knows neither, nor bow and stop stiffness. Simulated: {p.coupler}."
    tables = [spread_table(p, "slider-crank", metrics), striker_table(inputs, found, slope, linear, simulated, exact, stated)]
    return StudyResult(parameters=p, metrics=metrics, signals=found.arrays(OUTPUTS["slider-crank"]), tables=tables, notes=notes)


def crank_rocker(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """The crank-rocker with clearance, its seed one of the inputs; notes tell what speaks against it."""
    inputs = p.inputs("crank-rocker")
    rattler = models.Rattler(p, p.contact, p.cycles, p.settle)
    wrong: list[Array] = []

    def stepped(x: Array) -> Array:
        return np.stack([x[0], models.levels(x[1], inputs[1]), models.levels(x[2], inputs[2]), x[3]])

    def model(x: Array) -> Array:
        values, names = rattler.run_all(stepped(x), progress, "crank-rocker")
        wrong.append(names)
        return values

    found = models.sobol(model, inputs, p.runs, p.seed)
    chances = models.SEED.distribution.rvs(p.repeats, random_state=np.random.default_rng(p.seed + 2))
    still = np.repeat([[i.mean] for i in inputs[:3]], p.repeats, axis=1)
    again, _ = rattler.run_all(np.vstack([still, chances]), progress, "chance")
    chance = again.var(axis=1, ddof=1) / found.sample.var(axis=1, ddof=1)
    error = np.sqrt(2 / (p.repeats - 1) + 2 / (found.sample.shape[1] - 1))  # of a ratio of variances of normal numbers
    every = np.concatenate(wrong).tolist()
    notes = [f"{name}: in {every.count(name)} of {len(every)} runs" for name in sorted(set(every) - {""})]
    fits = [power_law(stepped(found.inputs)[:3], values) for values in found.sample]
    metrics = found.metrics(OUTPUTS["crank-rocker"], inputs)
    for name, share, fitted in zip(MEASURES, chance.tolist(), fits, strict=True):
        metrics[f"{name}.chance_at_mean"] = Metric(share, "1", error=float(error))
        metrics[f"{name}.explained"] = Metric(fitted.explained, "1")
        metrics |= {f"{name}.{x.name}.slope": slope for x, slope in zip(inputs[:-1], fitted.metrics(), strict=True)}
    tables = [spread_table(p, "crank-rocker", metrics), rattler_table(p, inputs, found, fits, chance, chance * error)]
    signals = found.arrays(OUTPUTS["crank-rocker"]) | {"chance_at_mean": again}
    return StudyResult(parameters=p, metrics=metrics, signals=signals, tables=tables, notes=notes)


# --- tables -----------------------------------------------------------------------------------------------------------


def spread_table(p: Any, mechanism: str, metrics: Mapping[str, Metric]) -> Table:
    """Distribution of each output."""
    columns = ("mean", "sd", "5%", "50%", "95%")
    rows = [[name, unit, *(metrics[f"{name}.{c}"].value for c in columns)] for name, unit in OUTPUTS[mechanism].items()]
    if mechanism == "slider-crank":
        values = [metrics[f"simulated.impact_force.{c}"].value for c in ("mean", "sd")]
        rows.append([f"impact_force, {p.coupler} simulated", "N", *values])
    titles = {
        "slider-crank": f"Slider-crank at {p.slider_speed:g} rad/s, h = {1e3 * p.thickness:g} mm",
        "crank-rocker": f"Crank-rocker, c = {1e3 * p.clearance:g} mm, {p.speed:.4g} rad/s: means over {p.cycles} turns a run",
    }
    return Table(["", "unit", *columns], rows, titles[mechanism])


def _shown(found: Indices, kind: str, s: int, d: int) -> str:
    return "{:.3f} ± {:.3f}".format(*found.of(kind, s, d))


def striker_table(
    inputs: Sequence[Input], found: Indices, slope: Array, shares: Array, simulated: Sensitivities, exact: float, stated: str
) -> Table:
    """Slope, first-order index and its value for small tolerances, of both forces; slope of the simulated impact."""
    rows = []
    for d, given in enumerate(inputs):
        row = [given.name, f"{given.sd / given.mean:.2%}"]
        for s in range(2):
            row += [f"{slope[s, d]:.2f}", _shown(found, "first", s, d), f"{shares[s, d]:.3f}"]
        told = simulated[models.IMPACT, given.name]
        rows.append([*row, f"{told.relative:.2f} ± {told.relative_error:.2g}"])
    force = ("slope", "first order", "linear")
    headers = ["", "sd", *(f"contact: {x}" for x in force), *(f"impact: {x}" for x in force), "simulated impact: slope"]
    notes = (
        "slope: d ln F/d ln x. linear: (slope sd)^2 over their sum. The share of the thickness in the contact force is exactly "
        f"{exact:.4f}.\n± half a {LEVEL:.0%} interval (first order), error of the derivative (simulation, whose "
        f"mean and deviation are of first order).\n{stated}"
    )
    return Table(headers, rows, "Whose variance it is", notes)


def rattler_table(
    p: Any, inputs: Sequence[Input], found: Indices, fits: Sequence[PowerLaw], chance: Array, error: Array
) -> Table:
    """Slopes and indices of each output, the share of chance among them; `error` is the standard error of `chance`."""
    rows = []
    for s, name in enumerate(MEASURES):
        for d, given in enumerate(inputs[:-1]):
            slope = f"{fits[s].slope[d]:.2f} ± {fits[s].error[d]:.2f}"
            first, total = (_shown(found, kind, s, d) for kind in KINDS)
            rows.append([name, given.name, f"{given.sd / given.mean:.1%}", slope, first, total])
            rows[-1].append(f"{found.total[s, d] - found.total[s, -1]:.3f}")
        rows.append([name, "chance", "", "", *(_shown(found, kind, s, -1) for kind in KINDS), ""])
        rows.append([name, "chance, at the mean", "", "", "", f"{chance[s]:.3f} ± {2 * error[s]:.3f}", ""])
    notes = (
        f"slope: d ln y/d ln x by least squares, its standard error. ± half a {LEVEL:.0%} interval. chance: the seed; its total "
        f"index is what no tolerance\ntakes away; at the mean: of {p.repeats} runs that differ by their seed only. Means over m "
        f"times as many turns have 1/m of its variance.\nContact and friction laws take 8 values each, alike in "
        f"probability.\n{p.stated()}."
    )
    return Table(["", "input", "sd", "slope", "first order", "total", "total - chance"], rows, "Whose variance it is", notes)


# --- figures ----------------------------------------------------------------------------------------------------------


def figure(result: StudyResult) -> dict[str, Figure]:
    """One figure a mechanism: the distribution of each output above, the indices of all inputs below."""
    p = result.of(Parameters)
    return {name.replace("-", "_"): _draw(result, p, name) for name in p.mechanism}


def _draw(result: StudyResult, p: Parameters, mechanism: str) -> Figure:
    inputs = p.inputs(mechanism)
    signals = {k.removeprefix(f"{mechanism}."): v for k, v in result.signals.items() if k.startswith(f"{mechanism}.")}
    outputs = OUTPUTS[mechanism]
    fig, axes = subplots(2, len(outputs), height=120, squeeze=False)
    places = np.arange(len(inputs))
    for s, (name, unit) in enumerate(outputs.items()):
        above, below = axes[:, s]
        above.hist(signals[name], bins=40, density=True, color=COLOURS[0], alpha=0.7, label="closed form")
        if f"{mechanism}.simulated.{name}.mean" in result.metrics:
            middle, sd = (result.metrics[f"{mechanism}.simulated.{name}.{what}"].value for what in ("mean", "sd"))
            force = middle + sd * np.linspace(-3.0, 3.0, 121)
            above.plot(force, stats.norm.pdf(force, middle, sd), color=COLOURS[1], label=f"{p.coupler}, simulated, first order")
            above.legend()
        above.set(xlabel=f"{LABELS[name]} [{unit.replace('^2', '²')}]", yticks=[])
        for k, kind in enumerate(("first", "total")):
            value, limits = signals[kind][s], signals[f"{kind}_range"][s]
            bars = np.abs(limits.T - value)
            below.barh(
                places + 0.2 * (2 * k - 1), value, 0.36, xerr=bars, color=COLOURS[k], label=KINDS[kind],
                error_kw={"elinewidth": 0.7, "capsize": 1.5},
            )  # fmt: skip
        below.set(
            yticks=places,
            yticklabels=[i.name.replace("_", " ") for i in inputs] if s == 0 else [],
            xlabel="share of the variance",
        )
        below.set(xlim=(min(0.0, below.get_xlim()[0]), None))
        below.invert_yaxis()
    axes[0, 0].set_ylabel("density")
    fig.legend(*axes[1, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return fig
