"""Errors that are told against true ones: random mechanisms of every kind, each against a reference of its own.

`simulate(mechanism, duration, accuracy)` delivers a run and tells how wrong each of its signals is. Here both are held against
loop closure, an equation of motion, or the finer of two much finer runs of a solver. A signal is judged where the reference's own
error is small against its own. A result is silent if it errs by more than three times what was asked and does not say so.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.accuracy.compare import FORCES, Functions, compare, relative
from buckler.mbs.accuracy.deliver import Climb, Delivery, deliver
from buckler.mbs.accuracy.goal import Asked, worst
from buckler.mbs.accuracy.ladder import Ladder, ladder_of, suited
from buckler.mbs.elements.signal import Kind

from ..kit.drawn import Draw, draw
from ..kit.parameters import StudyParameters, choice, choices, integer, quantities, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Figure, subplots
from .accuracy_truth import PATIENCE, SCENES, Truth, runner

SILENT = 3.0
"""Delivered over asked error from which a result must say that it is not what was asked for."""
WITHIN = 0.95
"""Share of all results that must be as accurate as asked."""
LOW = 0.5
"""Told over true error below which an error is told too small."""
KINDS = {"places": (Kind.PLACE,), "rates": (Kind.RATE, Kind.ACCELERATION), "forces": FORCES}
"""Signals by what is said of their errors together."""
NOTES = """\
within: results no farther off than asked. worst: largest error over that asked. silent: more than three times off, and not
marked. told: those that say so. told/true: of the signal asked for that is told to be worst; of all of them in the metrics."""
MARKS = "os^vDP*Xph"
JUDGED = 0.25
"""A signal is judged where the reference's own error is below this share of its true one."""
NOTHING = 1e-7
"""Relative errors below are rounding, and not judged."""
COARSER, GRID = 3, 3
"""Rungs of the grid of settings in which the cheapest single run is looked for: in time below the delivered one, in space."""


# --- the study -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    scenes: tuple[str, ...] = choices(tuple(SCENES), tuple(SCENES), "kinds of mechanism", "scenes")
    accuracies: tuple[float, ...] = quantities((1e-2, 1e-3), "1", 1e-6, 0.1, "what is asked for", "scenes")
    cases: int = integer(2, 1, 10_000, "random mechanisms of each kind, for each accuracy", "scenes")
    seed: int = integer(0, 0, 2**31 - 1, "draws the mechanisms", "scenes")
    reference: str = choice("compiled", ("compiled", "exudyn"), "solver of the references that are runs", "numerics")
    price: str = choice(
        "unpriced", ("unpriced", "priced"), "also look for the cheapest single run that is as accurate", "numerics"
    )
    timeout: float = quantity(60.0, "s", 0.1, 3600, "longest time a result may take", "numerics")


class Delivered(NamedTuple):
    """What came of one mechanism: what was asked for, true error and told one of the signal asked for that is worst.

    Further what it says that it misses, '' if it claims to be what was asked for; told over true errors by signal, where that is
    judged, and the signals' `KINDS`; processor time of all runs over that of the cheapest single one that is as accurate, nan
    where not looked for; wall time, s.
    """

    scene: str
    name: str
    asked: float
    error: float
    estimate: float
    said: str
    told: Mapping[str, float]
    kinds: Mapping[str, str]
    price: float
    wall_s: float

    @property
    def ratio(self) -> float:
        """Delivered over asked error; infinite for a run without a result."""
        return self.error / self.asked if np.isfinite(self.error) else float("inf")


def _outcomes(p: Parameters, progress: Progress) -> Iterator[Delivered]:
    jobs = [(name, asked, k) for k in range(p.cases) for name in p.scenes for asked in p.accuracies]
    for name, asked, k in progress(jobs, label="mechanisms"):
        scene = SCENES[name]
        made = draw(p.seed, k, scene.families)
        truth = scene.right(made, asked, p.reference)
        if truth is not None:
            yield _judged(name, made, truth, asked, scene.of, p)


def _judged(scene: str, made: Draw, truth: Truth, asked: float, of: str, p: Parameters) -> Delivered:
    """Deliver a mechanism, and hold it against the truth."""
    goal, start, begun = Asked(asked, of), perf_counter(), process_time()
    ladder = ladder_of(made.mechanism, made.duration, asked, suited(made.mechanism))
    found = deliver(Climb(ladder, runner(p.timeout)), goal)
    spent, wall = process_time() - begun, perf_counter() - start
    said = str(found.run.failure[0]) if found.run.failure else found.missed(goal)
    coarse = bool(truth.errors) and len(truth.functions.time) < len(found.run.record.time)
    if found.run.failure or not found.errors.known or coarse:
        error = float("nan" if coarse else "inf")
        return Delivered(scene, made.name, asked, error, float("nan"), said, {}, {}, float("nan"), wall)
    true = relative(compare(Functions.of(found.run), truth.functions, found.errors.until))
    judged = {
        name: found.errors.signals[name] / true[name]
        for name, signal in truth.functions.signals.items()
        if true.get(name, 0.0) > max(NOTHING, truth.errors.get(name, 0.0) / JUDGED) and name in found.errors.signals
    }
    kinds = {n: key for n in judged for key, kinds in KINDS.items() if truth.functions.signals[n].kind in kinds}
    judged = {name: judged[name] for name in kinds}
    off = worst(goal, truth.functions, {name: true[name] for name in true if name in found.errors.signals})
    sound = {name for name in true if truth.errors.get(name, 0.0) <= max(JUDGED * true[name], JUDGED * asked)}
    error = off.error if off.name in sound or not off.name else float("nan")
    price = _price(ladder, found, truth, goal, spent) if p.price == "priced" else float("nan")
    return Delivered(scene, made.name, asked, error, found.worst.error, said, judged, kinds, price, wall)


def _price(ladder: Ladder, found: Delivery, truth: Truth, goal: Asked, spent: float) -> float:
    """Processor time of all runs over that of the cheapest single one of a grid that errs no more than what was delivered."""
    until, best = found.errors.until, np.inf

    def off(functions: Functions) -> float:
        return worst(goal, truth.functions, relative(compare(functions, truth.functions, until))).ratio

    most = max(1.0, off(Functions.of(found.run)))
    for space in range(GRID if ladder.in_space else 1):
        for time in range(-COARSER, COARSER):
            begun = process_time()
            run = ladder.made(time, space, runner(PATIENCE))
            took = process_time() - begun
            if run.failure is None and took < best and off(Functions.of(run)) <= most:
                best = took
                break
    return spent / best


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Draw mechanisms, ask for each accuracy, and look at what comes."""
    found = [o for o in _outcomes(p, progress) if not np.isnan(o.error)]
    groups = {name: [o for o in found if o.scene == name] for name in p.scenes}
    silent = [o for o in found if o.ratio > SILENT and not o.said]
    within = _within(found)
    metrics = {
        "cases": Metric(float(len(found)), "1"),
        "within": Metric(within, "1"),
        "worst_ratio": Metric(_worst(found), "1"),
        "silent": Metric(float(len(silent)), "1"),
    }
    for kind in KINDS:
        key = "effectivity" if kind == "places" else f"effectivity.{kind}"
        metrics |= _effectivity(key, [x for o in found for n, x in o.told.items() if o.kinds[n] == kind])
    prices = [o.price for o in found if np.isfinite(o.price)]
    for name, q in (("median", 50), ("p95", 95)):
        metrics[f"price.{name}"] = Metric(float(np.percentile(prices, q)) if prices else float("nan"), "1")
    for name, group in groups.items():
        key = name.replace(" ", "_").replace("clearance", "play")  # metrics keep their first names
        metrics[f"{key}.within"] = Metric(_within(group), "1")
        metrics[f"{key}.worst_ratio"] = Metric(_worst(group), "1")
    wrong = [f"{o.scene}, {o.name}: {o.error:.1e} where {o.asked:g} was asked, not told" for o in silent]
    share = f"{100 * within:.3g} % of {len(found)} results as accurate as asked, or telling that they are not"
    if not within >= WITHIN:
        wrong.append(f"{share}; must be {100 * WITHIN:g} %")
    return StudyResult(
        parameters=p,
        **judged(wrong, share),
        metrics=metrics,
        signals={name: np.array([getattr(o, name) for o in found]) for name in ("asked", "error", "estimate", "wall_s", "price")}
        | {"scene": np.array([list(SCENES).index(o.scene) for o in found]), "told": np.array([bool(o.said) for o in found])},
        tables=[_table(p, groups), _low(found)],
    )


def _effectivity(key: str, ratios: Sequence[float]) -> dict[str, Metric]:
    """Percentiles of told over true errors; share of those told too small, and the smallest."""
    values = np.array(ratios) if len(ratios) else np.array([np.nan])
    marks = {"p1": 1, "p5": 5, "median": 50, "p95": 95}
    found = {f"{key}.{name}": Metric(float(np.percentile(values, q)), "1") for name, q in marks.items()}
    found[f"{key}.low"] = Metric(float(np.mean(values < LOW)) if len(ratios) else float("nan"), "1")
    return found | {f"{key}.lowest": Metric(float(values.min()), "1"), f"{key}.signals": Metric(float(len(ratios)), "1")}


def _within(outcomes: Sequence[Delivered]) -> float:
    """Share of results as accurate as asked, or that say that they are not; nan of none."""
    return float(np.mean([o.ratio <= 1 or bool(o.said) for o in outcomes])) if outcomes else float("nan")


def _worst(outcomes: Sequence[Delivered]) -> float:
    return max((o.ratio for o in outcomes if not o.said), default=float("nan"))


def _low(found: Sequence[Delivered]) -> Table:
    """The signals whose errors are told too small."""
    rows = [
        [o.scene, o.name, f"{o.asked:g}", name, f"{ratio:.2g}"]
        for o in found for name, ratio in sorted(o.told.items(), key=lambda each: each[1]) if ratio < LOW
    ]  # fmt: skip
    return Table(["scene", "mechanism", "asked", "signal", "told/true"], rows, "Errors told too small", f"below {LOW:g}")


def _table(p: Parameters, groups: dict[str, list[Delivered]]) -> Table:
    rows: list[list[Any]] = []
    for name, group in groups.items():
        for asked in p.accuracies:
            if not (part := [o for o in group if o.asked == asked]):
                continue  # no reference
            silent, told = sum(o.ratio > SILENT and not o.said for o in part), sum(bool(o.said) for o in part)
            ratios = [x for o in part for x in o.told.values()]
            trust = float(np.median(ratios)) if ratios else float("nan")
            time = 1e3 * float(np.median([o.wall_s for o in part]))
            rows.append([name, f"{asked:g}", len(part), _within(part), _worst(part), silent, told, f"{trust:.2g}", f"{time:.3g}"])
    headers = ["scene", "asked", "cases", "within", "worst", "silent", "told", "told/true", "median [ms]"]
    return Table(headers, rows, "Error delivered against error asked for", NOTES)


def figure(result: StudyResult) -> Figure:
    """Delivered over asked error, a mark a mechanism; hollow where the run said so itself."""
    s, (fig, ax) = result.signals, subplots(height=105)
    names, spread = list(SCENES), np.random.default_rng(0)
    for k in np.unique(s["scene"]):
        mine = s["scene"] == k
        colour = COLOURS[int(k) % len(COLOURS)]
        x = s["asked"][mine] * 10 ** spread.uniform(-0.18, 0.18, mine.sum())
        y = np.clip(s["error"][mine] / s["asked"][mine], 1e-6, 1e3)
        look: dict[str, Any] = {"marker": MARKS[int(k) % len(MARKS)], "edgecolors": colour, "linewidths": 0.8}
        look["facecolors"] = ["none" if told else colour for told in s["told"][mine]]
        ax.scatter(x, y, s=16, label=names[int(k)], **look)
    ax.axhline(1.0, color="#000000", linewidth=0.8)
    ax.axhline(SILENT, color="#000000", linewidth=0.8, linestyle=":")
    ax.set(xscale="log", yscale="log", xlabel="error asked for", ylabel="error delivered over error asked for")
    ax.annotate("beyond: must be told", (1.0, SILENT), xycoords=("axes fraction", "data"), xytext=(0, 3),
                textcoords="offset points", ha="right", fontsize=8)  # fmt: skip
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return fig
