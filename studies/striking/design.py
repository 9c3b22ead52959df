"""The striking slider-crank designed backwards: contact force, impact force and contact angle in; strip, stop and speed out.

The exact elastica and the closed-form peak of the stop's law give the design; full simulations check it. `strut`, the coupler a
massless exact elastica, is the model the closed form is about. `beam` gives the coupler its inertia: straight, it buckles late
and strikes far harder. With `hold_for = beam` the design is corrected by simulated turns until the beam does what is asked for
(`studies.striking.design_beam`); a wish that no strip can do is told with the reason. With `strut` a wish that cannot be had is
answered by the nearest that can.
Of thickness and width, and of speed, mass and stop stiffness, one each is 0: the one that is solved for.

References
----------
B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, doi 10.1115/IMECE2008-68796.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees, isfinite, nan, pi
from typing import Any

import numpy as np

from buckler.studies.kit.parameters import choice, choices, integer, quantity, specs
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import Figure
from buckler.studies.striking import design_beam
from buckler.studies.striking.assumptions import StrikeAssumptions
from buckler.studies.striking.design_check import MODELS, CheckedTurn, Numerics, check, drawn_wishes, random_wishes
from buckler.studies.striking.inverse import Design, Given, Wish, design
from buckler.studies.striking.inverse_limits import NothingNearError, binding, broken, feasible, limits, nearest

BARS = {"contact_force": (5e-3, "0.5 %"), "impact_force": (2e-2, "2 %"), "contact_angle": (np.radians(0.5), "0.5 deg")}
"""How far `strut` may be off what was asked for: relative for the forces, absolute for the angle."""
BEAM_BARS = {name: (design_beam.BARS[name], shown) for name, shown in zip(BARS, ("0.5 %", "5 %", "0.5 deg"), strict=True)}
"""How far `beam` may be, if the design is to hold for it, in a turn of twice the elements and a hundredth of the tolerance."""
SOLVED = (("thickness", "width"), ("speed", "mass", "stop_stiffness"))
"""Groups of parameters of which one is 0, to be solved for."""
NOTES = """\
strut: the model of the closed form, held to 0.5 %, 2 % and 0.5 deg. beam: its coupler has inertia and a bow of {bow:g} of its
length; it goes on pushing until it has had time to buckle, so that its impact is another one. True dry friction may take
up to {friction:g} N off the contact force of a slider at rest, or add it; the closed form leaves that out."""


@dataclass(frozen=True)
class Parameters(StrikeAssumptions):
    """Parameters of the study."""

    contact_force: float = quantity(2.0, "N", 1e-3, 1e4, "largest force of the buckled strip, crank at 180 deg", "wish")
    impact_force: float = quantity(30.0, "N", 1e-3, 1e5, "largest force of the first impact", "wish")
    contact_angle: float = quantity(
        2 * pi / 3, "rad", 0.01, 6.28,
        "angle the crank turns from first contact to release, twice the half angle before 180 deg: "
        "120deg is contact from 120 to 240 deg, half angle 60 deg", "wish",
    )  # fmt: skip
    thickness: float = quantity(0, "m", 0, 0.1, "thickness of the strip; 0: solved for", "strip")
    width: float = quantity(0.030, "m", 0, 1, "width of the strip; 0: solved for", "strip")
    modulus: float = quantity(210e9, "Pa", 1e6, 1e13, "Young's modulus of the strip", "strip")
    yield_strength: float = quantity(1e9, "Pa", 1e5, 1e11, "stress at which the strip yields; spring steel", "strip")
    crank: float = quantity(0.140, "m", 1e-3, 10, "length of the crank", "linkage")
    coupler: float = quantity(0.310, "m", 1e-3, 10, "length of the coupler, longer than the crank", "linkage")
    mass: float = quantity(0.3, "kg", 0, 100, "mass of the slider; 0: solved for", "slider and stop")
    lightest: float = quantity(1e-3, "kg", 1e-6, 1e3, "least mass the slider can have", "slider and stop")
    heaviest: float = quantity(10, "kg", 1e-6, 1e3, "largest mass the slider can have", "slider and stop")
    friction_force: float = quantity(0.3, "N", 0, 1e3, "Coulomb friction of the slider in its guide", "slider and stop")
    stop_stiffness: float = quantity(7.2e4, "N/m", 0, 1e9, "stiffness of the stop; 0: solved for", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")
    speed: float = quantity(0, "rad/s", 0, 1e3, "speed of the crank; 0: solved for", "drive")
    slowest: float = quantity(0.1, "rad/s", 1e-3, 1e3, "slowest the drive can run", "drive")
    fastest: float = quantity(10, "rad/s", 1e-3, 1e3, "fastest the drive can run", "drive")
    hold_for: str = choice("strut", MODELS, "model that the design must hold for", "check")
    models: tuple[str, ...] = choices(MODELS, MODELS, "models the design is checked with", "check")
    wishes: int = integer(10, 0, 1000, "random wishes around this one that are designed and checked alike", "check")
    seed: int = integer(1, 0, 2**31, "of the random wishes", "check")
    damping: float = quantity(0.05, "1", 0, 1, "damping ratio of the strip's first bending mode (beam)", "numerics")
    imperfection: float = quantity(1e-4, "1", -0.05, 0.05, "bow of the unloaded strip over its length (beam)", "numerics")
    elements: int = integer(8, 2, 64, "elements of the beam", "numerics")
    tolerance: float = quantity(1e-5, "1", 1e-9, 1e-3, "position error allowed a step, over the length", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a simulation may take", "numerics")

    def check(self) -> None:
        """One of each group is 0; lengths and speeds fit each other."""
        for group in SOLVED:
            zeros = [name for name in group if getattr(self, name) == 0]
            if len(zeros) != 1:
                shown = ", ".join(f"{name} = {getattr(self, name):g}" for name in group)
                raise ValueError(f"{shown}: exactly one of them must be 0, the one to be solved for")
        for low, high, unit in (("slowest", "fastest", "rad/s"), ("lightest", "heaviest", "kg")):
            least, most = getattr(self, low), getattr(self, high)
            if least > most:
                raise ValueError(f"{low} = {least:g} {unit}: must not exceed {high} = {most:g} {unit}")
        if self.hold_for == "beam" and "beam" not in self.models:
            raise ValueError(f"hold_for = beam: must be one of models = {','.join(self.models)}")
        self.given  # noqa: B018 - refuses a crank that cannot turn

    @property
    def wish(self) -> Wish:
        """What is asked for."""
        return Wish(self.contact_force, self.impact_force, self.contact_angle)

    @property
    def given(self) -> Given:
        """What is fixed."""
        return Given(
            thickness=self.thickness or None, width=self.width or None,
            speed=self.speed or None, mass=self.mass or None, stiffness=self.stop_stiffness or None,
            restitution=self.restitution, friction=self.friction_force,
            yield_strength=self.yield_strength, modulus=self.modulus,
            crank=self.crank, coupler=self.coupler, slowest=self.slowest, fastest=self.fastest,
            lightest=self.lightest, heaviest=self.heaviest,
        )  # fmt: skip

    @property
    def numerics(self) -> Numerics:
        """How designs are simulated."""
        given: dict[str, Any] = {name: getattr(self, name) for name in specs(StrikeAssumptions)}
        assumed = StrikeAssumptions(**given)
        return Numerics(self.damping, self.imperfection, self.elements, self.tolerance, self.timeout, assumed)


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Design, or find the nearest wish that can be had and design that; then simulate."""
    if parameters.hold_for == "beam":
        return _run_beam(parameters, progress)
    asked = design(parameters.wish, parameters.given)
    try:
        d, message = _possible(asked)
    except NothingNearError as error:
        found, shown = {"feasible": Metric(0.0, "1")}, [_limits(asked)]
        return StudyResult(parameters=parameters, status="INFEASIBLE", message=str(error), metrics=found, tables=shown)
    outcomes = [check(model, d, parameters.numerics) for model in progress(parameters.models, label="models")]
    around = [(other, [check(model, other, parameters.numerics) for model in parameters.models])
              for other in progress(random_wishes(d, parameters.wishes, parameters.seed), label="random wishes")]  # fmt: skip
    tables = [_mechanism(d, bool(message)), _comparison(d, outcomes, parameters), _limits(d)]
    signals = {f"{o.model}.{name}": getattr(o, name) for o in outcomes for name in ("angle", "force")}
    status: dict[str, Any] = {"status": "INFEASIBLE", "message": message} if message else _verdict(d, outcomes)
    return StudyResult(
        parameters=parameters,
        **status,
        metrics={"feasible": Metric(float(not message), "1"), **_metrics(d, outcomes), **_spread(around)},
        signals=signals,
        work={f"{o.model}.wall_s": o.wall_s for o in outcomes},
        tables=[*tables, *([_statistics(around)] if around else [])],
    )


def _run_beam(p: Parameters, progress: Progress) -> StudyResult:
    """Design for the beam, simulate that more finely, and do the same for random wishes."""
    finer = replace(p.numerics, elements=2 * p.elements, tolerance=p.tolerance / 100)
    found = design_beam.for_beam(p.wish, p.given, p.numerics)
    d = found.design
    if found.reason:
        metrics = {"feasible": Metric(0.0, "1"), "turns": Metric(float(found.turns), "1")}
        message = f"no strip can: {found.reason}"
        return StudyResult(parameters=p, status="INFEASIBLE", message=message, metrics=metrics, tables=[_limits(d)])
    outcomes = [check(model, d, finer if model == "beam" else p.numerics) for model in progress(p.models, label="models")]
    wishes = drawn_wishes(p.wish, p.wishes, p.seed)
    others = [design_beam.for_beam(wish, p.given, p.numerics) for wish in progress(wishes, label="random wishes")]
    around = [(x.design, [check("beam", x.design, finer)]) for x in others if not x.reason]
    bad = [f"{name} off by more than {shown}" for name, (bar, shown) in BEAM_BARS.items()
           if not all(abs(off(x, o)[name]) <= bar for x, (*_, o) in [(d, outcomes[-1:]), *around])]  # fmt: skip
    asked = f"{len(around)} of {len(others)} random wishes can be had"
    return StudyResult(
        parameters=p,
        status="SUSPECT" if bad else "OK",
        message=f"beam: {', '.join(bad)}" if bad else asked,
        metrics={
            "feasible": Metric(1.0, "1"), "turns": Metric(float(found.turns), "1"), **_metrics(d, outcomes), **_spread(around),
            "around.asked": Metric(float(len(others)), "1"),
        },
        signals={f"{o.model}.{name}": getattr(o, name) for o in outcomes for name in ("angle", "force")},
        work={f"{o.model}.wall_s": o.wall_s for o in outcomes},
        tables=[_mechanism(d, False), _comparison(d, outcomes, p), *([_statistics(around, BEAM_BARS)] if around else []),
                *([_reasons(others)] if len(around) < len(others) else [])],
    )  # fmt: skip


def _reasons(others: Sequence[design_beam.BeamDesign]) -> Table:
    """Random wishes that no strip can do, and why."""
    rows = [
        [f"{x.design.wish.contact_force:.3g}", f"{x.design.wish.impact_force:.3g}",
         f"{degrees(x.design.wish.contact_angle):.3g}", x.reason]
        for x in others if x.reason
    ]  # fmt: skip
    return Table(["contact [N]", "impact [N]", "angle [deg]", "why"], rows, "Random wishes that no strip can do")


def _possible(asked: Design) -> tuple[Design, str]:
    """The design itself if it keeps its limits, else the nearest that does, and what to say about it."""
    if feasible(asked):
        return asked, ""
    found = nearest(asked.wish, asked.given)
    others = dict.fromkeys(limit.name for limit in broken(asked)[1:] if limit.name != binding(asked).name)
    also = f" (and {', '.join(others)})" if others else ""
    wanted = f"{found.contact_force:.4g} N, {found.impact_force:.4g} N, {degrees(found.contact_angle):.4g} deg"
    return design(found, asked.given), f"{binding(asked)}{also}; nearest wish that can be had: {wanted}"


def off(d: Design, outcome: CheckedTurn) -> dict[str, float]:
    """How far a simulation is off the wish: relative for the forces, rad for the angle."""
    return {
        "contact_force": outcome.contact_force / d.wish.contact_force - 1,
        "impact_force": outcome.impact_force / d.wish.impact_force - 1,
        "contact_angle": outcome.contact_angle - d.wish.contact_angle,
    }


def _verdict(d: Design, outcomes: Sequence[CheckedTurn]) -> dict[str, Any]:
    """A run that failed gives its status; `strut` beyond its bars makes the design suspect; `beam` may be where it is."""
    for outcome in outcomes:
        if outcome.status != "OK":
            return {"status": outcome.status, "message": f"{outcome.model}: {outcome.message}"}
    wrong = [
        f"{name} off by more than {BARS[name][1]}"
        for outcome in outcomes
        for name, value in off(d, outcome).items()
        if outcome.model == "strut" and not abs(value) <= BARS[name][0]
    ]
    return {"status": "SUSPECT", "message": f"strut: {', '.join(wrong)}"} if wrong else {}


# --- numbers and tables -----------------------------------------------------------------------------------------------


def _metrics(d: Design, outcomes: Sequence[CheckedTurn]) -> dict[str, Metric]:
    wish = {"contact_force": (d.wish.contact_force, "N"), "impact_force": (d.wish.impact_force, "N")}
    wish["contact_angle"] = (degrees(d.wish.contact_angle), "deg")
    found = {f"wish.{name}": Metric(float(value), unit) for name, (value, unit) in wish.items()}
    found |= {name: Metric(value, unit) for name, value, unit, _ in _parts(d)}
    for o in outcomes:
        values = {"contact_force": o.contact_force, "impact_force": o.impact_force, "contact_angle": degrees(o.contact_angle)}
        found |= {f"{o.model}.{name}": Metric(values[name], wish[name][1], exact=float(wish[name][0])) for name in values}
        found[f"{o.model}.settled"] = Metric(degrees(o.settled), "deg")
        found[f"{o.model}.energy_balance"] = Metric(o.energy_balance, "1")
    return found


def _parts(d: Design) -> list[tuple[str, float, str, bool]]:
    """Name, value, unit of what makes the mechanism, and whether it was solved for."""
    given = d.given
    return [
        ("thickness", d.thickness, "m", given.thickness is None),
        ("width", d.width, "m", given.width is None),
        ("stop", d.stop, "m", True),
        ("speed", d.speed, "rad/s", given.speed is None),
        ("mass", d.mass, "kg", given.mass is None),
        ("stop_stiffness", d.stiffness, "N/m", given.stiffness is None),
        ("contact_time", d.contact_time, "s", True),
        ("impact_speed", d.impact_speed, "m/s", True),
        ("end_shortening", d.shortening, "1", True),
        ("euler_load", d.euler_load, "N", True),
    ]


def _mechanism(d: Design, instead: bool) -> Table:
    """What to build; `instead` of what was asked for if that cannot be had."""
    rows = [[name, f"{value:.6g}", unit, "found" if solved else "given"] for name, value, unit, solved in _parts(d)]
    title = f"{d.wish.contact_force:.4g} N contact, {d.wish.impact_force:.4g} N impact, {degrees(d.wish.contact_angle):.4g} deg"
    return Table(["", "value", "unit", ""], rows, f"{'Nearest that can be had: ' if instead else ''}{title} in contact")


def _comparison(d: Design, outcomes: Sequence[CheckedTurn], p: Parameters) -> Table:
    """What was asked for and what each model does."""
    asked = {"contact_force": d.wish.contact_force, "impact_force": d.wish.impact_force, "contact_angle": d.wish.contact_angle}
    rows: list[list[Any]] = []
    for name, value in asked.items():
        scale, unit = (degrees(1), "deg") if name == "contact_angle" else (1.0, "N")
        row: list[Any] = [name, unit, f"{scale * value:.5g}"]
        for o in outcomes:
            row += [f"{scale * getattr(o, name):.5g}", _off(name, off(d, o)[name])]
        rows.append(row)
    rows.append(["rests from", "deg", None, *(x for o in outcomes for x in (f"{degrees(o.settled):.1f}", None))])
    rows.append(["status", None, None, *(x for o in outcomes for x in (o.status, None))])
    headers = ["", "unit", "wish", *(x for o in outcomes for x in (o.model, "off"))]
    return Table(
        headers,
        rows,
        "Full simulation of the design",
        f"{NOTES.format(bow=p.imperfection, friction=p.friction_force)}\n{p.stated()}.",
    )


def _off(name: str, value: float) -> str:
    return f"{degrees(value):+.3f} deg" if name == "contact_angle" else f"{100 * value:+.3g} %"


def _limits(d: Design) -> Table:
    rows = [
        [limit.name, limit.what, f"{limit.value:.4g}", "at least" if limit.least else "at most",
         f"{limit.allowed:.4g}", limit.unit, f"{100 * limit.use:.0f} %" if limit.use < 100 else "broken"]
        for limit in limits(d)
    ]  # fmt: skip
    return Table(["limit", "", "value", "", "bound", "unit", "used"], rows, "Limits")


Around = Sequence[tuple[Design, Sequence[CheckedTurn]]]


def _errors(around: Around, name: str, model: str) -> Any:
    """How far each random wish's simulation by a model is off; runs that did not reach the stop are left out."""
    found = [off(d, o)[name] for d, outcomes in around for o in outcomes if o.model == model]
    return np.abs([value for value in found if isfinite(value)])


def _spread(around: Around) -> dict[str, Metric]:
    """Largest and median error of each model over the random wishes."""
    found = {"around.wishes": Metric(float(len(around)), "1")}
    for model in dict.fromkeys(o.model for _, outcomes in around for o in outcomes):
        for name in BARS:
            errors, unit = _errors(around, name, model), "rad" if name == "contact_angle" else "1"
            for word, reduce in (("median", np.median), ("largest", np.max)):
                found[f"around.{model}.{name}.{word}"] = Metric(float(reduce(errors)) if errors.size else nan, unit)
    return found


def _statistics(around: Around, bars: Mapping[str, tuple[float, str]] = BARS) -> Table:
    rows = []
    for model in dict.fromkeys(o.model for _, outcomes in around for o in outcomes):
        for name, (bar, shown) in bars.items():
            errors = _errors(around, name, model)
            row = [f"{q:.0f} %" for q in [100 * np.mean(errors <= bar) if errors.size else nan]]
            within = [_off(name, float(x))[1:] for x in (np.median(errors), errors.max())] if errors.size else [None, None]
            rows.append([model, name, *within, shown, *row])
    title = f"{len(around)} random wishes around this one, all within the limits: how far the simulation is off"
    return Table(["model", "", "median", "largest", "bar", "within"], rows, title)


def figure(result: StudyResult) -> Figure:
    """Contact force over thickness and stop, limits shaded; force on the stop over crank angle."""
    from buckler.studies.striking.design_figure import draw

    return draw(result)
