"""Functions that add a link or an element to the lists of the compiled solver, and tables that give the function of a kind.

The order of a force's `numbers` is the one in which `lawtable` and `forces` read them for its kind.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import cast

from ..elements import Clearance, Force, Guide, LineLoad, Motor, Spring, Stop, Torque, TorsionSpring
from ..elements.element import GROUND, Element, place
from ..elements.link import Link
from ..elements.motor import CREEP
from ..elements.references import angle_reference, holder_reference
from ..functions import TURN, component_functions
from ..imports import extensions
from ..laws import BristleLaw, FrictionLaw
from ..laws.compiled import function_pointer
from ..laws.contact import add_friction, add_normal
from .basis import gauss
from .builder import NO_LAW, Builder, BuiltBody
from .connect import connect, marker_at, resolve_in_axes
from .frame_body import add_modal, add_rigid
from .strip_body import StripBody, add_strip
from .strut import add_strut
from .tables import ForceKind, MeasureKind, State, StripKind


def add_clearance(builder: Builder, name: str, joint: Clearance) -> None:
    """Add the contact of the first body's pin in the second's bush; its numbers are radius of the pin and clearance [m]."""
    a, b = builder.marker(joint.first, joint.point), builder.marker(joint.second, joint.point)
    law, friction = add_normal(builder, joint.law), add_friction(builder, joint.friction)
    builder.add_force(name, ForceKind.JOURNAL, a, b, law=law, friction=friction, numbers=(joint.pin, joint.gap))


def add_guide(builder: Builder, name: str, guide: Guide) -> None:
    """Add the constraint of a link's point to a line of the ground, and friction along the line."""
    row = len(builder.rows)  # index of the one constraint that `connect` adds; its reaction is the normal force of the friction
    connect(builder, name, guide)
    friction = guide.friction
    if friction is None:
        return
    a, b = builder.marker(guide.link, guide.point), builder.marker(GROUND, guide.point)
    along = builder.add_measure(MeasureKind.FIXED, a, b, guide.along)
    if isinstance(friction, FrictionLaw | BristleLaw):
        builder.add_force(name, ForceKind.FRICTION, along, friction=add_friction(builder, friction), row=row)
        return
    # a `GuideFriction`, which depends on the speed alone
    numbers = (friction.dynamic, friction.static_offset, friction.viscous, friction.regularisation, friction.stribeck)
    builder.add_force(name, ForceKind.GUIDE_FRICTION, along, numbers=numbers)


def add_stop(builder: Builder, name: str, stop: Stop) -> None:
    """Add the contact of a point with a face, and friction along it; the point stays on the side on which it starts."""
    mechanism = builder.mechanism
    across = stop.face_normal(mechanism)
    a, origin = builder.marker(stop.body(mechanism), stop.point), place(stop.origin(mechanism))
    b = builder.marker(origin.body, origin.point)  # origin: a point fixed in the body of the face; a: the point that strikes
    arm = [mechanism.points[stop.point][i] - mechanism.points[origin.point][i] for i in range(2)]
    start = arm[0] * across[0] + arm[1] * across[1]  # distance of the point from the origin b, across the face, at t = 0
    face = start + stop.distance_to_face(mechanism)  # distance of the face from the origin b

    def add_distance(direction: tuple[float, float]) -> int:
        """Add as a measure the point's distance from the origin b along a direction that turns with the face."""
        if stop.carrier == GROUND:
            return builder.add_measure(MeasureKind.FIXED, a, b, direction)
        return builder.add_measure(MeasureKind.TURNING, a, b, resolve_in_axes(builder, b, direction))

    side = stop.side(mechanism)  # 1 if `across` leads from the point to the face, else -1
    law, numbers = add_normal(builder, stop.law), (side, face)
    contact = builder.add_force(name, ForceKind.CONTACT, add_distance(across), law=law, numbers=numbers)
    if stop.friction_at != "":  # it has friction
        friction, along = add_friction(builder, stop.friction), add_distance((-across[1], across[0]))
        # the normal force is that of the contact: for friction, b is the index of a contact, not of a marker
        builder.add_force(name, ForceKind.FRICTION, along, b=contact, friction=friction)


def add_force(builder: Builder, name: str, load: Force) -> None:
    """Add a force: constant, a function of time, or a law with states; its direction is fixed, or turns with a link."""
    followed = load.turns_with(builder.mechanism)  # reference to the point with whose angle the force turns, or None
    a = marker_at(builder, holder_reference(builder.mechanism, load.point))
    if load.states is not None:
        builder.add_stateful(name, load, a, column=State.X, offset=0.0)  # its law gets this column and the next, y
        return
    b = builder.add_ground() if followed is None else marker_at(builder, followed)
    line_of_action = [] if load.through is None else [1.0, *load.through]  # 1: there is a point through which it goes
    law, x, y = NO_LAW, 0.0, 0.0
    if callable(load.value):
        law = _add_function(builder, load.value, ["t"], f"the function of {name}", components=2)
    else:
        x, y = load.value
    builder.add_force(name, ForceKind.POINT_FORCE, a, b, law=law, numbers=[x, y, builder.angle_of(b), *line_of_action])


def _add_function(builder: Builder, function: object, variables: Sequence[str], about: str, components: int = 1) -> int:
    """Add a law that consists of a function for each component, without numbers; return its index."""
    pointers = [function_pointer(each, len(variables)) for each in component_functions(function, variables, components)]
    return builder.add_law(key=None, kind=ForceKind.LAW, numbers=(), pointers=pointers, about=about)


def add_line_load(builder: Builder, name: str, load: LineLoad) -> None:
    """Add a line load by Gauss quadrature: at each point of the strip a force and a moment, times the weight [m]."""
    strip = cast(StripBody, builder.bodies[load.link])
    ground = builder.add_ground()
    for i, piece in enumerate(strip.pieces):
        # degree + 1 points integrate squares of the polynomials exactly; two more, chosen, as in `SpectralStrip.quadrature`
        points, weights = gauss(piece.degree + 3)
        for x, w in zip(points, weights, strict=True):
            weight = float(w) * piece.half_length
            marker = strip.marker_at(builder, piece.start + (1.0 + float(x)) * piece.half_length, i)
            if any(load.force):
                b = marker if load.turns else ground
                numbers = [*(weight * each for each in load.force), builder.angle_of(b)]
                builder.add_force(name, ForceKind.POINT_FORCE, marker, b, numbers=numbers)
            if load.moment:
                measure = builder.add_measure(MeasureKind.ANGLE, marker, ground)
                builder.add_force(name, ForceKind.PRESCRIBED, measure, numbers=(weight * load.moment,))


def add_torque(builder: Builder, name: str, load: Torque) -> None:
    """Add a torque: constant, a function of time, angle since t = 0 and speed, or a law with states."""
    marker = marker_at(builder, angle_reference(builder.mechanism, load.link))
    if load.states is not None:
        angle_at_start = builder.angle_of(marker)  # its law gets the angle less this one
        builder.add_stateful(name, load, marker, column=State.ANGLE, offset=angle_at_start)
        return
    measure = builder.add_measure(MeasureKind.ANGLE, marker, builder.add_ground())
    if not callable(load.value):
        builder.add_force(name, ForceKind.PRESCRIBED, measure, numbers=(float(load.value),))
        return
    law = _add_function(builder, load.value, TURN, f"the function of {name}")  # of time, angle and speed
    is_spring, angle_at_start = 0.0, builder.angle_of(marker)  # `LawData`: the torque is law(t, angle since t = 0, speed)
    builder.add_force(name, ForceKind.LAW, measure, law=law, numbers=(is_spring, angle_at_start))


def add_motor(builder: Builder, name: str, load: Motor) -> None:
    """Add the torque of a `Motor`, whose voltage is constant or a function of time."""
    marker = marker_at(builder, angle_reference(builder.mechanism, load.link))
    measure = builder.add_measure(MeasureKind.ANGLE, marker, builder.add_ground())
    law, voltage = NO_LAW, 0.0
    if callable(load.voltage):
        law = _add_function(builder, load.voltage, ["t"], f"the voltage of {name}")
    else:
        voltage = load.voltage
    # CREEP: speed of the rotor [rad/s] below which its friction falls linearly to zero
    numbers = (voltage, load.resistance, load.constant, load.gear, load.friction, load.dead_band, CREEP)
    builder.add_force(name, ForceKind.MOTOR, measure, law=law, numbers=numbers)


def add_spring(builder: Builder, name: str, load: Spring) -> None:
    """Add a spring and damper between two points, linear or with a law."""
    a, b = (marker_at(builder, holder_reference(builder.mechanism, at)) for at in (load.a, load.b))
    add_spring_force(builder, name, load, builder.add_measure(MeasureKind.DISTANCE, a, b), load.free(builder.mechanism))


def add_spring_force(builder: Builder, name: str, load: Spring | TorsionSpring, measure: int, free: float) -> None:
    """Add the force of a spring along a measure l: -k (l - l0) - c l', or -law(l - l0, l'); l0 is `free`."""
    if load.law is None:
        builder.add_force(name, ForceKind.SPRING, measure, numbers=(load.stiffness, load.damping, free))
        return
    law, is_spring = _add_function(builder, load.law, ["x", "v"], f"the law of {name}"), 1.0
    builder.add_force(name, ForceKind.LAW, measure, law=law, numbers=(is_spring, free))  # `LawData`: the force is -law(x, v)


def add_torsion_spring(builder: Builder, name: str, load: TorsionSpring) -> None:
    """Add a spring and damper on the angle of the second body less that of the first; `free_angle` counts from t = 0."""
    first, second = (marker_at(builder, at) for at in load.ends(builder.mechanism))
    free = builder.angle_of(second) - builder.angle_of(first) + (load.free_angle or 0.0)
    add_spring_force(builder, name, load, builder.add_measure(MeasureKind.ANGLE, second, first), free)


BODIES: dict[str, Callable[[Builder, Link], BuiltBody]] = {  # by the class of `link.body`
    "Rigid": add_rigid,
    "Beam": partial(add_strip, kind=StripKind.REISSNER),
    "Cable": partial(add_strip, kind=StripKind.KIRCHHOFF),
    "Modal": add_modal,
    "Strut": add_strut,
}
ELEMENTS: dict[str, Callable[..., None]] = {  # by the element's class; other packages register theirs as entry points
    "Clearance": add_clearance,
    "Guide": add_guide,
    "Stop": add_stop,
    "Force": add_force,
    "LineLoad": add_line_load,
    "Torque": add_torque,
    "Motor": add_motor,
    "Spring": add_spring,
    "TorsionSpring": add_torsion_spring,
}


def add_element(builder: Builder, name: str, element: Element) -> None:
    """Add a joint, guide, stop, load, drive or coupling; one of a kind that is not in the table is added by its constraints."""
    kind = type(element).__name__
    add = ELEMENTS.get(kind) or extensions("buckler.spectral").get(kind)
    if add is None and not any(element.rows(builder.mechanism)):  # it has no row, as each row is true
        raise ValueError(f"{kind}: the compiled solver does not know this kind, and it has no rows")
    (add or connect)(builder, name, element)


def add_body(builder: Builder, link: Link) -> BuiltBody:
    """Add a link; return its body."""
    kind = type(link.body).__name__
    if kind not in BODIES:
        raise ValueError(f"{kind}: the compiled solver does not know this kind of link")
    return BODIES[kind](builder, link)
