"""What each scene is made of, and what each optional part costs: items, coordinates and run time, off and on.

A part that is off is not there: no engine item, no coordinate, no data, so it can cost nothing; that is counted. What a part
costs when it is on is the ratio of medians of runs taken in turn, of the whole run and of one of its steps (a part changes the
motion, and with it the number of steps). Signals, contact signals and self-checks are made after the engine's work; theirs is the
time of the whole run over that without them. Times are those of the process, not of the clock.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from math import pi
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from buckler import mbs
from buckler.mbs import build, crank_rocker, simulate
from buckler.mbs import slider_crank as slider
from buckler.mbs.checks.suspicions import suspicions
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.elements.element import Body
from buckler.mbs.engine.solve import once
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, Coulomb, FrictionLaw, Impact, NoFriction
from buckler.mbs.library import PAPER
from buckler.mbs.record.signals import collect
from buckler.mbs.solvers import Exudyn

from ..kit.parameters import StudyParameters, choices, integer
from ..kit.published import CONTACT_DAMPING, CONTACT_STIFFNESS, GRAVITY, IMPACT_SPEED, STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Figure, subplots
from ..kit.work_precision import footnote, work_precision

BASE, AGAIN = "nothing optional", "nothing, again"
OVER = {"static friction": "friction"}
"""What a part is measured over, where that is not the scene without any."""
STRIP, BARS = mbs.Section(STRIP_WIDTH, 3e-4), mbs.Section(0.005, 0.020)
LENGTH, MASS, SPEED = PAPER.coupler, 0.3, IMPACT_SPEED
ITEMS = ("objects", "nodes", "loads", "sensors")
PULL = (0.0, -GRAVITY)


@dataclass(frozen=True)
class LeanScene:
    """A scene with or without a part: what is built, how long it runs, what is asked of the run."""

    mechanism: mbs.Mechanism
    duration: float
    asked: Mapping[str, Any] = field(default_factory=dict)

    @property
    def summary(self) -> dict[str, int]:
        """What is built."""
        return build(self.mechanism).summary()


Variants = dict[str, LeanScene]


def striking(coupler: Any) -> Variants:
    """The slider-crank, half a turn; its stop is a part."""
    plain = LeanScene(slider(coupler, law=None, mass=MASS, speed=SPEED), pi / SPEED)

    def made(law: Any = None, friction: mbs.GuideFriction | None = None) -> LeanScene:
        return replace(plain, mechanism=slider(coupler, law=law, mass=MASS, speed=SPEED, friction=friction))

    return {
        BASE: plain,
        "stop": made(CarvalhoMartins(7.2e4, 0.8, exponent=1.0)),
        "friction": made(friction=mbs.GuideFriction(0.3)),
        "static friction": made(friction=mbs.GuideFriction(0.3, static=0.6)),
        **_asked(plain, not coupler.massless),
    }


def turning(rocker: Body, with_play: str) -> Variants:
    """The crank-rocker, a tenth of a turn; friction of its joints is a part."""

    def made(friction: FrictionLaw) -> LeanScene:
        def play(point: str, first: str, second: str) -> mbs.Clearance:
            return mbs.Clearance(point, first, second, 5e-3, 2.5e-4, Impact(CONTACT_STIFFNESS, CONTACT_DAMPING, 1e-5), friction)

        speed = 10 * pi
        made = crank_rocker(rocker, speed=speed, play=play, with_play=with_play, section=BARS, angle=0.5)
        return LeanScene(made, 0.2 * pi / speed)

    plain = made(NoFriction())
    frictions = {"friction": made(Coulomb(0.1, 0.1)), "static friction": made(AdamsFriction(0.3, 0.1))} if with_play else {}
    return {BASE: plain, **frictions, **_asked(plain, rocker.flexible)}


def _asked(plain: LeanScene, flexible: bool) -> Variants:
    """What any scene can be asked for."""
    shapes = {"shapes": list(np.linspace(0.0, plain.duration, 101))}
    return {
        AGAIN: plain,
        "gravity": replace(plain, mechanism=replace(plain.mechanism, gravity=PULL)),
        "ledger": replace(plain, asked={"ledger": True}),
        **({"pictures": replace(plain, asked=shapes)} if flexible else {}),
    }


SCENES: dict[str, Callable[[], Variants]] = {
    "slider-crank-strut": lambda: striking(mbs.Strut(STRIP)),
    "slider-crank-beam": lambda: striking(mbs.Beam(STRIP.damped(0.05, LENGTH), elements=8, imperfection=-1e-4 * LENGTH)),
    "slider-crank-cable": lambda: striking(mbs.Cable(STRIP.damped(0.05, LENGTH), elements=8, imperfection=-1e-4 * LENGTH)),
    "crank-rocker-ideal": lambda: turning(mbs.Rigid(BARS), ""),
    "crank-rocker-play": lambda: turning(mbs.Rigid(BARS), "OABC"),
    "crank-rocker-play-beam": lambda: turning(mbs.Beam(BARS.damped(0.01, 0.175), elements=4), "OABC"),
    "crank-rocker-play-modal": lambda: turning(mbs.Modal(BARS, damping=0.01), "OABC"),
}


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    scenes: tuple[str, ...] = choices(tuple(SCENES), tuple(SCENES), "scenes to take apart", "scenes")
    repeats: int = integer(9, 1, 1000, "repetitions, taken in turn", "numerics")


@dataclass(frozen=True)
class Cost:
    """Of one part: items and coordinates it adds, and ratios of the time with it to that without."""

    items: int
    coordinates: int
    run: float
    step: float


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Count and time every part of every scene."""
    summaries, costs, wrong = {}, {}, []
    for name in progress(p.scenes, label="scenes"):
        variants = SCENES[name]()
        summaries[name] = {part: variant.summary for part, variant in variants.items()}
        costs[name] = _costs(variants, summaries[name], p.repeats)
        unasked = summaries[name][BASE].keys() & {"Stop", "GuideFriction", "gravity"}
        if unasked or any(summary["sensors"] for summary in summaries[name].values()):
            wrong.append(f"{name}: builds {', '.join(unasked) or 'sensors'}, which nobody asked for")
    metrics = {}
    for name, parts in costs.items():
        plain = summaries[name][BASE]
        metrics[f"{name}.items"] = Metric(sum(plain[item] for item in ITEMS), "1")
        metrics[f"{name}.coordinates"] = Metric(plain["coordinates"], "1")
        metrics[f"{name}.constraints"] = Metric(plain["constraints"], "1")
        for part, cost in parts.items():
            metrics[f"{name}.{part}.items"] = Metric(cost.items, "1")
            metrics[f"{name}.{part}.ratio"] = Metric(cost.run, "1")
    return StudyResult(
        parameters=p,
        **judged(wrong),
        metrics=metrics,
        signals={
            f"{name}.{part}": np.array([cost.run, cost.step]) for name, parts in costs.items() for part, cost in parts.items()
        },
        tables=[_built(summaries), _table(costs, footnote(p))],
    )


def _costs(variants: Variants, summaries: Mapping[str, Mapping[str, int]], repeats: int) -> dict[str, Cost]:
    """Time every variant in turn after a first run that is not counted."""
    runs = {part: partial(simulate, v.mechanism, v.duration, solver=Exudyn(), **v.asked) for part, v in variants.items()}
    first = {part: run() for part, run in runs.items()}
    points = {point.name: point for point in work_precision(runs, lambda _: 0.0, repeats, clock=process_time)}
    found = {}
    for part, point in points.items():
        if part != BASE:
            over = OVER.get(part, BASE)
            now, before, plain = summaries[part], summaries[over], points[over]
            ratio, steps = point.wall_s / plain.wall_s, plain.work["steps"] / point.work["steps"]
            items = sum(now[item] - before[item] for item in ITEMS)
            found[part] = Cost(items, now["coordinates"] - before["coordinates"], ratio, ratio * steps)
    whole, after = points[BASE].wall_s, [_after(variants[BASE], first[BASE]) for _ in range(repeats)]
    for name in after[0]:
        spent = min(median(each[name] for each in after), 0.9 * whole)
        found[name] = Cost(0, 0, whole / (whole - spent), whole / (whole - spent))
    return found


def _seconds(work: Callable[[], object]) -> float:
    """Of this process, which other work on the machine lengthens least."""
    start = process_time()
    work()
    return process_time() - start


def _after(variant: LeanScene, result: mbs.Result) -> dict[str, float]:
    """Seconds of what is made after the engine's work."""
    run = once(variant.mechanism, variant.duration, Exudyn(), None, None)
    found = {
        "signals": _seconds(lambda: collect(run.record)),
        "self-checks": _seconds(lambda: list(suspicions(run, result))),
    }
    joints = [(name, joint) for name, joint in variant.mechanism.elements().items() if joint in clearances(variant.mechanism)]
    contacts = _seconds(lambda: [list(joint.signals(name, run.record)) for name, joint in joints])
    return found | ({"contact signals": contacts} if joints else {})


def _built(summaries: Mapping[str, Mapping[str, Mapping[str, int]]]) -> Table:
    """What each scene is made of without any optional part."""
    counted = ("coordinates", "constraints", *ITEMS)
    rows = []
    for name, parts in summaries.items():
        plain = parts[BASE]
        named = ", ".join(f"{count} {part}" for part, count in plain.items() if part not in counted)
        rows.append([name, named, *(plain[part] for part in counted)])
    return Table(["scene", "made of", *counted], rows, "Scenes with nothing optional")


def _table(costs: Mapping[str, Mapping[str, Cost]], notes: str) -> Table:
    """What each part adds and costs."""
    rows = [
        [name, part, cost.items, cost.coordinates, f"{cost.run:.2f}", f"{cost.step:.2f}"]
        for name, parts in costs.items()
        for part, cost in parts.items()
    ]
    headers = ["scene", "part", "items added", "coordinates added", "run, on/off", "step, on/off"]
    said = f"{AGAIN}: the scene itself once more, so that the noise shows; static friction is measured over friction\n"
    return Table(headers, rows, "What each optional part adds and costs", said + notes)


def figure(result: StudyResult) -> Figure:
    """Ratio of run times with and without each part, scene by scene."""
    names = list(dict.fromkeys(name.partition(".")[0] for name in result.signals))
    parts = list(dict.fromkeys(name.partition(".")[2] for name in result.signals))
    fig, ax = subplots(height=95)
    for k, scene in enumerate(names):
        found = [(i, result.signals[f"{scene}.{part}"][0]) for i, part in enumerate(parts) if f"{scene}.{part}" in result.signals]
        place, ratio = np.array(found).T
        ax.plot(place + 0.09 * (k - (len(names) - 1) / 2), ratio, "o", color=COLOURS[k % len(COLOURS)], label=scene)
    ax.axhline(1.0, color="black", lw=0.8)
    ax.set_xticks(range(len(parts)), [part.replace(" ", "\n").replace("-", "-\n") for part in parts])
    ax.set(xlabel="part", ylabel="run time, with over without [1]")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return fig
