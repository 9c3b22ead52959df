"""Which kind becomes what in the engine: a kind is a line here."""

from __future__ import annotations

from collections.abc import Callable

from buckler.mbs import elements
from buckler.mbs.elements.element import Element
from buckler.mbs.engine import clearance, guide, loads, modal, rigid, rows, stop, strip
from buckler.mbs.engine.placed import Placed
from buckler.mbs.engine.scene import Scene
from buckler.mbs.extensions import extensions
from buckler.mbs.geometry import Array

BODIES: dict[type, Callable[[Scene, elements.Link, Array], Placed | None]] = {
    elements.Rigid: rigid.add,
    elements.Beam: strip.add,
    elements.Cable: strip.add,
    elements.Modal: modal.add,
    elements.Strut: loads.add_strut,
}
"""Adds a link: (scene, link, velocity of its start) -> Placed, or None if it has no coordinates."""

CONNECTORS: dict[type, Callable[..., None]] = {
    elements.Revolute: rows.connect,
    elements.Clearance: clearance.connect,
    elements.Weld: rows.connect,
    elements.Slider: rows.add_sliders,
    elements.Slot: rows.add_sliders,
    elements.Guide: guide.connect,
    elements.Strut: loads.join_struts,
    elements.Stop: stop.connect,
    elements.Drive: loads.add_drives,
    elements.Force: loads.add_forces,
    elements.LineLoad: loads.add_line_loads,
    elements.Torque: loads.add_torques,
    elements.Motor: loads.add_motors,
    elements.Spring: loads.add_springs,
    elements.TorsionSpring: loads.add_torsion_springs,
    elements.Mass: loads.add_masses,
    elements.Belt: loads.add_belts,
}
"""Adds all elements of a kind once the bodies stand: (scene, elements by name)."""


def connect(scene: Scene) -> None:
    """Add all elements once the bodies stand: in the order of `CONNECTORS`; a kind without a line there by its rows."""
    found: dict[type, dict[str, Element]] = {kind: {} for kind in CONNECTORS}
    for name, element in scene.mechanism.elements().items():
        body = type(element.body) if isinstance(element, elements.Link) else None
        if body is None or body in CONNECTORS:
            found.setdefault(body or type(element), {})[name] = element
    for kind, each in found.items():
        known = CONNECTORS.get(kind) or extensions("buckler.exudyn").get(kind.__name__)
        if known is None and not all(any(element.rows(scene.mechanism)) for element in each.values()):
            raise ValueError(f"{kind.__name__}: Exudyn's scene does not know this kind, and it has no rows")
        (known or rows.connect)(scene, each)
