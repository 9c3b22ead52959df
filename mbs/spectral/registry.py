"""Which function makes the kernel's arrays of which kind: one line a kind."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from buckler.mbs.elements.element import Element
from buckler.mbs.elements.link import Link
from buckler.mbs.extensions import extensions
from buckler.mbs.spectral import connectors
from buckler.mbs.spectral.builder import Body, Builder
from buckler.mbs.spectral.connect import connect
from buckler.mbs.spectral.frame_body import add_modal, add_rigid
from buckler.mbs.spectral.strip_body import add_strip
from buckler.mbs.spectral.strut import add_strut
from buckler.mbs.spectral.tables import KIRCHHOFF, REISSNER

BODIES: dict[str, Callable[[Builder, Link], Body]] = {
    "Rigid": add_rigid,
    "Beam": partial(add_strip, kind=REISSNER),
    "Cable": partial(add_strip, kind=KIRCHHOFF),
    "Modal": add_modal,
    "Strut": add_strut,
}
ELEMENTS: dict[str, Callable[..., None]] = {
    "Clearance": connectors.add_clearance,
    "Guide": connectors.add_guide,
    "Stop": connectors.add_stop,
    "Force": connectors.add_force,
    "LineLoad": connectors.add_line_load,
    "Torque": connectors.add_torque,
    "Motor": connectors.add_motor,
    "Spring": connectors.add_spring,
    "TorsionSpring": connectors.add_torsion_spring,
    "Belt": connectors.add_belt,
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
