"""First impacts of the striking slider-crank over speed, bow, stop stiffness and slider mass, in dimensionless numbers.

A strike is a run up to the end of the first impact. For each point of a grid the beam of `slider-crank` gives the largest
compression P of the strip and the largest force of the stop, over the Euler load P_E. An independent theory, `SineStrip`, is
compared with the beam. Two numbers decide the regime of a strike. The first is the strip's deflection at first contact over its
radius of gyration. The second, s, is the rate at which P/P_E rises with w1 t in a straight strip. Here t is the time and w1 the
strip's first frequency:

    s = K' v/(P_E w1 cos phi).

K' is the stiffness of stop and strip in series, v the slider's speed, phi the angle of the strip's chord to the slider's line. In
the regime "late buckling" a straight strip reaches a compression that grows as sqrt(s). In "plateau" the strip has time to buckle
and pushes with P_E. In "sagging" it is bowed and acts as a soft spring. In "swing" it has buckled before contact and swings, so
that the slider may never reach the stop.

In the theory the coupler AB from the crank's pin to the slider has bending stiffness E I, axial stiffness E A and mass per length
mu. It has no axial inertia; tau is the time constant of its damping. At a distance z from A its deflection from the chord AB is
the sum of a_n sin(n pi z/L); free of stress it has b_n instead of a_n. Bending shortens the chord. Equation (1) gives the
compression P, equation (2) the a_n, with k = n pi/L.

    P = (E A/L) (L - |AB| - sum of n^2 pi^2 (a_n^2 - b_n^2)/(4 L)).                                                   (1)

    mu a_n'' = -E I k^4 (a_n - b_n + tau a_n') + P k^2 a_n + q_n.                                                     (2)

The q_n are the sine components of weight and of the chord's transverse acceleration, which is linear from A to B. The slider of
mass m and friction f has the position x and obeys m x'' = -P cos(phi) + F - f sign(x'); before contact it moves to negative x.
The stop of stiffness K has the force F = K d (1 + chi d'/v) at the depth d, with the hysteresis factor chi of `CarvalhoMartins`.
This is the column of N. J. Hoff, The dynamics of the buckling of elastic columns, J. Applied Mechanics 18 (1951) 68-74, with more
modes.
"""

from dataclasses import dataclass, replace
from itertools import product
from math import isfinite, nan
from typing import Any, NamedTuple, Self

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs.geometry import Array
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.library import PAPER, PAPER_STOP

from ..kit.parameters import integer, quantities, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, metrics_table, status_of
from ..kit.statistics import exponent
from ..kit.style import COLOURS, Figure, subplots
from ..sweeping.sweep import sweep
from .impact import StrikeAssumptions
from .impact_models import BUCKLED_FROM
from .slider_crank import CONTACT
from .slider_crank import Parameters as Case

REGIMES = {"late buckling": "o", "plateau": "s", "sagging": "^", "swing": "x"}
"""Regimes, and their marks in the figure."""
N = np.arange(1, 11)
"""Numbers n of the modes."""
R = PAPER.crank
"""Length of the crank [m]."""
L = PAPER.coupler
"""Length of the coupler [m]."""
WAVE_NUMBERS = N * np.pi / L
"""Wave numbers k of the modes [1/m]."""


@dataclass(frozen=True)
class Parameters(StrikeAssumptions):
    """Parameters of the study."""

    speeds: tuple[float, ...] = quantities((0.3, 1.25, 4.0, 10.0), "rad/s", 0.1, 60, "speeds of the crank", "grid")
    bows: tuple[float, ...] = quantities((1e-4, 1e-3, 0.01, 0.03), "1", -0.05, 0.05, "bows of the strip over its length", "grid")
    stiffnesses: tuple[float, ...] = quantities((500, 7.2e3, 1e5), "N/m", 1e2, 1e8, "stiffnesses of the stop", "grid")
    masses: tuple[float, ...] = quantities((0.05, 0.5), "kg", 0.01, 10, "masses of the slider", "grid")
    thickness: float = quantity(3e-4, "m", 5e-5, 1e-3, "thickness of the strip", "strip")
    damping: float = quantity(0.05, "1", 0, 1, "damping ratio of the strip's first bending mode", "strip")
    friction: float = quantity(0.02, "1", 0, 0.9, "Coulomb friction of the slider over its weight", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")
    elements: int = integer(8, 2, 64, "elements of the beam", "numerics")
    workers: int = integer(0, 0, 256, "processes, 0: the cases run in this one", "numerics")

    def cases(self) -> list[Case]:
        """Make a case for each mass, stiffness, bow and speed, in this order of loops."""
        shared = self.share(Case) | {"models": ("beam",), "until": np.radians(190.0)}  # the first impact is over by then
        return [
            Case(mass=mass, stop_stiffness=stiffness, imperfection=bow, speed=speed, **shared)
            for mass, stiffness, bow, speed in product(self.masses, self.stiffnesses, self.bows, self.speeds)
        ]


class SineStrip:
    """Slider-crank of a case by equations (1) and (2); the state y is x [m], x', the amplitudes a_n [m], and their rates."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.frequency = case.section.first_frequency(L)  # w1 [rad/s]
        # Stress-free amplitudes b_n [m], positive to the left when looking from A to B; a positive bow is to the right.
        self.stress_free: Array = np.where(N == 1, -case.imperfection * L, 0.0)
        self.bending: Array = case.section.bending_stiffness * WAVE_NUMBERS**4  # stiffness E I k^4 of the modes [N/m^2]
        self.impact_speed = -float(PAPER.slider_rate(CONTACT)) * case.speed  # v [m/s], at the crank angle of first contact

    @property
    def duration(self) -> float:
        """Time after first contact by which the impact is over [s].

        A period on the stop and the strip's time to buckle, at most 25 degrees of crank angle; 12 to 50 give the same peaks.
        """
        # With t from P = P_E, where P rises at the rate s, equation (2) of the first mode is a'' = s w1^3 t a. This Airy equation
        # lets a grow 1e4-fold until w1 t = 6/s^(1/3). Half a vibration, w1 t = 3, is added, by convention.
        p = self.case
        # s with the stiffness of the stop alone, and cos phi = 1
        rigid_rate = p.stop_stiffness * self.impact_speed / (p.section.euler_load(L) * self.frequency)
        on_stop, buckling = 2 * np.pi * np.sqrt(p.mass / p.stop_stiffness), 3 + 6 / np.cbrt(rigid_rate)
        return float(min(np.radians(25.0) / p.speed, on_stop + buckling / self.frequency))

    def peak(self) -> float:
        """Integrate from shortly before the first contact to the end of the impact; return the largest force of the stop [N]."""
        before = np.radians(3.0)  # crank angle; 1 to 10 degrees give peaks equal within 1e-3
        begin, longest = (CONTACT - before) / self.case.speed, before / self.case.speed + self.duration

        def distance(t: float, y: Array) -> float:
            """Return the distance of the slider from the face [m], negative in contact."""
            return float(y[0] - PAPER_STOP)

        distance.terminal, distance.direction = True, 1.0  # type: ignore[attr-defined]  # the impact ends where it becomes positive
        run = solve_ivp(
            self._rates, (begin, begin + longest), self._start(CONTACT - before), method="LSODA", rtol=1e-5, atol=1e-9,
            events=distance, max_step=longest / 300,  # short, because the peak is read off the steps
        )  # fmt: skip
        largest = max(self._stop_force(y) for y in run.y.T)
        return largest if largest > 0 else np.nan

    def balance(self, angle: float) -> tuple[Array, float]:
        """Compute amplitudes a_n in equilibrium [m] and compression [N], for a slider that moves as on a rigid coupler."""
        p, cosine = self.case, float(np.sqrt(1 - (R / L * np.sin(angle)) ** 2))
        acceleration = float(PAPER.slider_second_rate(angle)) * p.speed**2
        load = (p.friction_force - p.mass * acceleration) / cosine  # friction is positive, as x' < 0
        q = self._transverse(angle, R * np.cos(angle) - cosine * L, acceleration)
        # Near and above the Euler load no stable equilibrium is near. A least stiffness then bounds the amplitudes; it is a tenth
        # of the unloaded one of the first mode, by convention.
        stiffness = np.maximum(self.bending - load * WAVE_NUMBERS**2, 0.1 * self.bending[0])
        return (self.bending * self.stress_free + q) / stiffness, load

    def _start(self, angle: float) -> Array:
        """Return the initial state: the slider moves as on a rigid coupler, the modes are in equilibrium."""
        a, load = self.balance(angle)
        short = load * L / self.case.section.axial_stiffness + self._shortening(a)
        x = R * np.cos(angle) - np.sqrt((L - short) ** 2 - (R * np.sin(angle)) ** 2)
        return np.concatenate([[x, float(PAPER.slider_rate(angle)) * self.case.speed], a, np.zeros(N.size)])

    def _shortening(self, a: Array) -> float:
        """Compute the shortening of the chord by bending [m], the sum in equation (1)."""
        return float((N**2 * np.pi**2 * (a**2 - self.stress_free**2)).sum() / (4 * L))

    def _transverse(self, angle: float, x: float, acceleration: float) -> Array:
        """Compute q_n [N/m], weight less inertia of the chord, from the slider's position [m] and acceleration [m/s^2]."""
        pin = R * np.array([np.cos(angle), np.sin(angle)])
        chord = np.array([x, 0.0]) - pin
        normal = np.array([-chord[1], chord[0]]) / np.hypot(*chord)
        gravity = normal @ self.case.gravity_vector  # normal to the chord [m/s^2]
        # Transverse acceleration less gravity is linear between its values at A and B, with the sine components `components`.
        at_a, at_b = -(self.case.speed**2) * (normal @ pin) - gravity, normal[0] * acceleration - gravity
        components = 2 / (N * np.pi) * (at_a - (-1.0) ** N * at_b)
        return np.asarray(-self.case.section.mass_per_length * components)

    def _stop_force(self, y: Array) -> float:
        depth, depth_rate = PAPER_STOP - y[0], -y[1]
        chi = float(CarvalhoMartins.hysteresis(self.case.restitution))
        force = self.case.stop_stiffness * depth * (1 + chi * depth_rate / self.impact_speed)
        return max(0.0, float(force)) if depth > 0 else 0.0

    def _rates(self, t: float, y: Array) -> Array:
        """Compute the rates of the state by equations (1) and (2) and that of the slider."""
        angle, (a, speed) = self.case.speed * t, np.split(y[2:], 2)
        dx, dy = y[0] - R * np.cos(angle), R * np.sin(angle)
        chord = float(np.hypot(dx, dy))
        load = self.case.section.axial_stiffness / L * (L - chord - self._shortening(a))
        cosine = -dx / chord  # of phi
        # Friction is proportional to speeds below 1 mm/s. With 1 cm/s the largest forces of the default grid change by 8 % at
        # most, and nine of ten strikes not at all.
        friction = self.case.friction_force * min(max(y[1] / 1e-3, -1.0), 1.0)
        acceleration = (self._stop_force(y) - load * cosine - friction) / self.case.mass
        time_constant = 2 * self.case.damping / self.frequency  # tau of equation (2)
        bend = self.bending * (a - self.stress_free + time_constant * speed)
        q = self._transverse(angle, y[0], acceleration)
        modal_acceleration = (load * WAVE_NUMBERS**2 * a - bend + q) / self.case.section.mass_per_length
        return np.concatenate([[y[1], acceleration], speed, modal_acceleration])


class MapPoint(NamedTuple):
    """Strike of a case, simulated and by sine modes; forces are largest ones over the Euler load."""

    case: Case
    peak: float  # simulated force of the stop
    compression: float  # simulated compression of the strip
    early: float  # simulated change of the end shortening before contact, over the length
    sine: float  # force of the stop by sine modes
    rate: float  # s
    bend: float  # by the theory's first mode: deflection at first contact over the radius of gyration
    failure: str  # case and status of a simulation that failed, "" if it did not

    @property
    def regime(self) -> str:
        """Regime by the simulation; "swing" also for a run that has no impact or has failed."""
        # By equation (1), a_1 = 2 b_1 shortens the chord by 3 pi^2 b_1^2/(4 L): a bow may double without counting as buckled.
        bow_doubles = 0.75 * (np.pi * self.case.imperfection) ** 2
        is_buckled = self.early > BUCKLED_FROM + bow_doubles  # shortenings over the length
        if is_buckled or not isfinite(self.peak + self.compression):
            return "swing"
        # both limits, over the Euler load, are a convention
        return "late buckling" if self.compression > 1.5 else "plateau" if self.compression > 0.95 else "sagging"

    @classmethod
    def of(cls, case: Case, row: Any) -> Self:
        """Read the simulation from a row of the sweep, by names of `impact.TurnReading`, and compute the theory."""
        strip, euler = SineStrip(case), case.section.euler_load(L)
        peak, compression, early = (row.value(f"beam.{name}") for name in ("impact_peak", "impact_push", "early_shortening"))
        failure = "" if row.status in ("OK", "SUSPECT") else f"{case.speed:g} rad/s, bow {case.imperfection:g}: {row.status}"
        cosine = float(PAPER.lean_cosine(CONTACT, PAPER_STOP))  # of phi at first contact
        stiffness = 1 / (1 / case.stop_stiffness + cosine**2 * L / case.section.axial_stiffness)
        rate = stiffness * strip.impact_speed / (euler * strip.frequency * cosine)
        amplitudes, _ = strip.balance(CONTACT)
        bend = abs(amplitudes[0]) * np.sqrt(12) / case.thickness  # over h/sqrt(12), the radius of gyration
        peak = peak or nan  # 0 without a contact
        return cls(case, peak / euler, compression / euler, early, strip.peak() / euler, rate, float(bend), failure)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Compute every strike of the grid by simulation and by sine modes."""
    cases = p.cases()
    rows = sweep("slider-crank", cases, workers=p.workers, progress=progress)
    points = [MapPoint.of(case, row) for case, row in zip(cases, progress(rows, label="theory"), strict=True)]
    metrics = _metrics(points)
    wrong = [point.failure for point in points if point.failure]
    if not abs(metrics["sine.median"].value - 1) <= 0.05:  # chosen; true for nan: every strip swings
        wrong.append(f"SINE: median peak {metrics['sine.median'].value:.3g} of the simulation's")
    columns = {name: np.array([getattr(x, name) for x in points]) for name in ("rate", "bend", "peak", "compression", "sine")}
    return StudyResult(
        parameters=p, **status_of(wrong), metrics=metrics,
        signals=columns | {"regime": np.array([list(REGIMES).index(x.regime) for x in points])},
        tables=[replace(metrics_table(metrics), notes=f"sine: peaks over those of the simulation.\n{p.describe()}.")],
    )  # fmt: skip


def _metrics(points: list[MapPoint]) -> dict[str, Metric]:
    """Compare the peaks of strips that are not buckled at first contact, count the regimes, fit the power of late buckling."""
    unbuckled = [x for x in points if x.regime != "swing"]
    ratio = np.array([x.sine / x.peak for x in unbuckled] or [nan])
    found = {
        "sine.median": Metric(float(np.median(ratio)), "1"),
        "sine.within_20": Metric(float(np.mean(np.abs(ratio - 1) < 0.2)), "1"),
    }
    for name in REGIMES:
        found[f"regime.{name.replace(' ', '_')}"] = Metric(float(sum(x.regime == name for x in points)), "1")
    late = [x for x in points if x.regime == "late buckling" and x.bend < 5]  # nearly straight at contact, by convention
    if len({x.rate for x in late}) > 1:  # by several speeds, or several stiffnesses of the stop
        slope = exponent([x.rate for x in late], [x.compression for x in late])
        found["late.power_of_rate"] = Metric(slope, "1", exact=0.5)
    return found


def figure(result: StudyResult) -> Figure:
    """Draw the compression over the rate with a line of slope 1/2, and the peaks of sine modes over the simulated peaks."""
    fig, (over, parity) = subplots(2, 1, height=170)
    s = result.signals
    for k, (name, mark) in enumerate(REGIMES.items()):
        part, style = s["regime"] == k, {"color": COLOURS[k], "markersize": 4, "linestyle": "", "marker": mark, "label": name}
        over.loglog(s["rate"][part], s["compression"][part], **style)
        parity.loglog(s["peak"][part], s["sine"][part], **style)
    x, ends = np.sort(s["rate"]), (np.nanmin(s["peak"]), np.nanmax(s["peak"]))
    over.loglog(x, 8 * np.sqrt(x), "k--", linewidth=0.8, label="slope 1/2")  # 8 is no theory: it only places the line
    parity.loglog(ends, ends, "k-", linewidth=0.8)
    over.set(xlabel="rate $s$ of compression [1]", ylabel="compression / Euler load [1]")
    parity.set(xlabel="simulated peak / Euler load [1]", ylabel="peak by sine modes [1]")
    for ax in (over, parity):
        ax.legend(fontsize=7)
    return fig
