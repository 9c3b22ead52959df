"""The striking slider-crank designed backwards: contact force, impact force and contact angle in; strip, stop and speed out.

The exact elastica and the closed-form peak of the stop's law give the design; full simulations check it. `strut`, the coupler a
massless exact elastica, is the model the closed form is about. `beam` gives the coupler its inertia: straight, it buckles late
and strikes far harder. With `hold_for = beam` simulated turns lead from there to a design with which the beam does what is
asked for (`studies.striking.design_check`), or to the reason why none was found. With `strut` a wish that cannot be had is
answered by the nearest that can.
Of thickness and width, and of speed, mass and stop stiffness, one each is 0: the one that is solved for.

References
----------
B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, doi 10.1115/IMECE2008-68796.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees, isfinite, nan, pi
from typing import Any

import numpy as np

from buckler.mbs.declare import specs

from ..kit.parameters import choice, choices, integer, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged, worst
from ..kit.style import Figure
from .assumptions import StrikeParameters
from .design_check import BARS, BeamDesign, CheckedTurn, check, drawn_wishes, for_beam, random_wishes
from .inverse import FREE, Design, Given, Wish, design
from .inverse_limits import NothingNearError, binding, broken, feasible, limits, nearest

ASKED = {"contact_force": ("N", 1.0), "impact_force": ("N", 1.0), "contact_angle": ("deg", degrees(1.0))}
"""Numbers of a wish: the unit in which they are shown, and how many of it are one in SI."""
MODELS = tuple(BARS)
Turns = Mapping[str, CheckedTurn]
"""Simulated turns of a design by their model."""
SOLVED = (("thickness", "width"), ("speed", "mass", "stop_stiffness"))
"""Groups of parameters of which one is 0, to be solved for."""
NOTES = """\
strut: the model of the closed form, held to 0.5 %, 2 % and 0.5 deg. beam: its coupler has inertia and a bow of {bow:g} of its
length; it goes on pushing until it has had time to buckle, so that its impact is another one. True dry friction may take
up to {friction:g} N off the contact force of a slider at rest, or add it; the closed form leaves that out."""


@dataclass(frozen=True)
class Parameters(StrikeParameters):
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
        named = {"stiffness": self.stop_stiffness, "friction": self.friction_force}
        found = {name: named.get(name, getattr(self, name, None)) for name in specs(Given)}
        return Given(**{name: None if name in FREE and not value else value for name, value in found.items()})


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Design, or find the nearest wish that can be had and design that; simulate, and do the same for random wishes."""
    instead, why_not = "", ""
    searched: dict[str, Metric] = {}
    if p.hold_for == "beam":
        d, turns, reason = for_beam(p.wish, p.given, p)
        searched, why_not = {"turns": Metric(float(turns), "1")}, f"no strip can: {reason}" if reason else ""
    else:
        d = design(p.wish, p.given)
        try:
            d, instead = _possible(d)
        except NothingNearError as error:
            why_not = str(error)
    metrics = {"feasible": Metric(float(not (instead or why_not)), "1"), **searched}
    if why_not:
        return StudyResult(parameters=p, status="INFEASIBLE", message=why_not, metrics=metrics, tables=[_limits(d)])
    outcomes = {model: check(model, d, p, p.hold_for == model == "beam") for model in progress(p.models, label="models")}
    around, refused = _around(p, d, progress)
    spread, statistics = _spread(around, p.hold_for)
    if p.hold_for == "beam":
        spread["around.asked"] = Metric(float(len(around) + len(refused)), "1")
        tables = statistics + _reasons(refused)
    else:
        tables = [_limits(d), *statistics]
    return StudyResult(
        parameters=p,
        **({"status": "INFEASIBLE", "message": instead} if instead else _verdict(p, d, outcomes, around, refused)),
        metrics={**metrics, **_metrics(d, outcomes), **spread},
        signals={f"{model}.{name}": getattr(o.run, name) for model, o in outcomes.items() for name in ("angle", "force")},
        work={f"{model}.wall_s": o.run.work["wall_s"] for model, o in outcomes.items()},
        tables=[_mechanism(d, bool(instead)), _comparison(d, outcomes, p), *tables],
    )


def _around(p: Parameters, d: Design, progress: Progress) -> tuple[list[tuple[Design, Turns]], list[BeamDesign]]:
    """Designs of random wishes, simulated, and those for which there is none."""
    if p.hold_for == "strut":
        designs = progress(random_wishes(d, p.wishes, p.seed), label="random wishes")
        return [(other, {model: check(model, other, p) for model in p.models}) for other in designs], []
    wishes = drawn_wishes(p.wish, p.wishes, p.seed)
    found = [for_beam(wish, p.given, p) for wish in progress(wishes, label="random wishes")]
    held: list[tuple[Design, Turns]] = [
        (x.design, {"beam": check("beam", x.design, p, finer=True)}) for x in found if not x.reason
    ]
    return held, [x for x in found if x.reason]


def _possible(asked: Design) -> tuple[Design, str]:
    """The design itself if it keeps its limits, else the nearest that does, and what to say about it."""
    if feasible(asked):
        return asked, ""
    found = nearest(asked.wish, asked.given)
    others = dict.fromkeys(limit.name for limit in broken(asked)[1:] if limit.name != binding(asked).name)
    also = f" (and {', '.join(others)})" if others else ""
    wanted = f"{found.contact_force:.4g} N, {found.impact_force:.4g} N, {degrees(found.contact_angle):.4g} deg"
    return design(found, asked.given), f"{binding(asked)}{also}; nearest wish that can be had: {wanted}"


def _verdict(
    p: Parameters, d: Design, outcomes: Turns, around: Sequence[tuple[Design, Turns]], refused: Sequence[BeamDesign]
) -> dict[str, Any]:
    """A run that failed gives its status; the model held for, beyond its bars, makes the design suspect; others may be off."""
    model = p.hold_for
    failed = [(name, o.run) for name, o in outcomes.items() if o.run.status != "OK"]
    if model == "strut" and failed:
        return worst(failed[:1])
    judging = [(d, outcomes), *(around if model == "beam" else [])]
    wrong = [
        f"{name} off by more than {_off(name, bar)[1:]}"
        for name, bar in BARS[model].items()
        if not all(abs(turns[model].off(x.wish)[name]) <= bar for x, turns in judging if model in turns)
    ]
    asked = f"{len(around)} of {len(around) + len(refused)} random wishes can be had" if model == "beam" else ""
    return judged([f"{model}: {', '.join(wrong)}"] if wrong else [], asked)


# --- numbers and tables -----------------------------------------------------------------------------------------------


def _metrics(d: Design, outcomes: Turns) -> dict[str, Metric]:
    wish = {name: scale * float(getattr(d.wish, name)) for name, (_, scale) in ASKED.items()}
    found = {f"wish.{name}": Metric(value, ASKED[name][0]) for name, value in wish.items()}
    found |= {name: Metric(value, unit) for name, value, unit, _ in _parts(d)}
    for model, o in outcomes.items():
        for name, (unit, scale) in ASKED.items():
            found[f"{model}.{name}"] = Metric(scale * getattr(o, name), unit, exact=wish[name])
        found[f"{model}.settled"] = Metric(degrees(o.settled), "deg")
        found[f"{model}.energy_balance"] = Metric(o.run.energy_balance, "1")
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


def _comparison(d: Design, outcomes: Turns, p: Parameters) -> Table:
    """What was asked for and what each model does."""
    rows: list[list[Any]] = []
    for name, (unit, scale) in ASKED.items():
        found = [(f"{scale * getattr(o, name):.5g}", _off(name, o.off(d.wish)[name])) for o in outcomes.values()]
        rows.append([name, unit, f"{scale * getattr(d.wish, name):.5g}", *(x for pair in found for x in pair)])
    rows.append(["rests from", "deg", None, *(x for o in outcomes.values() for x in (f"{degrees(o.settled):.1f}", None))])
    rows.append(["status", None, None, *(x for o in outcomes.values() for x in (o.run.status, None))])
    headers = ["", "unit", "wish", *(x for model in outcomes for x in (model, "off"))]
    notes = f"{NOTES.format(bow=p.imperfection, friction=p.friction_force)}\n{p.stated()}."
    return Table(headers, rows, "Full simulation of the design", notes)


def _off(name: str, value: float) -> str:
    return f"{degrees(value):+.3g} deg" if name == "contact_angle" else f"{100 * value:+.3g} %"


def _limits(d: Design) -> Table:
    rows = [
        [limit.name, limit.what, f"{limit.value:.4g}", "at least" if limit.least else "at most",
         f"{limit.allowed:.4g}", limit.unit, f"{100 * limit.use:.0f} %" if limit.use < 100 else "broken"]
        for limit in limits(d)
    ]  # fmt: skip
    return Table(["limit", "", "value", "", "bound", "unit", "used"], rows, "Limits")


def _reasons(refused: Sequence[BeamDesign]) -> list[Table]:
    """Random wishes that no strip can do, and why."""
    rows = [[*(f"{scale * getattr(x.design.wish, name):.3g}" for name, (_, scale) in ASKED.items()), x.reason] for x in refused]
    heads = ["contact [N]", "impact [N]", "angle [deg]", "why"]
    return [Table(heads, rows, "Random wishes that no strip can do")] if rows else []


def _spread(around: Sequence[tuple[Design, Turns]], held: str) -> tuple[dict[str, Metric], list[Table]]:
    """Median and largest error of each model over the random wishes; runs that did not reach the stop are left out."""
    found, rows = {"around.wishes": Metric(float(len(around)), "1")}, []
    for model in around[0][1] if around else ():
        for name, bar in BARS[held].items():
            errors = np.abs([turns[model].off(d.wish)[name] for d, turns in around])
            errors = errors[np.isfinite(errors)]
            middle, most, within = (
                (float(np.median(errors)), float(errors.max()), 100 * np.mean(errors <= bar)) if errors.size else (nan, nan, nan)
            )
            unit = "rad" if name == "contact_angle" else "1"
            found |= {f"around.{model}.{name}.{word}": Metric(x, unit) for word, x in (("median", middle), ("largest", most))}
            shown = [_off(name, x)[1:] if isfinite(x) else None for x in (middle, most)]
            rows.append([model, name, *shown, _off(name, bar)[1:], f"{within:.0f} %"])
    title = f"{len(around)} random wishes around this one, all within the limits: how far the simulation is off"
    return found, [Table(["model", "", "median", "largest", "bar", "within"], rows, title)] if rows else []


def figure(result: StudyResult) -> Figure:
    """Contact force over thickness and stop, limits shaded; force on the stop over crank angle."""
    from .design_figure import draw

    return draw(result)
