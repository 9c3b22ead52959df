"""What a mechanism is made of: links and their bodies, joints, guides, stops, drives. A kind is a line here."""

from buckler.mbs.elements.beam import Beam, Cable
from buckler.mbs.elements.body import Body
from buckler.mbs.elements.clearance import Clearance
from buckler.mbs.elements.drive import Drive, Motion, Ramp
from buckler.mbs.elements.guide import Guide, GuideFriction
from buckler.mbs.elements.link import Link
from buckler.mbs.elements.modal import Modal
from buckler.mbs.elements.revolute import Revolute
from buckler.mbs.elements.rigid import Inertia, Rigid
from buckler.mbs.elements.section import STEEL, Material, Section
from buckler.mbs.elements.slider import Slider, Slot
from buckler.mbs.elements.stop import Stop
from buckler.mbs.elements.strut import Strut
from buckler.mbs.elements.weld import Weld

KINDS: dict[str, tuple[type, ...]] = {
    "links": (Link,),
    "joints": (Revolute, Clearance, Weld, Slider, Slot),
    "guides": (Guide,),
    "stops": (Stop,),
    "drives": (Drive,),
    "loads": (),
    "masses": (),
}
"""Kinds of element, by the list of a mechanism that holds them."""

__all__ = [
    "KINDS", "STEEL", "Beam", "Body", "Cable", "Clearance", "Drive", "Guide", "GuideFriction", "Inertia", "Link", "Material",
    "Modal", "Motion", "Ramp", "Revolute", "Rigid", "Section", "Slider", "Slot", "Stop", "Strut",
    "Weld",
]  # fmt: skip
