"""Force of the buckled strip on the stop in equilibrium: Table 2 for three thicknesses, and the force over crank angle.

Models of the strip: the published quartic; the closed form, `exact`; the rod, a boundary value problem with the strip's axial and
shear stiffness; and geometrically exact beam elements in static equilibrium. There are two stops. The slider meets the one of the
paper's text at a crank angle of 120 degrees, the parameter `stop_angle`; names of metrics have it as `e120`. Table 2 was computed
with another, `eTable2`. It is found from the printed force of the 0.3 mm strip, and predicts the other two forces.
Positions on the slider's line are negative; the metric `stop_eTable2` is the distance from the crank's axis.

On a slider at rest act the strip's force F, the stop and friction, whose size is anywhere up to its limit f = mu m g. So the
force on the stop lies in [max(F - f, 0), F + f], depending on the motion before.
Source: B. Demirel et al., 2008, doi 10.1115/IMECE2008-68796.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from buckler.elastica import law, pinned
from buckler.elastica.rod import Rod
from buckler.mbs import STEEL, Beam, Section, engine
from buckler.mbs.geometry import Array
from buckler.mbs.library import PAPER, PAPER_STOP

from ..kit.parameters import StudyParameters, integer, quantities, quantity
from ..kit.published import CONTACT_FORCES, GRAVITY, STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult, metrics_table, status_of
from ..kit.style import Figure, subplots

REFERENCE_THICKNESS = 3e-4
"""Thickness of the strip whose printed force gives the stop of Table 2 [m]."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    thicknesses: tuple[float, ...] = quantities((1e-4, 3e-4, 5e-4), "m", 5e-5, 5e-3, "thicknesses of the strip", "strip")
    yield_strength: float = quantity(1e9, "Pa", 1e6, 1e10, "stress at which the strip yields; spring steel", "strip")
    stop_angle: float = quantity(2 * np.pi / 3, "rad", 1.6, 3.0, "crank angle at which the slider meets the stop", "stop")
    mass: float = quantity(0.3, "kg", 1e-3, 10, "mass of the slider", "friction")
    static_friction: float = quantity(0.15, "1", 0.001, 0.9, "Coulomb coefficient of the slider at rest", "friction")
    elements: int = integer(20, 2, 200, "beam elements, three nodes each", "numerics")
    angles: int = integer(31, 2, 1000, "crank angles from the stop to dead centre", "numerics")


def force_unit(thickness: float) -> float:
    """Compute the unit of the normalised forces of a strip, E I/L^2 [N]."""
    return Section(STRIP_WIDTH, thickness).bending_stiffness / PAPER.coupler**2


def press(load: Callable[[Array], Array], thickness: float, stop: float, angle: ArrayLike) -> Array:
    """Compute the force of a strip on a stop at x = `stop` [m], F = p(u) E I/L^2 cos(phi) [N], at crank angles [rad].

    Equations 7 to 13 of the paper; phi is the angle from the strip's chord to the slider's line.
    """
    return np.asarray(PAPER.push(load, Section(STRIP_WIDTH, thickness).bending_stiffness, np.atleast_1d(angle), stop))


def table_2_stop() -> float:
    """Compute the stop [m] at which the exact elastica has the printed force of the 0.3 mm strip at the dead centre."""
    load = CONTACT_FORCES[REFERENCE_THICKNESS] / force_unit(REFERENCE_THICKNESS)
    return -(PAPER.crank + PAPER.coupler * (1 - pinned.shortening(load)))


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Compute the force of every strip by every model at the two stops, and the interval of the force with friction."""
    stop_of_text = float(PAPER.slider(p.stop_angle))  # for which forces over the angle are drawn
    stops = {f"e{np.degrees(p.stop_angle):g}": stop_of_text, "eTable2": table_2_stop()}
    angle = np.linspace(p.stop_angle, np.pi, p.angles)
    metrics: dict[str, Metric] = {}
    signals = {"angle": angle}
    yields, failures = list[str](), list[str]()  # a strip that yields is remarked; a failure makes the study SUSPECT
    for h in progress(p.thicknesses, label="thicknesses"):
        load_laws = _make_load_laws(h, p.elements, failures)
        for name, stop in stops.items():
            key = f"h{_mm(h)}_{name}"  # as in the metric F_h0.3_e120, the force of the beam
            largest = {model: float(press(load_law, h, stop, np.pi)[0]) for model, load_law in load_laws.items()}
            # The printed forces stand at both stops, to show which of them the table was computed with.
            metrics[f"F_{key}"] = Metric(largest["beam"], "N", published=CONTACT_FORCES.get(h), exact=largest["exact"])
            metrics |= {f"{model}_{key}": Metric(largest[model], "N", exact=largest["exact"]) for model in ("quartic", "rod")}
            stress = float(pinned.surface_stress(PAPER.shortening(np.pi, stop), h, PAPER.coupler, STEEL.modulus))
            metrics[f"stress_{key}"] = Metric(stress, "Pa")  # of bending, the largest
            if stress > p.yield_strength:
                yields.append(f"h = {_mm(h)} mm at {name} ({stress / 1e6:.0f} MPa)")
        curves = {model: press(load_law, h, stop_of_text, angle) for model, load_law in load_laws.items()}
        signals |= {f"F_h{_mm(h)}.{model}": force for model, force in curves.items()}
    metrics |= _ratios(p, metrics) | {
        "stop_eTable2": Metric(-stops["eTable2"], "m"),
        "angle_eTable2": Metric(float(np.degrees(PAPER.contact_angle(stops["eTable2"]))), "deg"),
    }
    metrics |= _friction_bounds(p)
    limit = f"{p.yield_strength / 1e6:g} MPa"
    remark = f"YIELDS beyond {limit}, so its force is overestimated: {', '.join(yields)}" if yields else ""
    notes = [
        "F: beam elements, N. eTable2: the stop at which the exact force of the "
        f"{_mm(REFERENCE_THICKNESS)} mm strip is the printed one.",
        f"friction: interval of a slider of {p.mass:g} kg at rest, coefficient {p.static_friction:g} of its weight.",
        remark,
    ]
    table = replace(metrics_table(metrics), title="Largest contact force", notes="\n".join(filter(None, notes)))
    return StudyResult(parameters=p, metrics=metrics, signals=signals, tables=[table], **status_of(failures, remark))


def _mm(thickness: float) -> str:
    return f"{1e3 * thickness:.6g}"


def _make_load_laws(thickness: float, elements: int, failures: list[str]) -> Mapping[str, Callable[[Array], Array]]:
    """Make the law p(u) of each model, load in E I/L^2 over shortening in L; failures are appended."""
    section, unit = Section(STRIP_WIDTH, thickness), force_unit(thickness)
    strip = Rod(axial=section.axial_stiffness / unit, shear=section.shear_stiffness / unit)

    def load_bent(load: Callable[[Array], Array], u: Array) -> Array:
        """Compute normalised loads where the strip is surely bent, else nan; all are nan if Newton's method fails."""
        p, is_bent = np.full(u.shape, np.nan), u >= 1e-4  # of the length, chosen
        try:
            if is_bent.any():
                p[is_bent] = load(u[is_bent])
        except ArithmeticError as error:
            failures.append(f"h = {_mm(thickness)} mm: {error}")
        return p

    rod = np.vectorize(lambda u: strip.at_shortening(u).load)
    beam = partial(engine.pinned_strip, Beam(section, elements), PAPER.coupler)
    return {"quartic": law.quartic, "exact": pinned.load, "rod": partial(load_bent, rod), "beam": partial(load_bent, beam)}


def _ratios(p: Parameters, metrics: Mapping[str, Metric]) -> dict[str, Metric]:
    """Compute the forces at the stop of the paper's text over the force of the thinnest strip."""
    first, *others = sorted(p.thicknesses)
    found = {}
    for h in others:
        printed = CONTACT_FORCES[h] / CONTACT_FORCES[first] if {h, first} <= CONTACT_FORCES.keys() else None
        force, base = (metrics[f"F_h{_mm(x)}_e{np.degrees(p.stop_angle):g}"].value for x in (h, first))
        # exact: at one stop all strips have the same end shortening, so forces are as E I, that is as h^3
        found[f"ratio_h{_mm(h)}_h{_mm(first)}"] = Metric(force / base, "1", published=printed, exact=(h / first) ** 3)
    return found


def _friction_bounds(p: Parameters) -> dict[str, Metric]:
    """Compute the interval of each strip's force at the published stop, at 120 degrees, whatever `stop_angle` is."""
    found: dict[str, Metric] = {}
    limit = p.static_friction * p.mass * GRAVITY
    for h in p.thicknesses:
        low, high = friction_interval(press(pinned.load, h, PAPER_STOP, np.pi)[0], limit)
        found |= {f"friction_h{_mm(h)}.low": Metric(float(low), "N"), f"friction_h{_mm(h)}.high": Metric(float(high), "N")}
    return found


def friction_interval(force: ArrayLike, limit: float) -> tuple[Array, Array]:
    """Compute the bounds of the force on the stop [N] of a slider at rest, by the strip's force and the limit of friction [N]."""
    return np.maximum(np.asarray(force) - limit, 0.0), np.asarray(force) + limit


def figure(result: StudyResult) -> Figure:
    """Draw force over crank angle, and largest force over thickness, in units of E I/L^2, in which a cubic law is constant."""
    p, s = result.of(Parameters), result.signals
    fig, (left, right) = subplots(1, 2, height=85)
    last, stop_of_table = p.thicknesses[-1], table_2_stop()  # the last strip of the list
    turn = np.linspace(PAPER.contact_angle(stop_of_table), np.pi, 200)
    exact = press(pinned.load, last, stop_of_table, turn) / force_unit(last)
    left.plot(np.degrees(turn), exact, "C4--", label="exact, stop of Table 2")
    for name, style in (("exact", "C0-"), ("quartic", "C1:"), ("beam", "C2.")):
        left.plot(np.degrees(s["angle"]), s[f"F_h{_mm(last)}.{name}"] / force_unit(last), style, label=name)
    left.set(xlabel="crank angle [deg]", ylabel="contact force $F L^2/(E I)$")
    h = np.array(sorted(p.thicknesses))
    units = np.array([force_unit(x) for x in h])
    for stop, color, marker in ((f"e{np.degrees(p.stop_angle):g}", "C2", "o"), ("eTable2", "C4", "s")):
        found = [result.metrics[f"F_h{_mm(x)}_{stop}"] for x in h]
        right.plot(1e3 * h, np.array([m.value for m in found]) / units, color + marker, fillstyle="none", label=f"beam, {stop}")
        right.axhline((found[0].exact or np.nan) / units[0], color=color, linewidth=0.8)  # the same for all thicknesses
    printed = np.array([CONTACT_FORCES.get(x, np.nan) for x in h])
    right.plot(1e3 * h, printed / units, "kx", label="printed in Table 2")
    right.margins(0.15, 0.35)
    right.set(xlabel="thickness [mm]", ylabel="largest contact force $F L^2/(E I)$")
    for ax in (left, right):
        ax.legend()
    return fig
