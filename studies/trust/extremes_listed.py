"""Cases of the study `extremes` that stand in lists: thin and thick, slow and fast, soft and stiff, coarse, singular, wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from math import inf, nan, pi
from typing import Any, NamedTuple

from scipy.stats import qmc

from buckler import mbs
from buckler.mbs import laws
from buckler.mbs.elements.element import Body
from buckler.mbs.library import CLOSED, PAPER, RATTLING, CrankRocker, crank_rocker, slider_crank

from ..kit.drawn import pressed
from ..kit.drawn_linkages import PREDICTABLE
from ..kit.published import STEEL, STRIP_WIDTH

LENGTH, MASS, TURN = PAPER.coupler, 0.3, 0.56
"""Of the coupler, m; of the slider, kg; how much of a turn is run: until 200 degrees, contact began at 120."""
BARS, SPEED, START = mbs.Section(0.005, 0.020, STEEL), 10 * pi, 0.5
"""The paper's bars, 20 mm in the plane; speed of the crank, rad/s; its angle at the start, rad."""


class Listed(NamedTuple):
    """A case: what makes its mechanism, how long it runs, s, by which solver, and whether a run of it can be right."""

    family: str
    name: str
    mechanism: Callable[[], mbs.Mechanism]
    duration: float
    solver: mbs.Exudyn | None = None
    possible: bool = True


# --- slider-cranks that strike ---------------------------------------------------------------------------------------------


def slider(
    kind: str, thickness: float = 3e-4, speed: float = 1.25, stiffness: float = 7.2e4, restitution: float = 0.8,
    friction: float = 0.1, damping: float = 0.05, bow: float = 1e-4, **mesh: int,
) -> mbs.Mechanism:  # fmt: skip
    """The slider-crank with a strut, beam or cable: m, rad/s, N/m, coefficients, damping ratio, bow over its length."""
    section = mbs.Section(STRIP_WIDTH, thickness, mbs.Material(210e9, 7850.0, axial_damping=9e-5 if kind == "strut" else 0.0))
    elements = {"elements": 8 if kind == "beam" else 12} | mesh
    body: Any = mbs.Strut(section)
    if kind != "strut":
        flexible = mbs.Beam if kind == "beam" else mbs.Cable
        body = flexible(section.damped(damping, LENGTH), imperfection=-bow * LENGTH, **elements)  # type: ignore[arg-type]
    law = laws.CarvalhoMartins(stiffness, restitution, exponent=1.0)
    return slider_crank(body, law=law, mass=MASS, speed=speed, friction=mbs.GuideFriction.of_weight(friction, MASS))


def corners(count: int) -> Iterator[tuple[str, dict[str, Any]]]:
    """Spread over the whole range of six; thickness, speed, stiffness and damping by their logarithm."""
    names = ("thickness", "speed", "stiffness", "restitution", "friction", "damping")
    for u in qmc.Sobol(6, seed=11).random(count):
        values = (5e-5 * 20 ** u[0], 0.1 * 600 ** u[1], 1e3 * 1e5 ** u[2], 0.1 + 0.9 * u[3], 0.9 * u[4], 2e-3 * 250 ** u[5])
        yield f"h = {1e3 * values[0]:.2g} mm, {values[1]:.2g} rad/s, {values[2]:.1e} N/m", dict(zip(names, values, strict=True))


EDGES: dict[str, dict[str, Any]] = {
    "thinnest and slowest": {"thickness": 5e-5, "speed": 0.1, "stiffness": 1e5, "friction": 0.0},
    "thickest and fastest": {"thickness": 1e-3, "speed": 60.0, "stiffness": 1e8, "restitution": 0.5, "friction": 0.9},
    "elastic and stiff": {"stiffness": 1e8, "restitution": 1.0, "friction": 0.0},
    "dead and soft": {"stiffness": 1e3, "restitution": 0.1, "friction": 0.9},
    "undamped": {"damping": 0.0},
    "much bowed": {"bow": 0.03},
}
SETTINGS = {
    **{f"{n} equal steps": mbs.Exudyn(mbs.Equal(n)) for n in (50, 200, 1000, 4000, 20000)},
    **{f"tolerance {x:g}": mbs.Exudyn(mbs.Controlled(x)) for x in (1.0, 1e-1, 1e-2, 1e-3, 1e-4)},
    **{f"no step below {x:g} s": mbs.Exudyn(mbs.Controlled(min_step=x)) for x in (1e-2, 1e-3, 1e-4)},
    **{f"contact in {n} steps": mbs.Exudyn(mbs.Controlled(contact_resolution=n)) for n in (1, 4)},
    "hardly damped integrator": mbs.Exudyn(spectral_radius=0.9999),
    "Newton stops early": mbs.Exudyn(newton_relative=1e-1, newton_absolute=10.0),
}
COARSE: dict[str, tuple[str, dict[str, Any]]] = {
    **{f"{n} elements of 3 nodes": ("beam", {"elements": n}) for n in (1, 2, 3, 4)},
    **{f"{n} elements of 2 nodes": ("beam", {"elements": n, "nodes": 2}) for n in (1, 2, 4, 8)},
    **{f"{n} elements": ("cable", {"elements": n}) for n in (1, 2, 4)},
}


def slider_cranks() -> Iterator[Listed]:
    """Corners of the range, edges, solver settings and meshes."""

    def case(family: str, kind: str, name: str, solver: mbs.Exudyn | None = None, **given: Any) -> Listed:
        duration = TURN * 2 * pi / given.get("speed", 1.25)
        return Listed(f"slider-crank, {family}", f"{kind}, {name}", partial(slider, kind, **given), duration, solver)

    for name, corner in corners(16):
        for kind in ("strut", "beam", "cable"):
            yield case("range", kind, name, **corner)
    for kind in ("strut", "beam"):
        for name, edge in EDGES.items():
            yield case("range", kind, name, **edge)
        for name, solver in SETTINGS.items():
            yield case("steps", kind, name, solver)
    for name, (kind, mesh) in COARSE.items():
        yield case("mesh", kind, name, **mesh)


# --- strips pressed in line with their guide -------------------------------------------------------------------------------


def pressed_strips() -> Iterator[Listed]:
    """Straight, hardly bowed and bowed strips, pressed slowly."""
    section = mbs.Section(STRIP_WIDTH, 3e-4)
    wet = section.damped(0.5, LENGTH)
    bodies = {
        "straight": mbs.Beam(section), "straight cable": mbs.Cable(section), "straight strut": mbs.Strut(section),
        "bowed by 1e-9 of its length": mbs.Beam(wet, imperfection=1e-9 * LENGTH),
        "bowed by 1e-3": mbs.Beam(wet, imperfection=1e-3 * LENGTH), "bowed cable": mbs.Cable(wet, imperfection=1e-3 * LENGTH),
    }  # fmt: skip
    for share in (0.3, 0.9):
        for name, body in bodies.items():
            yield Listed("strip pressed in line", f"{name}, {share:g} L", partial(pressed, body, share, 10.0), 10.0)


# --- four-bars of ideal joints ---------------------------------------------------------------------------------------------


def four_bar(name: str, lengths: CrankRocker, angle: float, turn: float = 2 * pi, **given: Any) -> Listed:
    """Make a case of rigid bars and ideal joints; no run is right where the crank cannot turn."""
    speed = given.get("speed", SPEED)
    low, high = abs(lengths.coupler - lengths.rocker), lengths.coupler + lengths.rocker
    turns = low < abs(lengths.frame - lengths.crank) and lengths.frame + lengths.crank < high
    make = partial(crank_rocker, mbs.Rigid(BARS), speed=speed, section=BARS, lengths=lengths, angle=angle)
    return Listed("four-bar, ideal joints", name, make, turn / abs(speed), given.get("solver"), turns)


def four_bars() -> Iterator[Listed]:
    """Dead centres near and met, linkages whose crank cannot turn, speeds and steps."""
    paper, square = CrankRocker(), CrankRocker(0.1, 0.2, 0.1, 0.2)
    for room in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-9):
        near = paper._replace(frame=paper.crank + paper.coupler - paper.rocker + room)  # in line but for this at crank angle 0
        for angle in (0.5, -0.3):
            yield four_bar(f"{room:g} m from a dead centre, from {angle:g} rad", near, angle)
    yield four_bar("parallelogram", square, 0.5)
    yield four_bar("parallelogram, from its dead centre", square, 0.0, 1.0)
    yield four_bar("kite", CrankRocker(0.1, 0.2, 0.2, 0.1), 1.0)
    short = {
        "crank too long": {"crank": 0.15},
        "coupler too short": {"coupler": 0.16},
        "coupler far too short": {"coupler": 0.03},
    }
    for name, side in short.items():
        for angle in (0.0, 0.5):
            yield four_bar(f"{name}, from {angle:g} rad", paper._replace(**side), angle)
    for steps in (5, 20, 50, 200, 2000):
        yield four_bar(f"{steps} equal steps", paper, START, solver=mbs.Exudyn(mbs.Equal(steps)))
    for speed in (0.01, 1e3, 1e5):
        yield four_bar(f"{speed:g} rad/s", paper, START, speed=speed)
    yield four_bar("tolerance 1", paper, START, solver=mbs.Exudyn(mbs.Controlled(1.0)))
    yield four_bar("tolerance 1, one step in all", paper, START, solver=mbs.Exudyn(mbs.Controlled(1.0, 1.0)))


# --- four-bars with clearance ----------------------------------------------------------------------------------------------

LAWS: dict[str, Any] = {"rattling": RATTLING, "closed": CLOSED}
ADAMS = laws.AdamsFriction(static=0.3, dynamic=0.1)


def loose(
    gap: float = 2.5e-4, law: Any = RATTLING, friction: Any = ADAMS, joints: str = "OABC", speed: float = SPEED,
    rocker: Body | None = None,
) -> mbs.Mechanism:  # fmt: skip
    """The paper's crank-rocker with clearance in some joints."""

    def play(point: str, pin: str, bush: str) -> mbs.Clearance:
        return mbs.Clearance(point, pin, bush, 5e-3, gap, law, friction)

    return crank_rocker(rocker or mbs.Rigid(BARS), speed=speed, play=play, with_play=joints, section=BARS, angle=START)


def played(name: str, share: float = 1.0, solver: mbs.Exudyn | None = None, kind: str = "", **given: Any) -> Listed:
    """Make a case with clearance; `share` scales the time run."""
    duration = share * PREDICTABLE * SPEED / given.get("speed", SPEED)
    return Listed(f"four-bar with clearance{kind}", name, partial(loose, **given), duration, solver)


def plays() -> Iterator[Listed]:
    """Number of joints, clearance, stiffness, damping, friction, speed, laws, steps."""
    for name, law in LAWS.items():
        for joints in ("B", "BC", "ABC", "OABC"):
            yield played(f"{joints}, {name}", joints=joints, law=law)
        for gap in (1e-6, 1e-5, 5e-5, 1e-3, 2e-3):
            yield played(f"clearance {1e3 * gap:g} mm, {name}", gap=gap, law=law)
        for rpm in (30, 3000):
            yield played(f"{rpm} r/min, {name}", min(1.0, rpm / 120), law=law, speed=rpm * pi / 30)
        for tolerance in (1e-5, 1e-1, 1.0, 100.0):
            yield played(f"{name}, tolerance {tolerance:g}", solver=mbs.Exudyn(mbs.Controlled(tolerance)), law=law)
        for steps in (20, 100, 1000):
            yield played(f"{name}, {steps} equal steps", solver=mbs.Exudyn(mbs.Equal(steps)), law=law)
        yield played(f"{name}, no step below 1e-5 s", solver=mbs.Exudyn(mbs.Controlled(1e-3, min_step=1e-5)), law=law)
    for times in (1e-4, 1e-2, 0.1, 10.0, 100.0):
        yield played(f"{times:g} times as stiff", law=laws.Impact(RATTLING.stiffness * times, 253.0 * times**0.5, 1e-5))
    frictions = {
        "no friction": laws.NoFriction(),
        "much friction": laws.Coulomb(0.9, 1e-3),
        "friction from 1e-4 m/s": laws.Coulomb(0.3, 1e-4),
        "much friction from 1e-4 m/s": laws.Coulomb(0.9, 1e-4),
        "stiction from 1e-3 m/s": laws.AdamsFriction(0.9, 0.1, 1e-3, 1e-2),
    }
    for name, friction in frictions.items():
        yield played(name, friction=friction)
    for speed in (0.1, 1.0, 100.0, 500.0):
        yield played(f"{speed:g} rad/s", 0.25 if speed < 1 else 1.0, speed=speed)
    for law in (
        laws.Hertz(RATTLING.stiffness),
        laws.HuntCrossley(RATTLING.stiffness, 0.3),
        laws.KelvinVoigt(1e7, 0.0),
        laws.KelvinVoigt(1e7, 300.0),
    ):
        yield played(f"{type(law).__name__}({', '.join(f'{x:.3g}' for x in vars(law).values())})", law=law)


def flexibles() -> Iterator[Listed]:
    """Rockers that are beams, cables and modal links; meshes, laws, steps."""
    wet = BARS.damped(0.01, 0.175)
    bodies = {
        **{f"beam of {n}": mbs.Beam(wet, elements=n) for n in (1, 2, 4)},
        **{f"cable of {n}": mbs.Cable(wet, elements=n) for n in (1, 4)},
        "thin beam": mbs.Beam(mbs.Section(0.02, 0.0005, STEEL).damped(0.01, 0.175), elements=8),
        "modal": mbs.Modal(BARS, damping=0.01),
    }
    case = partial(played, share=0.5, kind=", flexible rocker")
    for name, body in bodies.items():
        for kind, law in LAWS.items():
            yield case(f"{name}, {kind}", law=law, rocker=body)
    for tolerance in (1e-1, 10.0):
        yield case(
            f"beam of 4, tolerance {tolerance:g}", solver=mbs.Exudyn(mbs.Controlled(tolerance)), rocker=mbs.Beam(wet, elements=4)
        )


# --- wrong input -----------------------------------------------------------------------------------------------------------

WRONG: dict[str, Callable[[], Any]] = {
    "thickness 0": lambda: mbs.Section(0.030, 0.0),
    "thickness not a number": lambda: mbs.Section(0.030, nan),
    "modulus negative": lambda: mbs.Material(-210e9, 7850.0),
    "density infinite": lambda: mbs.Material(210e9, inf),
    "no elements": lambda: mbs.Beam(BARS, elements=0),
    "stop stiffness 0": lambda: laws.CarvalhoMartins(0.0, 0.8, exponent=1.0),
    "restitution above 1": lambda: laws.CarvalhoMartins(7.2e4, 1.2, exponent=1.0),
    "contact damping negative": lambda: laws.KelvinVoigt(1e7, -1.0),
    "contact damping depth 0": lambda: laws.Impact(1e9, 1e3, 0.0),
    "friction negative": lambda: laws.Coulomb(-0.1, 1e-3),
    "friction from 0 m/s": lambda: laws.Coulomb(0.1, 0.0),
    "static friction below sliding": lambda: laws.AdamsFriction(0.1, 0.3),
    "guide friction negative": lambda: mbs.GuideFriction.of_weight(-0.1, 0.3),
    "clearance 0": lambda: loose(gap=0.0),
    "clearance negative": lambda: loose(gap=-1e-4),
    "tolerance 0": lambda: mbs.Exudyn(mbs.Controlled(tolerance=0.0)),
    "no steps": lambda: mbs.Exudyn(mbs.Equal(0)),
    "integrator undamped": lambda: mbs.Exudyn(spectral_radius=1.0),
    "speed infinite": lambda: slider("beam", speed=inf),
    "bars that do not reach": lambda: four_bar("", CrankRocker(0.1, 0.05, 0.1, 0.5), 0.5).mechanism(),
}


def wrong() -> Iterator[Listed]:
    """What nothing can compute: it must be refused before the run."""
    for name, make in WRONG.items():
        made = partial(lambda make: (make(), loose())[1], make)
        yield Listed("wrong input", name, made, PREDICTABLE, possible=False)
    for name, duration in {"duration 0": 0.0, "duration negative": -1.0, "duration not a number": nan}.items():
        yield Listed("wrong input", name, loose, duration, possible=False)


def every() -> Iterator[Listed]:
    """All of them."""
    for part in (slider_cranks, pressed_strips, four_bars, plays, flexibles, wrong):
        yield from part()
