"""Restitution asked for against restitution delivered: every contact law in drop tests on the engine, and exact.

A bush, driven at constant speed, strikes the pin of a bar at rest along the bar, which leaves (1 + e) times as fast.
The same e follows from the exact relation chi (1 + e) = ln[(1 + chi)/(1 - chi e)], or from the law's own closed form;
where there is none, from the equation of motion of one mass. docs/theory-contact.md has the laws and their sources.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from buckler import mbs
from buckler.mbs import Clearance, Drive, Guide, Link, Mechanism, Ramp, Rigid, Section, laws
from buckler.mbs.laws import Hertz, Impact, KelvinVoigt, NormalLaw, delivered

from ..kit.parameters import StudyParameters, choices, quantities, quantity
from ..kit.published import CONTACT_DAMPING, DAMPING_UNITS
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Figure, subplots
from ..rattling.bars import InPython

HYSTERESIS = (
    "HuntCrossley", "LankaraniNikravesh", "HerbertMcWhannell", "LeeWang", "Gonthier",
    "ZhiyingQishao", "Flores", "HuGuo", "CarvalhoMartins", "ExactRestitution",
)  # fmt: skip
"""Laws F = K d^n (1 + chi(e) d'/v0), by their names in `buckler.mbs.laws`."""
LAWS = (*HYSTERESIS, "KelvinVoigt")
"""Laws that can be asked for a restitution."""
LENGTH = 0.1
"""Of the bar, m."""
AGREES_TO = 1e-3
"""Difference of drop test and closed form beyond which the study is suspect."""
MARKS = "os^vDP*Xhd"


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    laws: tuple[str, ...] = choices(LAWS, LAWS, "laws that are asked for a restitution", "contact")
    restitution: tuple[float, ...] = quantities((0.1, 0.3, 0.5, 0.7, 0.9), "1", 0.05, 1, "what is asked for", "contact")
    stiffness: float = quantity(8e9, "N/m^1.5", 1e6, 1e13, "contact stiffness K", "contact")
    linear_stiffness: float = quantity(1e7, "N/m", 1e4, 1e10, "stiffness of KelvinVoigt", "contact")
    damping_depth: float = quantity(1e-5, "m", 1e-8, 1e-3, "depth d_max of Impact, c_max = 253", "contact")
    speed: float = quantity(0.3, "m/s", 1e-3, 10, "approach speed", "drop test")
    speeds: tuple[float, ...] = quantities((0.02, 0.1, 0.5), "m/s", 1e-3, 10, "approach speeds for Impact", "drop test")
    clearance: float = quantity(1e-3, "m", 1e-4, 1e-2, "radial clearance", "drop test")
    tolerance: float = quantity(1e-8, "1", 1e-10, 1e-3, "position error allowed a step, over clearance/10", "numerics")

    @property
    def section(self) -> Section:
        """Of the bar."""
        return Section(0.020, 0.005)

    @property
    def mass(self) -> float:
        """Of the bar, kg."""
        return self.section.mass_per_length * LENGTH

    def law(self, name: str, e: float) -> NormalLaw:
        """A law, asked for a restitution."""
        if name == "KelvinVoigt":
            return KelvinVoigt.from_restitution(self.linear_stiffness, e, self.mass)
        return getattr(laws, name)(self.stiffness, e)


class Drop(NamedTuple):
    """One drop test: what was asked for (nan: nothing), found and expected; steps and law evaluations it took."""

    name: str
    asked: float
    found: float
    exact: float
    energy_balance: float
    steps: float
    evaluations: int
    message: str = ""


# --- the drop test ----------------------------------------------------------------------------------------------------


def striker(law: NormalLaw, speed: float, clearance: float, section: Section) -> Mechanism:
    """Bush of a guided block, which reaches its constant speed before it meets the pin of a free bar.

    No gravity, nothing else acts on the bar, and the impact is central: an exact impact of one mass at this speed.
    """
    reaches = 0.5 * clearance / speed  # s; a quarter of the clearance is used up by then
    return Mechanism(
        points={"P": (0.0, 0.0), "Q": (-LENGTH, 0.0), "R": (LENGTH, 0.0)},
        links=[Link("bar", "P", "Q", Rigid(section)), Link("block", "P", "R", Rigid(section))],
        joints=[Clearance("P", "bar", "block", pin=5e-3, gap=clearance, law=law)],
        guides=[Guide("P", "block"), Guide("R", "block")],
        drives=[Drive("P", Ramp(0.0, speed, reaches))],
    )


def drop(name: str, law: NormalLaw, asked: float, speed: float, p: Parameters) -> Drop:
    """Let a law be struck once; the run ends when the pin should have moved off by a tenth of the clearance."""
    tally, exact = InPython(law), delivered(law, p.mass, speed)  # 50 laws take longer to compile than to use
    unit = p.clearance / speed
    result = mbs.simulate(
        striker(tally, speed, p.clearance, p.section),
        (1.5 + 0.1 / exact) * unit,
        solver=mbs.Exudyn(mbs.Controlled(tolerance=p.tolerance, max_step=0.02 * unit)),
        ledger=True,
        timeout=60,
    )
    found, inside = float("nan"), result.signals["P.penetration"][-1] > 0
    if result.ok and not inside:
        found = float(result.signals["bar.vx"][-1] / speed - 1)
    message = result.message or ("still in contact at the end" if inside else "")
    return Drop(name, asked, found, exact, result.energy_balance, result.work["steps"], tally.calls, message)


def cases(p: Parameters) -> list[tuple[str, NormalLaw, float, float]]:
    """Name, law, restitution asked for and speed of each drop test."""
    nothing = float("nan")
    found = [(f"{name}.{e:g}", p.law(name, e), e, p.speed) for name in p.laws for e in p.restitution]
    found.append(("Hertz", Hertz(p.stiffness), nothing, p.speed))
    for unit, factor in DAMPING_UNITS.items():
        law = Impact(p.stiffness, CONTACT_DAMPING * factor, p.damping_depth)
        found += [(f"Impact[{unit}].{v:g}", law, nothing, v) for v in p.speeds]
    return found


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Drop every law at every restitution asked for."""
    every = cases(p)
    drops = [drop(name, law, e, speed, p) for name, law, e, speed in progress(every, label="drop tests")]
    off = np.array([abs(d.found - d.exact) for d in drops])
    metrics = {f"{d.name}.delivered": Metric(d.found, "1", exact=d.exact) for d in drops}
    metrics["largest_difference"] = Metric(float(np.nanmax(off)), "1")
    metrics["energy_balance"] = Metric(max(d.energy_balance for d in drops), "1")
    wrong = [f"{d.name}: {d.message or f'off by {o:.1e}'}" for d, o in zip(drops, off, strict=True) if not o <= AGREES_TO]
    return StudyResult(
        parameters=p,
        **judged(wrong),
        metrics=metrics,
        signals={name: np.array([getattr(d, name) for d in drops]) for name in ("asked", "found", "exact")},
        work={name: sum(getattr(d, name) for d in drops) for name in ("steps", "evaluations")},
        tables=_tables(metrics, p, float(np.nanmax(off))),
    )


# --- tables and figure ------------------------------------------------------------------------------------------------


def _table(metrics: Mapping[str, Metric], names: Mapping[str, str], over: Sequence[float], unit: str, *words: str) -> Table:
    """Restitution delivered: one row a law, by the metrics' names, one column a restitution asked for or a speed."""
    rows = [[text, *(f"{metrics[f'{name}.{x:g}.delivered'].value:.4f}" for x in over)] for name, text in names.items()]
    first, *more = words
    return Table([first, *(f"{x:g}{unit}" for x in over)], rows, *more)


def _tables(metrics: Mapping[str, Metric], p: Parameters, off: float) -> list[Table]:
    """Of the laws that can be asked for a restitution, and of the one that cannot."""
    title = "Restitution delivered in drop tests, of a bar at rest struck at constant speed"
    impact = {f"Impact[{unit}]": f"c_max = {CONTACT_DAMPING:g} {unit}" for unit in DAMPING_UNITS}
    words = f"Restitution Impact delivers to {p.mass:.4g} kg", f"Drop tests and the exact relation agree within {off:.1e}."
    return [
        _table(metrics, {name: name for name in p.laws}, p.restitution, "", "law, asked for:", title),
        _table(metrics, impact, p.speeds, " m/s", "Impact, at a speed of:", *words),
    ]


def figure(result: StudyResult) -> Figure:
    """Delivered against asked for, lines exact and marks from drop tests; how far the two are apart."""
    p = result.of(Parameters)
    fig, (ax, off) = subplots(1, 2, height=95, width_ratios=(1.25, 1))
    e = np.linspace(0.05, 1, 200)
    for i, name in enumerate(p.laws):
        drops = [result.metrics[f"{name}.{asked:g}.delivered"] for asked in p.restitution]
        exact = [delivered(p.law(name, float(x)), p.mass, p.speed) for x in e]
        again, k = divmod(i, len(COLOURS))  # a colour comes again dashed and hollow
        mark, colour, fill = MARKS[i % len(MARKS)], COLOURS[k], "white" if again else COLOURS[k]
        ax.plot(e, exact, "--" if again else "-", color=colour, linewidth=0.7)
        ax.plot(p.restitution, [d.value for d in drops], mark, color=colour, mfc=fill, label=name, markersize=3.5)
        apart = [abs(d.value - (d.exact or 0.0)) for d in drops]
        off.semilogy(p.restitution, apart, mark, color=colour, mfc=fill, markersize=3.5)
    ax.plot([0, 1], [0, 1], "--", color="#999999", linewidth=0.8, zorder=0)
    ax.set(xlim=(0, 1), ylim=(0, 1), xlabel="restitution asked for", ylabel="restitution delivered")
    off.set(xlim=(0, 1), xlabel="restitution asked for", ylabel="drop test against exact")
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return fig
