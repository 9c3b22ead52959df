"""Pinned strip whose ends approach at constant speed: the peak of its force over speed and bow, compared with one-mode theory.

A slow compression reaches Euler's load. In a fast one the strip is still straight, and its force reaches many times that load.
The beam on the engine has all bending modes and axial vibration; in theory the first mode alone obeys an ordinary differential
equation (Hoff's problem). The strip has critical load P_E, first frequency w1, radius of gyration r and length L; its stress-free
shape is the bow a0 sin(pi x/L). Let a be the amplitude of the deflection, bow included, v the speed of approach of the ends, tau
= w1 t, P the compression and p = P/P_E. The first mode obeys equation (1), in which the rate s is dp/dtau of a straight strip:

    a'' = (p - 1) a + a0,        p = s tau - (a^2 - a0^2)/(4 r^2),        s = v/(L w1 (pi r/L)^2).                           (1)

The force has its peak where (a^2)' = 4 r^2 s.

Sources: N. J. Hoff, The dynamics of the buckling of elastic columns, J. Applied Mechanics 18 (1951) 68-74.
V. A. Kuzkin, M. M. Dannert, The maximum force in a column under constant speed compression, arXiv:1511.01358; V. A. Kuzkin,
Structural model for the dynamic buckling of a column under constant rate compression, arXiv:1506.00427.
"""

from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs import Beam, Controlled, Drive, Exudyn, Guide, Link, Mechanism, Result, Revolute, Section, simulate
from buckler.mbs.geometry import Array

from ..kit.parameters import StudyParameters, integer, quantities, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, metrics_table, status_of
from ..kit.style import COLOURS, Figure, subplots


class Peak(NamedTuple):
    """First maximum of the force: time tau, and force over the critical load p."""

    time: float
    force: float


@dataclass(frozen=True)
class Hoff:
    """First mode of the strip by equation (1), for a rate s and a bow a0/r, both positive; its state is (a/r, a'/r)."""

    rate: float
    bow: float

    def peak(self) -> Peak:
        """Integrate (1) to the first maximum of the force."""

        def force_rate(tau: float, y: Array) -> float:
            """Return dp/dtau, which is 0 at the maximum of the force."""
            return float(self.rate - y[0] * y[1] / 2)

        def rates(tau: float, y: Array) -> tuple[float, float]:
            """Compute the rates of the state by equation (1)."""
            return y[1], (self.force(tau, y[0]) - 1.0) * y[0] + self.bow

        force_rate.terminal, force_rate.direction = True, -1.0  # type: ignore[attr-defined]
        # Twice the time 1/s to p = 1, 40 times the time s^(-1/3) of the growth a'' = s tau a after it, and some periods.
        until = 2 / self.rate + 40 * self.rate ** (-1 / 3) + 20
        run = solve_ivp(rates, (0.0, until), (self.bow, 0.0), method="DOP853", events=force_rate, rtol=1e-10, atol=1e-12)
        if not len(run.t_events[0]):
            raise ValueError(f"rate = {self.rate:g}, bow = {self.bow:g}: the force does not peak before tau = {until:g}")
        tau, a = float(run.t_events[0][0]), float(run.y_events[0][0][0])
        return Peak(tau, self.force(tau, a))

    def force(self, tau: float, a: float) -> float:
        """Compute the force p at a time tau and an amplitude a/r, by equation (1)."""
        return float(self.rate * tau - (a**2 - self.bow**2) / 4)


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    length: float = quantity(0.310, "m", 0.01, 10, "length of the strip", "strip")
    width: float = quantity(0.030, "m", 1e-4, 1, "width of the strip", "strip")
    thickness: float = quantity(3e-3, "m", 1e-4, 0.1, "thickness of the strip", "strip")
    bows: tuple[float, ...] = quantities((1e-3, 1e-2, 1e-1), "1", 1e-6, 10, "bows over the radius of gyration, a0/r", "strip")
    rates: tuple[float, ...] = quantities((0.01, 0.1, 0.3, 1.0), "1", 1e-3, 10, "speeds, as rates s of the force", "drive")
    elements: int = integer(16, 2, 200, "beam elements", "numerics")
    tolerance: float = quantity(3e-7, "1", 1e-9, 1e-4, "position error allowed a step, over the length", "numerics")

    @property
    def section(self) -> Section:
        """Section of the strip."""
        return Section(self.width, self.thickness)

    @property
    def gyration(self) -> float:
        """Radius of gyration [m]."""
        return self.thickness / sqrt(12)

    @property
    def frequency(self) -> float:
        """First bending frequency [rad/s]."""
        return self.section.first_frequency(self.length)

    def speed(self, rate: float) -> float:
        """Compute the speed of approach [m/s] that belongs to a rate s."""
        return rate * self.length * self.frequency * (pi * self.gyration / self.length) ** 2


def peak(result: Result, p: Parameters) -> float:
    """Find the first maximum of the compression over the critical load after which the compression falls."""
    force = -result.signals["strip.axial_force"] / p.section.euler_load(p.length)
    largest = np.maximum.accumulate(force)
    # by 5 % of the maximum, or of half the critical load if that is more: smaller falls are axial vibration
    has_fallen = largest - force > 0.05 * np.maximum(largest, 0.5)
    return float(largest[int(np.argmax(has_fallen)) if has_fallen.any() else -1])


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run the strip for every rate and bow beyond the peak of the first mode at tau = t, up to 1.1 t + 2, which is chosen."""
    solver = Exudyn(Controlled(tolerance=p.tolerance))
    metrics: dict[str, Metric] = {}
    wrong: list[str] = []
    signals: dict[str, np.ndarray] = {}
    for rate, bow in progress([(rate, bow) for rate in p.rates for bow in p.bows], label="speeds and bows"):
        first_mode = Hoff(rate, bow).peak()
        strip = Link("strip", "A", "B", Beam(p.section, elements=p.elements, imperfection=bow * p.gyration))
        joints, guides, drives = [Revolute("A", "ground", "strip")], [Guide("B", "strip")], [Drive("B", -p.speed(rate))]
        mechanism = Mechanism({"A": (0.0, 0.0), "B": (p.length, 0.0)}, [strip], joints, guides, drives=drives)
        result = simulate(mechanism, (1.1 * first_mode.time + 2.0) / p.frequency, solver=solver)
        found = peak(result, p)
        name = f"s{rate:g}.bow{bow:g}"
        metrics[f"{name}.peak"] = Metric(found, "1", exact=first_mode.force)
        signals |= {f"{name}.time": result.time, f"{name}.force": -result.signals["strip.axial_force"]}
        if not result.ok:
            wrong.append(f"{name}: {result.message}")
        elif rate <= 1 and abs(found / first_mode.force - 1) > 0.03:  # by convention; at s > 1 higher modes grow fastest
            wrong.append(f"{name}: the beam peaks {100 * (found / first_mode.force - 1):+.2g} % off the first mode")
    table = replace(metrics_table(metrics), notes="Peaks over the critical load; exact: first mode.")
    return StudyResult(parameters=p, metrics=metrics, signals=signals, tables=[table], **status_of(wrong))


def figure(result: StudyResult) -> Figure:
    """Draw the peak over the rate, of the beam as points and of the first mode as lines."""
    p = result.of(Parameters)
    fig, ax = subplots(height=90)
    rates = np.geomspace(min(p.rates) / 2, 2 * max(p.rates), 40)
    for k, bow in enumerate(p.bows):
        colour = COLOURS[k % len(COLOURS)]
        ax.loglog(rates, [Hoff(s, bow).peak().force for s in rates], color=colour, label=f"bow {bow:g} radii of gyration")
        found = [result.metrics[f"s{s:g}.bow{bow:g}.peak"].value for s in p.rates]
        ax.plot(p.rates, found, "o", color=colour)
    ax.axhline(1.0, color="black", lw=0.8)
    ax.set(xlabel="rate $s$ of compression [1]", ylabel="peak force over Euler's load [1]")
    ax.plot([], [], "ko", label="beam")
    ax.plot([], [], "k-", label="first mode")
    ax.legend()
    return fig
