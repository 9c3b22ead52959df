"""Force of the buckled strip on the stop in equilibrium: Table 2 for three thicknesses, and the force over crank angle.

Four models of the same strip: the published quartic, the closed form (exact), the rod with the strip's axial and shear
stiffness, and geometrically exact beam elements in static equilibrium. Two stops: the one the paper describes, met at a
crank angle of 120 degrees, and the one its Table 2 was computed with. The second follows from one printed number, that
of the 0.3 mm strip, and predicts the other two.

Dry friction of the slider leaves the force open by its limit, either way: the interval, and where friction laws end in it,
stand in a table of their own. Source: B. Demirel et al., doi 10.1115/IMECE2008-68796.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from buckler.elastica import law, pinned
from buckler.elastica.rod import Rod
from buckler.mbs import Beam, Section
from buckler.mbs.geometry import Array
from buckler.mbs.library import PAPER
from buckler.mbs.record.errors import Status

from ..kit.parameters import StudyParameters, integer, quantities, quantity
from ..kit.published import CONTACT_FORCES, GRAVITY, STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import Axes, Figure, subplots
from .friction_interval import Pressed, friction_interval, laws

KNOWN = 3e-4
"""Thickness, m, whose printed force places the stop of Table 2."""
MODELS = ("quartic", "exact", "rod", "beam")
PRESSED_FROM = np.radians(150.0)
"""Crank angle, rad, from which the slider is followed with friction."""
MEMORIES = {-1.0: "helped", 0.0: "fresh", 1.0: "held_off"}
"""Share of the friction that acts at first, positive against the strip, and what it is called."""
STRAIGHTEST = 1e-4
"""End shortening from which rod and beam are asked: below it the strip may not have buckled yet."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    thicknesses: tuple[float, ...] = quantities((1e-4, 3e-4, 5e-4), "m", 5e-5, 5e-3, "thicknesses of the strip", "strip")
    yield_strength: float = quantity(1e9, "Pa", 1e6, 1e10, "stress at which the strip yields; spring steel", "strip")
    stop_angle: float = quantity(2 * np.pi / 3, "rad", 1.6, 3.0, "crank angle at which the slider meets the stop", "stop")
    mass: float = quantity(0.3, "kg", 1e-3, 10, "mass of the slider", "friction")
    friction: float = quantity(0.1, "1", 0.001, 0.9, "Coulomb coefficient of the slider by its weight", "friction")
    static_friction: float = quantity(0.15, "1", 0.001, 0.9, "the same of a slider at rest", "friction")
    elements: int = integer(20, 2, 200, "beam elements, three nodes each", "numerics")
    angles: int = integer(31, 2, 1000, "crank angles from the stop to dead centre", "numerics")

    def check(self) -> None:
        """Static friction is no less than dynamic."""
        if self.static_friction < self.friction:
            raise ValueError(f"static_friction = {self.static_friction:g}: must be at least friction = {self.friction:g}")


@dataclass(frozen=True)
class Press:
    """One strip pressed against one stop, its slider held at x = `stop`."""

    thickness: float
    stop: float

    @property
    def section(self) -> Section:
        """Of the strip."""
        return Section(STRIP_WIDTH, self.thickness)

    @property
    def unit(self) -> float:
        """E I/L^2, N."""
        return self.section.bending_stiffness / PAPER.coupler**2

    @property
    def shortening(self) -> float:
        """Largest end shortening over length: at dead centre."""
        return float(PAPER.shortening(np.pi, self.stop))

    @property
    def stress(self) -> float:
        """Largest bending stress, Pa."""
        strip = self.section
        return float(pinned.surface_stress(self.shortening, strip.thickness, PAPER.coupler, strip.material.modulus))

    def force(self, load: Callable[[Array], Array], angle: ArrayLike) -> Array:
        """F = p(u) E I/L^2 cos(phi) at crank angles, rad, for a load p(u) of an array (eqs 7-13), N."""
        return np.asarray(PAPER.push(load, self.section.bending_stiffness, np.atleast_1d(angle), self.stop))


def table_2_stop() -> float:
    """Place of the stop, m, at which the exact elastica gives the printed force of the `KNOWN` strip at dead centre."""
    load = CONTACT_FORCES[KNOWN] / Press(KNOWN, -PAPER.coupler).unit
    return -(PAPER.crank + PAPER.coupler * (1 - pinned.shortening(load)))


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Every model of every strip, at both stops."""
    described = f"e{np.degrees(p.stop_angle):g}"
    stops = {described: float(PAPER.slider(p.stop_angle)), "eTable2": table_2_stop()}
    angle = np.linspace(p.stop_angle, np.pi, p.angles)
    failures: set[str] = set()
    models = {h: _models(h, p.elements, failures) for h in progress(p.thicknesses, label="thicknesses")}
    presses = {(h, stop): Press(h, place) for h in p.thicknesses for stop, place in stops.items()}
    largest = {
        (h, stop): {name: float(press.force(load, np.pi)[0]) for name, load in models[h].items()}
        for (h, stop), press in presses.items()
    }
    curves = {h: {name: presses[h, described].force(load, angle) for name, load in own.items()} for h, own in models.items()}
    settled = {h: _settled(h, p) for h in p.thicknesses}
    yielding = _yielding(presses, p.yield_strength)
    signals = {f"F_h{_mm(h)}.{name}": force for h, curve in curves.items() for name, force in curve.items()}
    return StudyResult(
        parameters=p,
        metrics=_metrics(largest, presses, stops["eTable2"]) | {k: m for each in settled.values() for k, m in each.items()},
        signals={"angle": angle, **signals},
        tables=[
            _largest_table(largest, presses, yielding), _angle_table(curves, stops[described]), _friction_table(settled, p)
        ],
        **judged(sorted(failures), yielding),
    )  # fmt: skip


def _mm(thickness: float) -> str:
    return f"{1e3 * thickness:.6g}"


def _models(thickness: float, elements: int, failures: set[str]) -> Mapping[str, Callable[[Array], Array]]:
    """Load p(u) of each model; rod and beam give nan below `STRAIGHTEST`, failures of the beam are collected."""
    from buckler.mbs.engine.pressed import pinned_strip  # loads the engine

    section, length = Section(STRIP_WIDTH, thickness), PAPER.coupler
    unit = section.bending_stiffness / length**2
    strip = Rod(section.axial_stiffness / unit, section.shear_stiffness / unit)

    def beam(u: Array) -> Array:
        states = pinned_strip(Beam(section, elements), length, u)
        if states.status is not Status.OK:
            failures.add(f"h = {_mm(thickness)} mm: {states.status}: {states.message}")
        return states.load

    def buckled(load: Callable[[Array], Array], u: Array) -> Array:
        p, bent = np.full(u.shape, np.nan), u >= STRAIGHTEST
        if bent.any():
            p[bent] = load(u[bent])
        return p

    rod = np.vectorize(lambda u: strip.at_shortening(u).load)
    return {"quartic": law.quartic, "exact": pinned.load, "rod": partial(buckled, rod), "beam": partial(buckled, beam)}


def _yielding(presses: Mapping[tuple[float, str], Press], strength: float) -> str:
    """Say which strips would yield, if any: from there on no model here holds."""
    found = [
        f"h = {_mm(h)} mm at {stop} ({press.stress / 1e6:.0f} MPa)"
        for (h, stop), press in presses.items()
        if press.stress > strength
    ]
    return f"YIELDS beyond {strength / 1e6:g} MPa, so its force is overestimated: {', '.join(found)}" if found else ""


def _metrics(
    largest: Mapping[tuple[float, str], Mapping[str, float]], presses: Mapping[tuple[float, str], Press], stop: float
) -> dict[str, Metric]:
    """`F_h<mm>_<stop>`: the beam's largest force against the closed form and Table 2; ratios, stresses, the stop."""
    found = {
        f"F_h{_mm(h)}_{name}": Metric(forces["beam"], "N", CONTACT_FORCES.get(h), forces["exact"])
        for (h, name), forces in largest.items()
    }
    name, (first, *others) = next(iter(largest))[1], sorted({h for h, _ in largest})
    for h in others:
        published = CONTACT_FORCES[h] / CONTACT_FORCES[first] if {h, first} <= CONTACT_FORCES.keys() else None
        ratio = largest[h, name]["beam"] / largest[first, name]["beam"]
        found[f"ratio_h{_mm(h)}_h{_mm(first)}"] = Metric(ratio, "1", published, (h / first) ** 3)
    found["stop_eTable2"] = Metric(-stop, "m")
    found["angle_eTable2"] = Metric(float(np.degrees(PAPER.contact_angle(stop))), "deg")
    return found | {f"stress_h{_mm(h)}_{name}": Metric(press.stress, "Pa") for (h, name), press in presses.items()}


def _settled(thickness: float, p: Parameters) -> dict[str, Metric]:
    """Interval of the force at dead centre under dry friction, and where laws end in it, by what the slider remembers."""
    weight = p.mass * GRAVITY
    slider = Pressed(Section(STRIP_WIDTH, thickness).bending_stiffness, mass=p.mass, weight=weight)
    exact = float(slider.push(np.pi))
    low, high = friction_interval(exact, p.static_friction * weight)
    name = f"friction_h{_mm(thickness)}"
    found = {f"{name}.low": Metric(float(low), "N"), f"{name}.high": Metric(float(high), "N")}
    for kind, made in laws(p.static_friction, p.friction).items():
        for held, memory in MEMORIES.items():
            force = slider.settled(made, PRESSED_FROM, np.pi, held)
            found[f"{name}.{kind}.{memory}"] = Metric(force, "N", exact=exact)
    return found


def _largest_table(largest: Mapping[Any, Mapping[str, float]], presses: Mapping[Any, Press], yielding: str) -> Table:
    rows = []
    for (h, stop), forces in largest.items():
        press, printed = presses[h, stop], CONTACT_FORCES.get(h)
        off = f"{100 * (printed / forces['exact'] - 1):+.2f}" if printed else None
        row = [1e3 * h, f"{1e3 * press.stop:.1f}", f"{np.degrees(PAPER.contact_angle(press.stop)):.2f}", printed, off]
        rows.append(row + [f"{forces[name]:.5f}" for name in MODELS] + [f"{press.stress / 1e6:.0f}"])
    headers = ["h [mm]", "stop [mm]", "met at [deg]", "Table 2 [N]", "off exact [%]"]
    headers += [*(f"{name} [N]" for name in MODELS), "stress [MPa]"]
    notes = f"The second stop is placed so that the exact force of the {_mm(KNOWN)} mm strip is the printed one."
    return Table(headers, rows, "Largest contact force (crank at 180 deg)", "\n".join(filter(None, (notes, yielding))))


def _angle_table(curves: Mapping[float, Mapping[str, Array]], stop: float) -> Table:
    """Force over crank angle at the first stop: closed form of every strip, and how far the others are off at most."""
    angles = np.linspace(PAPER.contact_angle(stop), np.pi, 7)
    forces = [Press(h, stop).force(pinned.load, angles) for h in curves]
    rows: list[list[Any]] = [
        [f"{np.degrees(angle):.4g}", *(f"{force[k]:.4f}" for force in forces)] for k, angle in enumerate(angles)
    ]
    for name in ("quartic", "rod", "beam"):
        off = [np.nanmax(np.abs(curve[name] / curve["exact"] - 1)) for curve in curves.values()]
        rows.append([f"{name} off by", *(f"{value:.1e}" for value in off)])
    headers = ["crank angle [deg]", *(f"h = {_mm(h)} mm: F [N]" for h in curves)]
    return Table(headers, rows, "Contact force by the closed form, first stop", "off by: largest relative difference.")


def _friction_table(settled: Mapping[float, Mapping[str, Metric]], p: Parameters) -> Table:
    """One row a strip and law: the interval of true friction, and the force by what the slider remembers."""
    rows = []
    for h, found in settled.items():
        name = f"friction_h{_mm(h)}"
        low, high = (found[f"{name}.{end}"].value for end in ("low", "high"))
        for kind in laws(p.static_friction, p.friction):
            forces = [found[f"{name}.{kind}.{memory}"] for memory in MEMORIES.values()]
            row = [_mm(h), f"{forces[0].exact:.4f}", f"{low:.4f} to {high:.4f}", kind.replace("_", " ")]
            rows.append([*row, *(f"{force.value:.4f}" for force in forces)])
    heads = ["h [mm]", "without friction [N]", "true friction allows [N]", "law"]
    heads += [f"{memory.replace('_', ' ')} [N]" for memory in MEMORIES.values()]
    notes = (
        f"The interval is the answer: a slider of {p.mass:g} kg at rest, coefficients {p.static_friction:g} and {p.friction:g}"
        f" of its weight, holds any of these forces, by what went before.\nLaws: pressed from {np.degrees(PRESSED_FROM):g} deg "
        "on at 1.25 rad/s against a stop of 72 kN/m, friction at first helping the strip, absent, or holding the slider off."
    )
    return Table(heads, rows, "Force on the stop at 180 deg with dry friction, first stop", notes)


def figure(result: StudyResult) -> Figure:
    """Force over crank angle, largest force over thickness; in units of E I/L^2: one curve, one level for all."""
    parameters = result.of(Parameters)
    signals = result.signals
    fig, (left, right) = subplots(1, 2, height=85)
    thickest = parameters.thicknesses[-1]
    unit, angle = Press(thickest, 0.0).unit, np.degrees(signals["angle"])
    second = Press(thickest, table_2_stop())
    turn = np.linspace(PAPER.contact_angle(second.stop), np.pi, 200)
    left.plot(np.degrees(turn), second.force(pinned.load, turn) / unit, "C4--", label="exact, stop of Table 2")
    for name, style in (("exact", "C0-"), ("quartic", "C1:"), ("beam", "C2.")):
        left.plot(angle, signals[f"F_h{_mm(thickest)}.{name}"] / unit, style, label=name)
    left.set(xlabel="crank angle [deg]", ylabel="contact force $F L^2/(E I)$")
    left.legend(loc="lower right")
    _thickness_axes(right, result)
    return fig


def _thickness_axes(ax: Axes, result: StudyResult) -> None:
    """Forces at dead centre over h^3: where they are level, the force is cubic in the thickness."""
    parameters = result.of(Parameters)
    h = sorted(parameters.thicknesses)
    units = {x: Press(x, 0.0).unit for x in h}
    names = [name.rpartition("_")[2] for name in result.metrics if name.startswith(f"F_h{_mm(h[0])}_")]
    styles = (("C2o", "C0-", "stop as described"), ("C4s", "C4--", "stop of Table 2"))
    for name, (mark, line, label) in zip(names, styles, strict=True):
        found = [result.metrics[f"F_h{_mm(x)}_{name}"] for x in h]
        level = (found[0].exact or np.nan) / units[h[0]]
        ax.axhline(level, color=line[:2], linestyle=line[2:], linewidth=0.8)
        values = [metric.value / units[x] for x, metric in zip(h, found, strict=True)]
        ax.plot(1e3 * np.array(h), values, mark, fillstyle="none", label=f"beam, {label}")
    printed = [x for x in h if x in CONTACT_FORCES]
    if printed:
        ax.plot(1e3 * np.array(printed), [CONTACT_FORCES[x] / units[x] for x in printed], "kx", label="printed in Table 2")
    ax.margins(0.15, 0.35)
    ax.set(xlabel="thickness [mm]", ylabel="largest contact force $F L^2/(E I)$")
    ax.legend(loc="center")
