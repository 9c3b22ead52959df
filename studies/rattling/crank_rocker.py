"""Crank-rocker with clearance in up to four joints, its rocker rigid or flexible: Figs 5 to 10 of a published paper.

`kit.published` has the paper's numbers. A run is one turn of the crank; the journals start centred. Both rockers are compared
with rigid bars in ideal joints. If the largest contact damping is in N.s/m (`damping_unit`), the joints rattle and the motion is
chaotic. In N.s/mm it is nearly repeatable. The numbers are means over `members` runs of successive seeds, with standard errors.
The figures show one run, as the paper does.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np

from buckler import mbs
from buckler.mbs.geometry import Array
from buckler.mbs.library import STEEL_CRANK_ROCKER
from buckler.mbs.modal import BarModes, CraigBampton
from buckler.mbs.sensitivity.curve import Curve

from ..kit.parameters import choices, integer, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, worst
from ..kit.statistics import mean
from ..kit.style import Figure, subplots
from .bars import BODIES, PlayParameters, section, set_damping

MOTIONS = ("coupler.vx", "rocker.vx", "coupler.ax", "rocker.ax")
"""Velocities and accelerations that are drawn."""
FORCES = {"coupler_rocker": "B", "rocker_frame": "C"}
"""Points of the joints whose forces are read and drawn, by the joints' names in metrics.json."""
NOTES = """\
ideal: rigid bars in ideal joints. Motions are of centres of mass, from `settle` on; rms_vx_error: rms difference from ideal.
± standard error of the mean over {members} members, seeds from {seed}. Peaks of single runs scatter by tens of per cent
where joints rattle (damping_unit N.s/m). With N.s/mm peaks are repeatable. They are as short as microseconds, so that a run gives
them some per cent too small, less with a smaller `tolerance`."""
"""Notes below the table."""
ROCKERS = {"rigid": "rigid", "beam": "flexible", "modal": "flexible"}
"""Bodies of the rocker, with the name of the variant that has them."""
LABELS = {"ideal": "ideal joints", "rigid": "rigid rocker", "flexible": "flexible rocker"}
COLOURS = {"ideal": "#000000", "rigid": "#D55E00", "flexible": "#0072B2"}
"""Labels and colours of curves by the name of their variant."""


@dataclass(frozen=True)
class Parameters(PlayParameters):
    """Parameters of the study; bars, joints, contact, drive and modes have theirs in `bars.PlayParameters`."""

    rocker: tuple[str, ...] = choices(("rigid", "beam"), tuple(ROCKERS), "rockers to run, at most one flexible", "bars")
    rocker_damping: float = quantity(0.01, "1", 0, 1, "damping ratio: first pinned mode (beam), all (modal)", "bars")
    clearance_joints: int = integer(4, 0, 4, "joints with clearance: B, C, A, O in this order", "joints")
    start_angle: float = quantity(0.5, "rad", -7, 7, "crank angle at the start", "drive")
    duration: float = quantity(0.2, "s", 1e-4, 1e3, "length of a run", "numerics")
    settle: float = quantity(0.02, "s", 0, 1e3, "time left out of the metrics: journals start centred", "numerics")
    seed: int = integer(0, 0, 2**31 - 1, "seed of the crank's offset at the start, normal, some 1e-9 rad", "numerics")
    elements: int = integer(4, 1, 64, "elements of the beam", "numerics")
    tolerance: float = quantity(5e-5, "1", 1e-9, 1e-1, "position error allowed a step, over a tenth of the clearance", "numerics")
    members: int = integer(4, 1, 10_000, "runs of each rocker with clearance; figures show the first", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a run may take", "numerics")

    def agree(self) -> None:
        """Check parameters against each other, and make the mechanisms that will run."""
        if len({ROCKERS[rocker] for rocker in self.rocker}) < len(self.rocker):
            raise ValueError(f"rocker = {','.join(self.rocker)}: name one flexible rocker at most")
        is_default = self.modal_damping == "constant" and self.modes_of == "free"
        if "modal" not in self.rocker and not is_default:
            modal = f"modal_damping = {self.modal_damping}, modes_of = {self.modes_of}"
            raise ValueError(f"{modal}: only a rocker of modes can have them; choose rocker = rigid,modal")
        if self.settle >= self.duration:
            raise ValueError(f"settle = {self.settle:g} s: must be less than duration = {self.duration:g} s")
        for rocker in self.rocker:
            self.mechanism(rocker, self.with_play)

    @property
    def with_play(self) -> str:
        """Points of the joints with clearance: first B and C, whose forces the paper shows."""
        return ("", "B", "BC", "ABC", "OABC")[self.clearance_joints]

    @property
    def first_angle(self) -> float:
        """Crank angle at the start [rad], with an offset by the seed that is far below all errors."""
        return self.start_angle + 1e-9 * float(np.random.default_rng(self.seed).standard_normal())

    def mechanism(self, rocker: str, with_play: str) -> mbs.Mechanism:
        """Make the crank-rocker with one of the `ROCKERS`, and with clearance in the joints `with_play`."""
        return self.bars(rocker=self.body(rocker), joints=with_play, angle=self.first_angle)

    def body(self, rocker: str) -> mbs.Rigid | mbs.Beam | mbs.Modal:
        """Make one of the `ROCKERS`; a modal one has modes of a mesh of solid elements, or those that `modes_of` names."""
        bar = section(self.in_plane_depth)
        if rocker == "rigid":
            return mbs.Rigid(bar)
        if rocker == "beam":
            return mbs.Beam(bar.damped(ratio=self.rocker_damping, length=STEEL_CRANK_ROCKER.rocker), elements=self.elements)
        # The default modes "free" are those of a mesh of solid elements, two in bending and one axial; the bar has as many.
        others: dict[str, Any] = {"Craig-Bampton": CraigBampton(), "Euler-Bernoulli": BarModes(bending=2, axial=1, shear=False)}
        modal = mbs.Modal(bar, damping=self.rocker_damping)
        modal = replace(modal, modes=others[self.modes_of]) if self.modes_of in others else modal
        return modal if self.modal_damping == "constant" else set_damping(modal, self.modal_damping, self.rocker_damping)


def run_variants(p: Parameters, progress: Progress) -> dict[str, mbs.Result]:
    """Run `ideal`, rigid bars in ideal joints, and with clearance `rigid` or `flexible` for each requested rocker."""
    cases = {"ideal": ("rigid", "")} | {ROCKERS[rocker]: (rocker, p.with_play) for rocker in p.rocker}
    return {name: simulate(p, *case) for name, case in progress(cases.items(), label="variants")}


def simulate(p: Parameters, rocker: str, with_play: str) -> mbs.Result:
    """Run one mechanism with its energy ledger: on the engine, or by loop closure where the joints are ideal."""
    time_of_half_a_degree = 2 * pi / p.speed / 720
    longest = min(time_of_half_a_degree, p.duration / 10)  # chosen: half a degree, and ten steps even in the shortest run
    solver = (mbs.Exudyn if with_play else mbs.Closure)(mbs.Controlled(p.tolerance, longest))
    return mbs.simulate(p.mechanism(rocker, with_play), p.duration, solver=solver, ledger=True, timeout=p.timeout)


def read(result: mbs.Result, ideal: mbs.Result, settle: float) -> dict[str, Metric]:
    """Compute the numbers of a run from `settle` [s] on, but balance energy from 0 on; nan without data."""
    signals, late = result.signals, result.time >= settle
    found = {}

    def curve(values: Array) -> Curve:
        """Return values over the time from `settle` on."""
        return Curve(result.time[late], values[late]) if late.sum() > 1 else Curve(np.zeros(2), np.full(2, np.nan))

    for name, joint in FORCES.items():
        size = np.hypot(*(read_force(result, joint, axis) for axis in "xy"))
        found[f"peak_force_{name}"] = Metric(curve(size).max(), "N")
    for link in ("coupler", "rocker"):
        difference = signals[f"{link}.vx"] - ideal.at(f"{link}.vx", result.time, outside=np.nan)
        found[f"peak_ax_{link}"] = Metric(curve(np.abs(signals[f"{link}.ax"])).max(), "m/s^2")
        found[f"rms_ax_{link}"] = Metric(curve(signals[f"{link}.ax"]).rms(), "m/s^2")
        found[f"rms_vx_error_{link}"] = Metric(curve(difference).rms(), "m/s")
    deepest = max((curve(signals[f"{joint}.penetration"]).max() for joint in loose_joints(result)), default=0.0)
    # the signals `contacts` count from the start of the run
    contacts = sum(float(np.ptp(curve(signals[f"{joint}.contacts"]).x)) for joint in loose_joints(result))
    found |= {"penetration": Metric(deepest, "m"), "contacts": Metric(contacts, "1")}
    return found | {"energy_balance": Metric(result.energy_balance, "1")}


def loose_joints(result: mbs.Result) -> list[str]:
    """List the joints with clearance."""
    return [joint for joint in BODIES if f"{joint}.penetration" in result.signals]


def read_force(result: mbs.Result, joint: str, axis: str) -> Array:
    """Return a component of the force on the second of a joint's `BODIES` [N]."""
    first, second = BODIES[joint]
    on_bush = result.signals.get(f"{joint}.{first}-{second}.f{axis}")  # a signal names pin and bush: it is the force on the bush
    return -result.signals[f"{joint}.{second}-{first}.f{axis}"] if on_bush is None else on_bush


def signal_prefix(joint: str) -> str:
    """Return the first part of the names of a joint's force components in signals.npz, as B.coupler-rocker."""
    return f"{joint}.{'-'.join(BODIES[joint])}"


def samples(name: str, result: mbs.Result) -> dict[str, Array]:
    """Return the arrays of the run of a variant for signals.npz, by name."""
    states = ("journal_x", "journal_y", "contact_state")
    names = [*MOTIONS, *(f"{joint}.{state}" for joint in loose_joints(result) for state in states)]
    signals = {"time": result.time} | {each: result.signals[each] for each in names}
    signals |= {f"{signal_prefix(j)}.f{axis}": read_force(result, j, axis) for j in FORCES.values() for axis in "xy"}
    return {f"{name}.{each}": values for each, values in signals.items()}


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run all variants with each seed, and compute means over the seeds."""
    runs = [run_variants(replace(p, seed=p.seed + k), QUIET if k else progress) for k in range(p.members)]
    found = [{name: read(result, each["ideal"], p.settle) for name, result in each.items()} for each in runs]
    metrics = {
        f"{variant}.{name}": mean(metric.unit, [each[variant][name].value for each in found])
        for variant, numbers in found[0].items()
        for name, metric in numbers.items()
    }
    first = runs[0]
    return StudyResult(
        parameters=p, **worst([each for run in runs for each in run.items()]),  # status and message of all runs
        metrics=metrics,
        signals={key: values for name, result in first.items() for key, values in samples(name, result).items()},
        work={f"{name}.{key}": result.work[key] for name, result in first.items() for key in ("wall_s", "steps")},
        tables=[_table(metrics, list(first), p)],
    )  # fmt: skip


def _table(metrics: Mapping[str, Metric], variants: list[str], p: Parameters) -> Table:
    """Tabulate the numbers, a column for each variant, and the ratio flexible over rigid."""
    rows: list[list[Any]] = []
    both = {"rigid", "flexible"} <= set(variants)
    for name in [name.partition(".")[2] for name in metrics if name.startswith("ideal.")]:
        values = [metrics[f"{variant}.{name}"] for variant in variants]
        rows.append([name, values[0].unit, *(metric.format() for metric in values)])
        if both:
            rows[-1].append(None if name == "energy_balance" else _ratio(metrics[f"flexible.{name}"], metrics[f"rigid.{name}"]))
    headers = ["", "unit", *variants, *(["flexible/rigid"] if both else [])]
    title = f"{p.clearance_joints} joints with {1e3 * p.clearance:g} mm clearance, c_max = {p.damping:g} {p.damping_unit}"
    return Table(headers, rows, title, f"{NOTES.format(members=p.members, seed=p.seed)}\n{p.describe()}.")


def _ratio(flexible: Metric, rigid: Metric) -> str | None:
    if not rigid.value:
        return None
    relative_error = float(np.hypot(flexible.error or 0.0, rigid.error or 0.0))  # errors of metrics are relative
    return Metric(flexible.value / rigid.value, "1", error=relative_error or None).format(".3g")


def figure(result: StudyResult) -> dict[str, Figure]:
    """Draw velocities (Figs 5, 6), accelerations (Figs 7, 8), contact forces (Figs 9, 10) and the journals' paths."""
    p = result.of(Parameters)
    links = ("coupler", "rocker")
    forces = {f"{signal_prefix(joint)}.fx": f"{name.replace('_', '–')}, $F_x$ [N]" for name, joint in FORCES.items()}
    figures = {
        "velocity": _histories(result, {f"{link}.vx": f"{link}, $v_x$ [m/s]" for link in links}),
        "acceleration": _histories(result, {f"{link}.ax": f"{link}, $a_x$ [m/s²]" for link in links}),
        "contact_force": _histories(result, forces),
    }
    return figures | ({"orbits": _orbits(result)} if p.with_play else {})


def _variants(result: StudyResult) -> list[str]:
    return [name for name in ("rigid", "flexible") if f"{name}.time" in result.signals]


def _histories(result: StudyResult, rows: Mapping[str, str]) -> Figure:
    """Draw signals over time: a row for each signal, a column for each rocker; the ideal mechanism is dashed."""
    s, variants = result.signals, _variants(result)
    fig, axes = subplots(len(rows), len(variants), height=105, sharex=True, sharey="row", squeeze=False)  # [mm]
    for line, (signal, name) in zip(axes, rows.items(), strict=True):
        for ax, variant in zip(line, variants, strict=True):
            for case, style in ((variant, "-"), ("ideal", "--")):
                time, values = 1e3 * s[f"{case}.time"], s[f"{case}.{signal}"]
                ax.plot(time, values, style, color=COLOURS[case], linewidth=0.7, label=LABELS[case], rasterized=True)
            ax.label_outer()
        line[0].set_ylabel(name)
    for ax in axes[0]:
        ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.2)
    for ax in axes[-1]:
        ax.set_xlabel("time [ms]")
    return fig


def _orbits(result: StudyResult) -> Figure:
    """Draw the paths of the pins' centres in their bushes, over the clearance; inside the unit circle there is no contact."""
    s, variants = result.signals, _variants(result)
    p = result.of(Parameters)
    joints = [joint for joint in BODIES if joint in p.with_play]
    shared = {"squeeze": False, "sharex": True, "sharey": True}
    fig, axes = subplots(len(variants), len(joints), height=18 + 38 * len(variants), **shared)  # [mm]
    turn = np.linspace(0, 2 * np.pi, 181)
    for line, variant in zip(axes, variants, strict=True):
        for ax, joint in zip(line, joints, strict=True):
            x, y = (s[f"{variant}.{joint}.journal_{axis}"] / p.clearance for axis in "xy")
            ax.plot(x, y, color=COLOURS[variant], linewidth=0.3, rasterized=True)
            ax.plot(np.cos(turn), np.sin(turn), color="#000000", linewidth=0.8)
            ax.set_aspect("equal")
            ax.label_outer()
        line[0].set_ylabel(f"{LABELS[variant]}\n$y/c$")
    for ax, joint in zip(axes[0], joints, strict=True):
        ax.set_title(f"{joint}: {'–'.join(BODIES[joint])}")
    for ax in axes[-1]:
        ax.set_xlabel("$x/c$")
    return fig
