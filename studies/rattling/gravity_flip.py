"""Does gravity flip whether a flexible rocker spares the joints? One number, over what its modes are taken to be.

The ratio of the largest force between rocker and frame, flexible over rigid, without gravity and with it in the plane: by
Timoshenko's and by Euler and Bernoulli's beam theory, with several numbers of modes, and with the rocker's frequencies raised and
lowered, as eyes, holes or a mesh do. A case flips if the force falls by `margin` at least without gravity and not with it. What
decides the ratio under gravity is told by first-order Sobol' indices, which of a full grid are shares of its variance.

Each ± is of sampling; the spread over the cases is of the model.

References
----------
I. M. Sobol', Global sensitivity indices for nonlinear mathematical models, doi 10.1016/S0378-4754(00)00270-6.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from buckler.mbs.geometry import Array

from ..kit.parameters import choice, choices, integer, quantities, quantity
from ..kit.published import DAMPING_UNITS, GRAVITY
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Figure, subplots
from . import buffering_world as world
from .bars import flexible
from .buffering_measures import CLAIMS, Ratio, mean, ratio
from .worlds import COUNTS

CLAIM = next(claim for claim in CLAIMS if claim.name == "force.rocker_frame")
THEORIES = {"Timoshenko": "free", "Euler-Bernoulli": "Euler-Bernoulli"}
"""Of the modes, as `modes_of` names them."""
GRAVITIES = (0.0, GRAVITY)
FACTORS = ("theory", "modes", "frequency")


@dataclass(frozen=True)
class Parameters(world.Parameters):
    """Those of a world, and the grid."""

    damping_unit: str = choice("N.s/mm", tuple(DAMPING_UNITS), "how the published unit of c_max is read", "contact")
    clearance: float = quantity(1e-4, "m", 1e-7, 2e-3, "radial clearance", "joints")
    members: int = integer(3, 2, 2000, "runs of each rocker; their scatter gives the standard error", "statistics")
    cycles: int = integer(1, 1, 10_000, "turns measured of each run", "statistics")
    theories: tuple[str, ...] = choices(tuple(THEORIES), tuple(THEORIES), "beam theories of the modes", "grid")
    counts: tuple[str, ...] = choices(tuple(COUNTS), tuple(COUNTS), "bending and axial modes", "grid")
    factors: tuple[float, ...] = quantities((0.9, 1.0, 1.1), "1", 0.5, 2, "on the rocker's frequencies", "grid")
    margin: float = quantity(0.05, "1", 0, 0.5, "reduction that is worth the name", "statistics")

    def grid(self) -> list[tuple[str, str, float]]:
        """Every case."""
        return list(product(self.theories, self.counts, self.factors))

    def case(self, theory: str, count: str, factor: float, gravity: float) -> world.Parameters:
        """The world of a case."""
        changes = dict(zip(("bending", "axial"), COUNTS[count], strict=True), modes_of=THEORIES[theory])
        shared = self.shared(world.Parameters)
        return world.Parameters(**{**shared, **changes, "frequency_factor": factor, "gravity": gravity})


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run the rigid rocker twice, the flexible one in every case, without and with gravity."""
    grid = p.grid()
    found: dict[float, list[Ratio]] = {}
    wrong = []
    runs = progress([(g, case) for g in GRAVITIES for case in (None, *grid)], label="ensembles")
    for number, (gravity, case) in enumerate(runs):
        here = p.case(*(case or grid[0]), gravity)
        seeds = range(p.members * number, p.members * (number + 1))
        ensemble = world.measured(here, flexible(here) if case else None, seeds)
        wrong += [f"{case or 'rigid'}, {gravity:g} m/s^2: {note}" for note in ensemble.notes if note.startswith("ENERGY")]
        if case is None:
            rigid = mean(ensemble, CLAIM)
            found[gravity] = []
        else:
            found[gravity].append(ratio(mean(ensemble, CLAIM), rigid))
    value, error = ({g: np.array([each[k] for each in some]) for g, some in found.items()} for k in (0, 1))
    return StudyResult(
        parameters=p,
        **judged(wrong),
        metrics=_metrics(p, value, error),
        signals={f"{kind}_{gravity:g}": x[gravity] for kind, x in (("ratio", value), ("error", error)) for gravity in GRAVITIES},
        work={"turns": 2 * (1 + len(grid)) * p.members * (p.settle + p.cycles)},
        tables=[_table(p, value, error)],
    )


def _metrics(p: Parameters, value: dict[float, Array], error: dict[float, Array]) -> dict[str, Metric]:
    metrics = {}
    for gravity, word in zip(GRAVITIES, ("without", "with"), strict=True):
        for case, x, e in zip(p.grid(), value[gravity], error[gravity], strict=True):
            metrics[f"{_name(case)}.{word}"] = Metric(float(x), "1", error=float(e / x))
        metrics[f"lowest.{word}"] = Metric(float(value[gravity].min()), "1")
        metrics[f"highest.{word}"] = Metric(float(value[gravity].max()), "1")
    falls = {gravity: value[gravity] < 1 - p.margin for gravity in GRAVITIES}
    near = np.any([np.abs(value[g] - (1 - p.margin)) < 2 * error[g] for g in GRAVITIES], axis=0)
    metrics["flips.share"] = Metric(float((falls[0.0] & ~falls[GRAVITY]).mean()), "1")
    metrics["spared_under_gravity.share"] = Metric(float(falls[GRAVITY].mean()), "1")
    metrics["unsure.share"] = Metric(float(near.mean()), "1")
    metrics["sampling"] = Metric(float(np.sqrt(np.mean(error[GRAVITY] ** 2))), "1")
    metrics["model"] = Metric(float(np.std(value[GRAVITY])), "1")
    for name, index in zip(FACTORS, sobol(p, value[GRAVITY]), strict=True):
        metrics[f"decided_by.{name}"] = Metric(index, "1")
    return metrics


def sobol(p: Parameters, value: Array) -> list[float]:
    """First-order indices of theory, number of modes and frequency: variance of the means at each level over all of it."""
    cube = value.reshape(len(p.theories), len(p.counts), len(p.factors))
    whole = float(cube.var()) or 1.0
    return [float(cube.mean(axis=tuple(k for k in range(3) if k != axis)).var()) / whole for axis in range(3)]


def _name(case: tuple[str, str, float]) -> str:
    theory, count, factor = case
    return f"{theory}.{count.replace(' ', '')}.{factor:g}"


def _table(p: Parameters, value: dict[float, Array], error: dict[float, Array]) -> Table:
    rows = []
    for k, (theory, count, factor) in enumerate(p.grid()):
        cells = [f"{value[g][k]:.3f} ± {error[g][k]:.3f}" for g in GRAVITIES]
        rows.append([theory, count, f"{factor:g}", *cells])
    headers = ["beam theory", "bending + axial modes", "frequency", "no gravity", "9.81 m/s² along −y"]
    return Table(headers, rows, f"{CLAIM.text}: flexible/rigid", "± standard error of sampling")


def figure(result: StudyResult) -> Figure:
    """Ratios of all cases over the factor on the frequencies, without and with gravity."""
    p = result.of(Parameters)
    fig, axes = subplots(1, 2, height=80, sharey=True)
    shape = (len(p.theories), len(p.counts), len(p.factors))
    for ax, gravity, title in zip(axes, GRAVITIES, ("no gravity", "9.81 m/s² along −y"), strict=True):
        value, error = (result.signals[f"{kind}_{gravity:g}"].reshape(shape) for kind in ("ratio", "error"))
        for i, theory in enumerate(p.theories):
            for j, count in enumerate(p.counts):
                look = {"color": COLOURS[i], "marker": "os^D"[j], "linestyle": ("-", "--", ":")[j % 3]}
                ax.errorbar(p.factors, value[i, j], yerr=2 * error[i, j], capsize=2, label=f"{theory}, {count} modes", **look)
        ax.axhline(1 - p.margin, color="#999999", linewidth=0.8)
        ax.set(xlabel="factor on the rocker's frequencies", title=title)
    axes[0].set_ylabel("largest force rocker–frame,\nflexible/rigid, ± two standard errors")
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return fig
