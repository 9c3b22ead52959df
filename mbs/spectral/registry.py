"""Which function makes the kernel's arrays of which kind: one line a kind."""

from __future__ import annotations

from collections.abc import Callable

from buckler.mbs.elements.element import Element
from buckler.mbs.elements.link import Link
from buckler.mbs.extensions import extensions
from buckler.mbs.spectral.beam import add_beam
from buckler.mbs.spectral.belt import add_belt
from buckler.mbs.spectral.builder import Body, Builder
from buckler.mbs.spectral.cable import add_cable
from buckler.mbs.spectral.clearance import add_clearance
from buckler.mbs.spectral.connect import connect
from buckler.mbs.spectral.force import add_force
from buckler.mbs.spectral.guide import add_guide
from buckler.mbs.spectral.line_load import add_line_load
from buckler.mbs.spectral.modal import add_modal
from buckler.mbs.spectral.motor import add_motor
from buckler.mbs.spectral.rigid import add_rigid
from buckler.mbs.spectral.spring import add_spring
from buckler.mbs.spectral.stop import add_stop
from buckler.mbs.spectral.strut import add_strut
from buckler.mbs.spectral.torque import add_torque
from buckler.mbs.spectral.torsion_spring import add_torsion_spring

BODIES: dict[str, Callable[[Builder, Link], Body]] = {
    "Rigid": add_rigid,
    "Beam": add_beam,
    "Cable": add_cable,
    "Modal": add_modal,
    "Strut": add_strut,
}
ELEMENTS: dict[str, Callable[..., None]] = {
    "Clearance": add_clearance,
    "Guide": add_guide,
    "Stop": add_stop,
    "Force": add_force,
    "LineLoad": add_line_load,
    "Torque": add_torque,
    "Motor": add_motor,
    "Spring": add_spring,
    "TorsionSpring": add_torsion_spring,
    "Belt": add_belt,
}


def add_element(builder: Builder, name: str, element: Element) -> None:
    """Add a joint, guide, stop, load, drive or coupling of this name; a kind without a line here by its rows."""
    kind = type(element).__name__
    add = ELEMENTS.get(kind) or extensions("buckler.spectral").get(kind)
    if add is None and not any(element.rows(builder.mechanism)):
        raise _unknown(kind)
    (add or connect)(builder, name, element)


def add_body(builder: Builder, link: Link) -> Body:
    """Add a link."""
    kind = type(link.body).__name__
    if kind not in BODIES:
        raise _unknown(kind)
    return BODIES[kind](builder, link)


def _unknown(kind: str) -> ValueError:
    return ValueError(f"{kind}: the compiled solver does not know this kind, and it has no rows")
