"""Accuracy asked for against accuracy delivered: random mechanisms of every kind, each against a reference of its own.

`simulate(mechanism, duration, accuracy)` chooses elements, integrator, steps and tolerances itself. Here its result is compared
with loop closure, an equation of motion, or the compiled solver where two of its runs, one finer than the other, agree. A result
is silent if it errs by more than three times what was asked and does not say so; one that names its failure, or that it is
SUSPECT, has said so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs import Mechanism, Result, Status, Strut, simulate
from buckler.mbs.accuracy.aim import MOTION, Aim
from buckler.mbs.accuracy.band import banded
from buckler.mbs.accuracy.difference import difference
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.studies.kit.parameters import StudyParameters, choices, integer, quantities, quantity
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import COLOURS, Figure, subplots
from buckler.studies.trust.drawn import EVERYTHING, Drawn, drawn
from buckler.studies.trust.extremes_truth import reference_solver

SILENT = 3.0
"""Delivered over asked error from which a result must say that it is not what was asked for."""
WITHIN = 0.95
"""Share of all results that must be as accurate as asked."""
NOTES = """\
within: results no farther off than asked. worst: largest error over that asked. silent: more than three times off, and not
marked. told: SUSPECT, or failed by name. estimate/error: median of the result's own estimate over its error. Mechanisms whose two
reference runs do not agree are left out."""
MARKS = "os^vDP*Xph"
SAMPLES = 2001
"""Times at which motions known otherwise are compared."""
FINE = 1e-5
"""Tolerance of the finer of two reference runs, of the accuracy asked for; within 1e-10 and 1e-8."""
AGREED = 0.3
"""Difference of two reference runs, of the accuracy asked for, up to which they are one truth."""
PATIENCE = 60.0
"""Longest time, s, of a reference run."""


# --- what is right ---------------------------------------------------------------------------------------------------------

Off = Callable[[Result], float]
"""Error of a result; nan without a reference."""


def closed_loop(made: Drawn, asked: float, aim: Aim) -> Off:
    """Against the place of a rigid slider-crank's slider."""
    mechanism, speed = made.mechanism, _constant(made)
    time = np.linspace(0.0, made.duration, SAMPLES)
    return _slider(time, SliderCrank(mechanism.length("crank"), mechanism.length("coupler")).slider(speed * time))


def moving_slider(made: Drawn, asked: float, aim: Aim) -> Off:
    """Against the equation of motion of a slider on a strut, from one touch of its stop to the next."""
    (stop,), (guide,), body = made.mechanism.stops, made.mechanism.guides, made.mechanism.link("coupler").body
    crank, length, speed = made.mechanism.length("crank"), made.mechanism.length("coupler"), _constant(made)
    assert isinstance(body, Strut)
    section, time = body.section, np.linspace(0.0, made.duration, SAMPLES)
    unit, rigidity, euler = section.bending_stiffness / length**2, section.axial_stiffness / length, section.euler_load(length)

    def rates(t: float, y: Any, onset: float) -> Any:
        pin, (x, v), depth = crank * np.exp(1j * speed * t), y, stop.at - y[0]
        span = abs(pin - x)
        push = rigidity * (length - span)
        if push > euler:
            push = unit * float(body.load(1 - span / length - euler / section.axial_stiffness))
        return v, (push * (x - pin.real) / span + (stop.law.force(depth, -v, onset) if depth > 0 else 0.0)) / guide.mass

    def touches(t: float, y: Any, onset: float) -> float:
        return float(stop.at - y[0]) if t > begin + 1e-9 * made.duration else 1.0

    touches.direction, touches.terminal = 1.0, True  # type: ignore[attr-defined]
    begin, state, onset, x = 0.0, np.array([made.mechanism.points["B"][0], 0.0]), 1.0, np.empty(SAMPLES)
    while begin < made.duration:
        part = solve_ivp(
            rates, (begin, made.duration), state, "DOP853", None, True, touches, args=(onset,),
            rtol=1e-9, atol=1e-12, max_step=made.duration / 500,
        )  # fmt: skip
        x[time >= begin] = part.sol(time[time >= begin])[0]
        begin, state = float(part.t[-1]), part.y[:, -1]
        onset = -state[1]
    return _slider(time, x)


def _constant(made: Drawn) -> float:
    """Speed of its crank, rad/s."""
    speed = made.mechanism.drives[0].speed
    assert isinstance(speed, float)
    return speed


def _slider(time: Any, x: Any) -> Off:
    right = Result(Status.OK, "", time, {"B.x": x, **{f"B.{name}": 0 * x for name in ("y", "vx", "vy")}}, {}, {})
    return lambda result: difference(result, right)


def two_runs(made: Drawn, asked: float, aim: Aim) -> Off:
    """Against the finer of two runs of the compiled solver, if they agree."""
    mechanism, duration = made.mechanism, made.duration
    tolerance = float(np.clip(FINE * asked, 1e-10, 1e-8))
    coarse, fine = (simulate(mechanism, duration, solver=reference_solver(made, k, tolerance), timeout=PATIENCE) for k in (0, 1))
    coarse, fine = (  # as an accuracy gives them
        replace(each, signals=each.signals | banded(mechanism, each.time, each.signals, each.units)) for each in (coarse, fine)
    )
    return (lambda result: aim.apart(result, fine)) if aim.apart(coarse, fine) <= AGREED * asked else lambda _: float("nan")


class Scene(NamedTuple):
    """Families of mechanisms, what an accuracy is asked of, and what is right."""

    families: tuple[str, ...]
    aim: Aim = MOTION
    right: Callable[[Drawn, float, Aim], Off] = two_runs


SCENES = {
    **{name: Scene((name,)) for name in ("smooth", "ramp")},
    "rigid": Scene(("rigid",), right=closed_loop),
    "buckling": Scene(("strip on a stop",)),
    "strut": Scene(("any struck",), right=moving_slider),
    **{name: Scene((name,)) for name in ("rigid clearance", "modal clearance", "beam clearance")},
    "grammar": Scene(EVERYTHING, Aim("places")),
    "forces": Scene(EVERYTHING, Aim("forces")),
}


class DrawnCase(NamedTuple):
    """A mechanism, how long it is run, s, the error of a result, and what an accuracy is asked of."""

    mechanism: Mechanism
    duration: float
    error: Off
    aim: Aim


def case(name: str, seed: int, k: int, asked: float) -> DrawnCase:
    """The k-th mechanism of a scene."""
    scene = SCENES[name]
    made = drawn(seed, k, scene.families)
    return DrawnCase(made.mechanism, made.duration, scene.right(made, asked, scene.aim), scene.aim)


# --- the study -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    scenes: tuple[str, ...] = choices(tuple(SCENES), tuple(SCENES), "kinds of mechanism", "scenes")
    accuracies: tuple[float, ...] = quantities((1e-2, 1e-3), "1", 1e-6, 0.1, "what is asked for", "scenes")
    cases: int = integer(2, 1, 10_000, "random mechanisms of each kind, for each accuracy", "scenes")
    seed: int = integer(0, 0, 2**31 - 1, "draws the mechanisms", "scenes")
    timeout: float = quantity(60.0, "s", 0.1, 3600, "longest time a run may take", "numerics")


class Delivered(NamedTuple):
    """What came of one mechanism: what was asked for, found and estimated, how the run ended, and how long it took, s."""

    scene: str
    asked: float
    error: float
    estimate: float
    status: str
    message: str
    wall_s: float

    @property
    def ratio(self) -> float:
        """Delivered over asked error; infinite for a run without a result."""
        return self.error / self.asked if np.isfinite(self.error) else float("inf")

    @property
    def told(self) -> bool:
        """Whether the run itself says that it is not to be trusted."""
        return self.status != "OK"


def _outcomes(p: Parameters, progress: Progress) -> Iterator[Delivered]:
    jobs = [(name, asked, k) for k in range(p.cases) for name in p.scenes for asked in p.accuracies]
    for name, asked, k in progress(jobs, label="mechanisms"):
        made = case(name, p.seed, k, asked)
        start = perf_counter()
        result = simulate(made.mechanism, made.duration, asked, of=made.aim.of, timeout=p.timeout)
        wall = perf_counter() - start
        ended = result.time.size > 0 and result.time[-1] >= made.duration * (1 - 1e-6)
        error = made.error(result) if ended else float("inf")
        if not np.isnan(error):  # it has a reference
            estimate = result.error.motion if made.aim.motion else made.aim.largest(result.error, result.units)
            yield Delivered(name, asked, error, estimate, str(result.status), result.message, wall)


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Draw mechanisms, ask for each accuracy, and look at what comes."""
    found = list(_outcomes(parameters, progress))
    groups = {name: [o for o in found if o.scene == name] for name in parameters.scenes}
    silent = [o for o in found if o.ratio > SILENT and not o.told]
    within = _within(found)
    metrics = {
        "cases": Metric(float(len(found)), "1"),
        "within": Metric(within, "1"),
        "worst_ratio": Metric(_worst(found), "1"),
        "silent": Metric(float(len(silent)), "1"),
    }
    for name, group in groups.items():
        key = name.replace(" ", "_").replace("clearance", "play")  # metrics keep their first names
        metrics[f"{key}.within"] = Metric(_within(group), "1")
        metrics[f"{key}.worst_ratio"] = Metric(_worst(group), "1")
    wrong = [f"{o.scene}: {o.error:.1e} where {o.asked:g} was asked, not told" for o in silent]
    if not within >= WITHIN:
        wrong.append(f"{100 * within:.3g} % of all results as accurate as asked, must be {100 * WITHIN:g} %")
    return StudyResult(
        parameters=parameters,
        status="SUSPECT" if wrong else "OK",
        message="; ".join(wrong) or f"{100 * within:.3g} % of {len(found)} results as accurate as asked",
        metrics=metrics,
        signals={name: np.array([getattr(o, name) for o in found]) for name in ("asked", "error", "estimate", "wall_s")}
        | {"scene": np.array([list(SCENES).index(o.scene) for o in found]), "told": np.array([o.told for o in found])},
        tables=[_table(parameters, groups)],
    )


def _within(outcomes: Sequence[Delivered]) -> float:
    """Share of results as accurate as asked; nan of none."""
    return float(np.mean([o.ratio <= 1 for o in outcomes])) if outcomes else float("nan")


def _worst(outcomes: Sequence[Delivered]) -> float:
    return max((o.ratio for o in outcomes), default=float("nan"))


def _table(p: Parameters, groups: dict[str, list[Delivered]]) -> Table:
    rows: list[list[Any]] = []
    for name, group in groups.items():
        for asked in p.accuracies:
            if not (part := [o for o in group if o.asked == asked]):
                continue  # no reference
            silent, told = sum(o.ratio > SILENT and not o.told for o in part), sum(o.told for o in part)
            trust = float(np.median([o.estimate / o.error if o.error > 0 else np.nan for o in part]))
            time = 1e3 * float(np.median([o.wall_s for o in part]))
            rows.append([name, f"{asked:g}", len(part), _within(part), _worst(part), silent, told, f"{trust:.2g}", f"{time:.3g}"])
    headers = ["scene", "asked", "cases", "within", "worst", "silent", "told", "estimate/error", "median [ms]"]
    return Table(headers, rows, "Error delivered against error asked for", NOTES)


def figure(result: StudyResult) -> Figure:
    """Delivered over asked error, a mark a mechanism; hollow where the run said so itself."""
    s, fig_ax = result.signals, subplots(height=105)
    fig, ax = fig_ax
    names, spread = list(SCENES), np.random.default_rng(0)
    for k in np.unique(s["scene"]):
        mine = s["scene"] == k
        colour = COLOURS[int(k) % len(COLOURS)]
        x = s["asked"][mine] * 10 ** spread.uniform(-0.18, 0.18, mine.sum())
        y = np.clip(s["error"][mine] / s["asked"][mine], 1e-6, 1e3)
        faces = ["none" if told else colour for told in s["told"][mine]]
        ax.scatter(x, y, s=16, marker=MARKS[int(k)], facecolors=faces, edgecolors=colour, linewidths=0.8, label=names[int(k)])
    ax.axhline(1.0, color="#000000", linewidth=0.8)
    ax.axhline(SILENT, color="#000000", linewidth=0.8, linestyle=":")
    ax.set(xscale="log", yscale="log", xlabel="error asked for", ylabel="error delivered over error asked for")
    ax.annotate("beyond: must be told", (1.0, SILENT), xycoords=("axes fraction", "data"), xytext=(0, 3),
                textcoords="offset points", ha="right", fontsize=8)  # fmt: skip
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return fig
