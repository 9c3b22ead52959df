"""Crank-rocker with clearance in all joints: error against run time of rigid, beam and modal rocker, and of rivals.

The engine runs it by tolerance, in equal steps, explicitly and implicitly, with several elements; rivals are the compiled
solver, scipy's DOP853 on the same compiled right-hand side, the engine with its contact law in Python, and that with the
engine's own default settings. The error is the largest distance of a bar's centre from a fine run of the compiled solver over
the first 10 ms, in clearances. Rattling is chaotic: what comes later is compared by means over turns, in standard errors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Beam, Controlled, Equal, Exudyn, Mechanism, Modal
from buckler.mbs.modal import BarModes
from buckler.mbs.solvers import usual_tolerance

from ..kit import work_precision as precision
from ..kit.parameters import choice, choices, counts, integer, quantities, quantity
from ..kit.published import DAMPING_UNITS
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import Figure, subplots
from ..kit.work_precision import Bar, Point, Runs, Series
from . import clearance_precision_runs as variants
from .assumptions import Assumptions
from .bars import InPython
from .clearance import CrankRockerParameters
from .clearance_precision_runs import QUANTITIES, Comparison, compare
from .turns import BALANCED

DEFAULT, EQUAL, OWN_STEP = "default", "1e-7", "20 us"
"""Setting of a run with no settings; the compiled solver's tolerance for ratios; step with the engine's own settings."""

FEWER = 4
"""Bending and as many axial modes of the compiled solver where the beam's turns are averaged."""


class TimeRatio(NamedTuple):
    """Run time of one run over that of another, each a series and a setting of one model, and what is asked of it."""

    model: str
    above: tuple[str, str]
    below: tuple[str, str]
    sign: str
    bound: float

    @property
    def bar(self) -> Bar:
        """In words."""
        return Bar(f"{', '.join(self.above)} / {', '.join(self.below)}", self.bound, sign=self.sign)


TOLERANCES = (1e-5, 1e-7, 1e-9)
"""Of the compiled solver's runs."""
YARDSTICK = f"compiled, {variants.MODES} + {variants.MODES} modes"
"""The run that the beam is held against: too far below all others to be drawn."""
RIVALS = ("compiled", "scipy", "Python law", "engine's own")
"""How the names of runs begin that do not stand for the engine as we use it."""
RATIOS = {
    "dop853_over_reference": TimeRatio("rigid", ("scipy DOP853", EQUAL), ("compiled", EQUAL), ">=", 25),
    "rigid_over_reference": TimeRatio("rigid", ("Rigid", DEFAULT), ("compiled", EQUAL), "<=", 12),
    "python_law_over_rigid": TimeRatio("rigid", ("Python law", DEFAULT), ("Rigid", DEFAULT), ">=", 5),
    "own_settings_over_rigid": TimeRatio("rigid", ("engine's own, Python law", OWN_STEP), ("Rigid", DEFAULT), ">=", 5),
    "beam_over_modal_reference": TimeRatio("beam", ("Beam x 4", DEFAULT), ("compiled, 2 + 1 modes", EQUAL), "<=", 10),
}
"""What is asked of run times; they depend on the machine and make no run SUSPECT."""
UNLIKELY = 1e-3
"""Chance of the statistics below which the study is SUSPECT."""
DISTANCE = {"rigid": 0.05, "beam": 0.5, "modal": 0.5}
"""The same for the default run's distance, in clearances."""


@dataclass(frozen=True)
class Parameters(Assumptions):
    """Parameters of the study."""

    rockers: tuple[str, ...] = choices(("rigid", "beam", "modal"), ("rigid", "beam", "modal"), "rockers to run", "mechanism")
    clearance: float = quantity(2.5e-4, "m", 1e-5, 2e-3, "radial clearance", "mechanism")
    damping_unit: str = choice("N.s/m", tuple(DAMPING_UNITS), "how the published unit of c_max is read", "mechanism")
    tolerances: tuple[float, ...] = quantities((1e-2, 1e-4), "1", 1e-9, 1e-1, "tolerances, beside the default", "numerics")
    steps: tuple[int, ...] = counts((5000, 20_000), 100, 10**7, "equal steps in `span`", "numerics")
    elements: tuple[int, ...] = counts((2, 4, 8), 1, 64, "elements of the beam; 4 always run", "numerics")
    span: float = quantity(0.1, "s", 0.02, 100, "simulated in each run that is timed", "numerics")
    compared: float = quantity(0.01, "s", 1e-4, 0.015, "time over which motion is compared", "numerics")
    repeats: int = integer(3, 1, 1000, "repetitions, taken in turn", "numerics")
    members: int = integer(6, 2, 10_000, "runs averaged; of the compiled solver 4 times as many", "statistics")
    cycles: int = integer(2, 1, 10_000, "turns of each, after one that is left out", "statistics")

    def check(self) -> None:
        """Check that the mechanism can be built."""
        if (self.modal_damping, self.modes_of) != ("constant", "free") and "beam" in self.rockers:
            raise ValueError(f"modal_damping = {self.modal_damping}, modes_of = {self.modes_of}: not of a beam; leave it out")
        self.bars  # noqa: B018 - refuses what the mechanism cannot be

    @property
    def bars(self) -> CrankRockerParameters:
        """Parameters of the mechanism."""
        given = self.shared(Assumptions) | {"clearance": self.clearance, "damping_unit": self.damping_unit}
        return CrankRockerParameters(**given, start_angle=0.0, rocker=("modal",))


class Model(NamedTuple):
    """One rocker: its runs, the mechanism of the finest run, and those whose turns are averaged: on the engine, compiled."""

    runs: Runs
    fine: Mechanism
    usual: Mechanism
    like: Mechanism


def _rigid(p: Parameters) -> Model:
    bars, span = p.bars, p.span
    free, held = variants.mechanism(bars), variants.mechanism(bars, ramp=True)
    slow, plain = (variants.mechanism(bars, law=InPython(bars.law), ramp=ramp) for ramp in (False, True))
    runs: Runs = {
        "compiled": {precision.power(x): partial(variants.compiled, free, span, x) for x in TOLERANCES},
        "scipy DOP853": {EQUAL: partial(variants.by_scipy(free), span, float(EQUAL))},
        "Rigid": _by_tolerance(free, p),
        "Rigid, implicit": _by_tolerance(held, p),
        "Rigid, equal steps": _by_steps(free, span, p.steps),
        "Python law": {DEFAULT: partial(variants.on_engine, slow, span)},
        "engine's own, Python law": {OWN_STEP: partial(variants.plainly, plain, span, round(span / 20e-6))},
    }
    return Model(runs, free, free, free)


def _beam(p: Parameters) -> Model:
    bars, span = p.bars, p.span
    fine = variants.mechanism(bars, variants.modes_of_beam(bars))
    few = variants.mechanism(bars, Modal(bars.section, BarModes(2, 1), 0.01))
    beams = {n: variants.mechanism(bars, Beam(variants.damped(bars), elements=n)) for n in sorted({4, *p.elements})}
    runs: Runs = {
        YARDSTICK: {precision.power(TOLERANCES[0]): partial(variants.compiled, fine, span, TOLERANCES[0])},
        "compiled, 2 + 1 modes": {EQUAL: partial(variants.compiled, few, span, float(EQUAL))},
        **{f"Beam x {n}": _by_tolerance(beam, p) for n, beam in beams.items()},
        "Beam x 4, equal steps": _by_steps(beams[4], span, p.steps),
    }
    like = variants.mechanism(bars, variants.modes_of_beam(bars, FEWER))  # chance does more to a turn than a mode of 60 kHz
    return Model(runs, fine, beams[4], like)


def _modal(p: Parameters) -> Model:
    bar = variants.mechanism(p.bars, p.bars.modal())
    runs: Runs = {
        "compiled, same modes": {precision.power(x): partial(variants.compiled, bar, p.span, x) for x in TOLERANCES},
        "Modal": _by_tolerance(bar, p),
        "Modal, equal steps": _by_steps(bar, p.span, (min(p.steps),)),
    }
    return Model(runs, bar, bar, bar)


def _by_steps(made: Mechanism, span: float, steps: Sequence[int]) -> dict[str, Callable[[], Any]]:
    return precision.by_steps(lambda count: variants.on_engine(made, span, Exudyn(Equal(count))), steps)


def _by_tolerance(made: Mechanism, p: Parameters) -> dict[str, Callable[[], Any]]:
    """By tolerance, and without settings at its place among them."""
    run, usual = partial(variants.on_engine, made, p.span), usual_tolerance(made)
    sides = ([x for x in p.tolerances if (x > usual) == side] for side in (True, False))
    coarser, finer = (precision.by_tolerance(lambda x: run(Exudyn(Controlled(x))), side) for side in sides)
    return coarser | {DEFAULT: run} | finer


MODELS: dict[str, Callable[[Parameters], Model]] = {"rigid": _rigid, "beam": _beam, "modal": _modal}
CHOSEN = {
    "rigid": ("Rigid", ("compiled", EQUAL)),
    "beam": ("Beam x 4", (YARDSTICK, precision.power(TOLERANCES[0]))),
    "modal": ("Modal", ("compiled, same modes", EQUAL)),
}
"""The series whose default run is looked at more closely, and the run that it is compared with in words."""


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run each model's variants in turn, then the ensembles of its default run and of the compiled solver."""
    metrics: dict[str, Metric] = {}
    signals: dict[str, Any] = {}
    found: dict[str, Series] = {}
    compared: dict[str, Comparison] = {}
    for name in p.rockers:
        model = MODELS[name](p)
        found[name] = series = _measure(model, p, progress, f"{name}: runs")
        turns = partial(progress, label=f"{name}: turns")
        compared[name] = compare(model.usual, model.like, p.members, p.cycles, turns)
        metrics |= _metrics(name, series[CHOSEN[name][0]][DEFAULT], compared[name])
        signals |= precision.as_signals({f"{name}: {key}": part for key, part in series.items()})
    metrics |= {name: Metric(_ratio(found, name), "1") for name in RATIOS if RATIOS[name].model in found}
    if "rigid" in found:
        (theirs,) = found["rigid"]["scipy DOP853"].values()  # ours is read between its tolerances
        at_equal_error = theirs.wall_s / precision.time_for(found["rigid"]["compiled"].values(), theirs.error)
        metrics["dop853_over_reference_at_equal_error"] = Metric(at_equal_error, "1")
    wrong = [why for name in p.rockers for why in _wrong(name, metrics)]
    return StudyResult(
        parameters=p,
        metrics=metrics,
        signals=signals,
        tables=[
            _runs_table(found, f"{_sentence(found)}\n{p.stated()}.\n{precision.footnote(p)}"),
            _statistics_table(compared),
            precision.bars_table({name: ratio.bar for name, ratio in RATIOS.items()}, metrics, "ratio of run times"),
        ],
        **judged(wrong, _sentence(found)),
    )  # fmt: skip


def _measure(model: Model, p: Parameters, progress: Progress, label: str) -> Series:
    """Errors and times of a model's runs; the front is that of the engine as we use it."""
    distance = variants.finest(model.fine, p.compared)
    series = precision.measure(model.runs, lambda outcome: distance(outcome) / p.clearance, p.repeats, progress, label)
    ours = precision.points_of({name: part for name, part in series.items() if not name.startswith(RIVALS)})

    def leads(point: Point) -> bool:
        return point in ours and isfinite(point.error) and not any(other.beats(point) for other in ours)

    return {name: {key: replace(point, front=leads(point)) for key, point in part.items()} for name, part in series.items()}


def _metrics(name: str, chosen: Point, found: Comparison) -> dict[str, Metric]:
    return {
        f"{name}.error": Metric(chosen.error, "1"),
        f"{name}.time": Metric(chosen.wall_s, "s"),
        f"{name}.energy_balance": Metric(found.balance, "1"),
        f"{name}.standard_errors_apart": Metric(float(np.abs(found.apart).max()), "1"),
        f"{name}.chance": Metric(found.chance, "1"),
    }


def _wrong(name: str, metrics: Mapping[str, Metric]) -> list[str]:
    """What a model's default run does wrong, in words."""
    error, balance, chance = (metrics[f"{name}.{what}"].value for what in ("error", "energy_balance", "chance"))
    found = []
    if not error <= DISTANCE[name]:
        found.append(f"{name}: {error:.2g} clearances from the compiled solver, allowed {DISTANCE[name]:g}")
    if not balance <= BALANCED:
        found.append(f"{name}: energy balance {balance:.1e}, allowed {BALANCED:g}")
    if not chance >= UNLIKELY:
        found.append(f"{name}: statistics differ from the compiled solver's, by chance once in {1 / chance:.0f} times")
    return found


def _ratio(found: Mapping[str, Series], name: str) -> float:
    """One of `RATIOS`."""
    ratio = RATIOS[name]
    (above, key), (below, other) = ratio.above, ratio.below
    return found[ratio.model][below][other].speedup(found[ratio.model][above][key])


def _sentence(found: Mapping[str, Series]) -> str:
    """The default run of the first model against the one it is most like."""
    model, series = next(iter(found.items()))
    chosen, (rival, key) = CHOSEN[model]
    return precision.verdict(series[chosen][DEFAULT], series[rival][key])


def _runs_table(found: Mapping[str, Series], notes: str) -> Table:
    rows: list[list[Any]] = []
    for model, series in found.items():
        for name, part in series.items():
            for key, point in part.items():
                error = f"{point.error:.1e}" if isfinite(point.error) else "failed"
                counts = [point.work.get(what) for what in ("steps", "jacobians")]
                rows.append([model, name, key, error, f"{1e3 * point.wall_s:.3g}", *counts, precision.mark(point)])
    headers = ["rocker", "run", "setting", "error [clearances]", "time [ms]", "steps", "Jacobians", "front"]
    return Table(headers, rows, "Crank-rocker with clearance: distance from the compiled solver over the first 10 ms", notes)


def _statistics_table(compared: Mapping[str, Comparison]) -> Table:
    rows = [
        [model, quantity, unit, f"{found.engine[:, k].mean():.5g}", f"{found.compiled[:, k].mean():.5g}",
         f"{100 * found.error[k] / found.compiled[:, k].mean():.1f}", f"{found.apart[k]:+.1f}"]
        for model, found in compared.items()
        for k, (quantity, unit) in enumerate(QUANTITIES.items())
    ]  # fmt: skip
    headers = ["rocker", "mean over turns of", "unit", "engine", "compiled", "standard error [%]", "apart [s.e.]"]
    return Table(headers, rows, "Default runs: statistics against those of the compiled solver")


def figure(result: StudyResult) -> Figure:
    """Error over run time, a panel a rocker."""
    names = precision.series_in(result.signals)
    models = list(dict.fromkeys(name.partition(": ")[0] for name in names))
    fig, axes = subplots(rows=len(models), height=80.0 * len(models), squeeze=False)
    for model, ax in zip(models, axes[:, 0], strict=True):
        own = {name: name.partition(": ")[2] for name in names if name.startswith(f"{model}: ") and not name.endswith(YARDSTICK)}
        precision.draw(ax, result.signals, own)
        ax.legend(title="at the points:\ntolerance, or steps", loc="center left", bbox_to_anchor=(1.0, 0.5), alignment="left")
        ax.set(title=f"{model} rocker", ylabel="distance over the first 10 ms\n[clearances]")
    return fig
