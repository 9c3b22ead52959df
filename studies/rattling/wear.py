"""Wear of the crank-rocker's joints over a million turns, its rocker rigid or flexible: where pins and bushes lose how much.

A few turns with contact, friction and the surfaces as they are tell what a turn takes; jumps of many turns lead on, the worn
surfaces go back into the contact. The error of the jumps is told, and the scatter of rattling joints from turn to turn. What
the paper does not tell is a parameter: the wear coefficient (depths are in proportion to it as long as they are small beside
the clearance), the length of the bushes, how much harder the pins are, and all that `crank-rocker` has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np

from buckler import mbs
from buckler.mbs import Mechanism, Result
from buckler.mbs.elements.clearance import clearances, contact, states
from buckler.mbs.geometry import Array

from ..kit.parameters import integer, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.statistics import Mean
from ..kit.style import Figure, subplots
from .assumptions import BODIES
from .clearance import COLOURS, CrankRockerParameters, label
from .turns import STEPS_A_TURN
from .wearing import BUSH, PIN, Jump, Rubbing, directions, fitted, jumps, shares, size

SIDES = {"bush": BUSH, "pin": PIN}
TRUSTED = 0.1
"""Relative error of all jumps up to which the numbers are trusted."""
NOTES = """\
Depths are the deepest place, volumes of one surface. Error: of all jumps, relative, root mean square of
eight harmonics around a surface.
Scatter: standard error of a turn's wear over {measured} turns at the end, relative.
k = {k:g} 1/Pa; the volume of steel on steel, dry, is some 1e-14 to 1e-13 1/Pa, lubricated 1e-18 to 1e-15. {stated}."""


@dataclass(frozen=True)
class Parameters(CrankRockerParameters):
    """Parameters of the study."""

    turns: float = quantity(1e6, "1", 1, 1e12, "turns of the crank", "wear")
    wear_coefficient: float = quantity(1e-14, "1/Pa", 1e-20, 1e-10, "k: volume over force and way, of the bushes", "wear")
    pin_wear: float = quantity(1.0, "1", 0, 100, "wear coefficient of the pins over that of the bushes", "wear")
    bush_length: float = quantity(10e-3, "m", 1e-3, 0.1, "length of pins and bushes", "wear")
    measured_turns: int = integer(3, 1, 1000, "turns whose wear is averaged, after one that settles", "numerics")
    jump_error: float = quantity(0.01, "1", 1e-4, 1, "error allowed of a jump, over the clearance", "numerics")
    bins: int = integer(180, 36, 3600, "places around a surface", "numerics")

    def check(self) -> None:
        """As every study of the crank-rocker; and a joint must have clearance."""
        super().check()
        if not self.with_play:
            raise ValueError("clearance_joints = 0: no joint can wear; choose 1 to 4")

    @property
    def turn(self) -> float:
        """Time of a turn, s."""
        return 2 * pi / self.speed

    @property
    def radii(self) -> Array:
        """Of bush and pin, m."""
        return np.array([self.pin + self.clearance, self.pin])

    @property
    def coefficients(self) -> Array:
        """Wear coefficient over radius and length, of bush and pin, rad/N."""
        return self.wear_coefficient * np.array([1.0, self.pin_wear]) / (self.radii * self.bush_length)


def worn_mechanism(mechanism: Mechanism, worn: Mapping[str, Array], gap: float) -> Mechanism:
    """The mechanism with these depths, m, (2, bins), gone from its joints, by their points."""

    def rubbed(joint: Any) -> Any:
        if joint.ideal:
            return joint
        (more, bush), (and_more, pin) = (fitted(gap, worn[joint.point][side]) for side in (BUSH, PIN))
        return replace(joint, gap=gap + more + and_more, bush_profile=bush, pin_profile=pin)

    return replace(mechanism, joints=[rubbed(joint) for joint in mechanism.joints])


@dataclass
class Rate:
    """What a turn takes, from a run of a few; keeps how many there were, what was first wrong, and the scatter of the last."""

    p: Parameters
    rocker: str
    runs: int = 0
    wrong: str = ""
    scatter: float = 0.0

    def __call__(self, worn: Array) -> Array:
        """Depth per turn, m, (joints, 2, bins), of surfaces worn so far."""
        p = self.p
        by_point = dict(zip(p.with_play, worn, strict=True))
        mechanism = worn_mechanism(p.mechanism(self.rocker), by_point, p.clearance)
        steps = mbs.Controlled(tolerance=p.tolerance, max_step=p.turn / STEPS_A_TURN)
        result = mbs.simulate(mechanism, (1 + p.measured_turns) * p.turn, solver=mbs.Exudyn(steps), timeout=p.timeout)
        self.runs += 1
        self.wrong = self.wrong or ("" if result.ok else result.message)
        if result.time[-1] < 2 * p.turn:
            raise RuntimeError(f"{result.status}: {result.message}")
        each = np.stack([self._of(result, point, by_point[point]) for point in p.with_play], axis=1)
        total = Mean.of(each.sum(axis=(1, 2, 3)))
        self.scatter = total.error / total.value
        return np.asarray(each.mean(axis=0))

    def _of(self, result: Result, point: str, worn: Array) -> Array:
        """Depth that each turn takes of bush and pin, m, (turns, 2, bins)."""
        p, record = self.p, result.film.record
        loose = clearances(record.mechanism)
        name, joint = next((n, j) for n, j in record.mechanism.elements().items() if j in loose and j.point == point)
        pin, bush = states(joint, record)
        found = contact(joint, pin, bush, record.channel(name, "memory"), record.time)
        power = found.normal * np.abs(found.sliding)
        way = np.concatenate([[0.0], (power[1:] + power[:-1]) / 2 * np.diff(record.time)])
        place, taken = np.column_stack([found.ex, found.ey]), []
        for k in range(1, round(result.time[-1] / p.turn)):  # those that the run got through
            kept = (record.time > k * p.turn) & (record.time <= (k + 1) * p.turn)
            rub = Rubbing(place[kept], found.depth[kept], way[kept], (bush.angle[kept], pin.angle[kept]))
            taken.append([c * shares(rub, p.clearance, worn, side) for side, c in enumerate(p.coefficients)])
        return np.array(taken)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Wear the joints of the mechanism with each rocker."""
    metrics: dict[str, Metric] = {}
    signals: dict[str, Array] = {"direction": directions(p.bins)}
    rows: list[list[Any]] = []
    wrong: list[str] = []
    for rocker in p.rocker:
        name, rate = label(rocker), Rate(p, rocker)
        start = np.zeros((len(p.with_play), 2, p.bins))
        course = list(progress(jumps(rate, start, p.turns, p.jump_error * p.clearance), label=f"jumps, {name}"))
        found = _metrics(p, course)
        metrics |= {f"{name}.{key}": metric for key, metric in found.items()}
        metrics[f"{name}.scatter"] = Metric(rate.scatter, "1")
        metrics[f"{name}.runs"] = Metric(rate.runs, "1")
        signals |= {f"{name}.turns": np.array([j.turns for j in course]), f"{name}.worn": np.array([j.worn for j in course])}
        rows += _rows(p, name, found, rate.scatter)
        wrong += [f"{name}: {rate.wrong}"] if rate.wrong else []
        if found["error"].value > TRUSTED:
            share = f"{100 * found['error'].value:.2g} %"
            wrong.append(f"{name}: the relative error of the jumps is {share}; choose a smaller jump_error")
    headers = ["rocker", "joint", "surface", "deepest [um]", "volume [mm^3]", "error", "scatter"]
    notes = NOTES.format(measured=p.measured_turns, k=p.wear_coefficient, stated=p.stated())
    table = Table(headers, rows, f"Wear after {p.turns:g} turns, {1e3 * p.clearance:g} mm clearance at first", notes)
    return StudyResult(parameters=p, metrics=metrics, signals=signals, tables=[table], **judged(wrong))


def volume(p: Parameters, depth: Array, side: int) -> float:
    """Volume of a surface's wear, m^3."""
    return float(depth.mean() * 2 * pi * p.radii[side] * p.bush_length)


def _metrics(p: Parameters, course: list[Jump]) -> dict[str, Metric]:
    """Deepest wear and volume of each surface, the error of the jumps, and how much faster or slower it wears at the end."""
    last, found = course[-1], {}
    for point, worn in zip(p.with_play, last.worn, strict=True):
        for surface, side in SIDES.items():
            found[f"{point}.{surface}.depth"] = Metric(float(worn[side].max()), "m")
            found[f"{point}.{surface}.volume"] = Metric(volume(p, worn[side], side), "m^3")
    found["error"] = Metric(last.error / max(size(last.worn), 1e-300), "1")
    found["jumps"] = Metric(len(course) - 1, "1")
    found["rate_ratio"] = Metric(float(last.rate.sum() / course[0].rate.sum()), "1")
    return found


def _rows(p: Parameters, name: str, found: Mapping[str, Metric], scatter: float) -> list[list[Any]]:
    shown = (f"{100 * found['error'].value:.2g} %", f"{100 * scatter:.2g} %")
    return [
        [name, f"{point}: {'-'.join(BODIES[point])}", s, 1e6 * found[f"{point}.{s}.depth"].value,
         1e9 * found[f"{point}.{s}.volume"].value, *shown]
        for point in p.with_play
        for s in SIDES
    ]  # fmt: skip


def figure(result: StudyResult) -> Figure:
    """Draw depths around each bush and pin at the end, and the deepest place over the turns."""
    p, s = result.of(Parameters), result.signals
    joints = p.with_play
    fig, axes = subplots(2, len(joints), height=110, squeeze=False, sharey="row")
    for k, point in enumerate(joints):
        for name in map(label, p.rocker):
            for surface, style in zip(SIDES, ("-", "--"), strict=True):
                worn = 1e6 * s[f"{name}.worn"][:, k, SIDES[surface]]
                axes[0, k].plot(np.degrees(s["direction"]), worn[-1], style, color=COLOURS[name], lw=0.8)
                known = {"color": COLOURS[name], "lw": 0.8, "label": f"{name}, {surface}"}
                axes[1, k].plot(s[f"{name}.turns"] / 1e6, worn.max(axis=1), style, **known)
        axes[0, k].set(title=f"{point}: {'–'.join(BODIES[point])}", xlabel="direction [°]", xticks=[0, 180, 360])
        axes[1, k].set(xlabel="turns [million]")
    axes[0, 0].set(ylabel="depth gone [µm]", ylim=(0, None))
    axes[1, 0].set(ylabel="deepest place [µm]", ylim=(0, None))
    axes[1, -1].legend(loc="upper left")
    return fig
