"""What a mechanism is made of: links and their bodies, joints, guides, stops, drives. A kind is a line here."""

from buckler.mbs.elements.beam import Beam, Cable
from buckler.mbs.elements.belt import Belt
from buckler.mbs.elements.clearance import Clearance
from buckler.mbs.elements.coupling import Coupling
from buckler.mbs.elements.drive import Drive, Motion, Ramp
from buckler.mbs.elements.element import Body
from buckler.mbs.elements.force import Force
from buckler.mbs.elements.gear import Gear
from buckler.mbs.elements.guide import Guide, GuideFriction
from buckler.mbs.elements.joint import Joint
from buckler.mbs.elements.line_load import LineLoad
from buckler.mbs.elements.link import Link
from buckler.mbs.elements.load import Load
from buckler.mbs.elements.mass import Mass
from buckler.mbs.elements.modal import AdamsDamping, Modal
from buckler.mbs.elements.motor import Motor
from buckler.mbs.elements.rack import Rack
from buckler.mbs.elements.revolute import Revolute
from buckler.mbs.elements.rigid import Inertia, Rigid
from buckler.mbs.elements.rope import Rope
from buckler.mbs.elements.section import STEEL, Material, Profile, Section
from buckler.mbs.elements.slider import Slider, Slot
from buckler.mbs.elements.spring import Spring
from buckler.mbs.elements.states import States
from buckler.mbs.elements.stop import Stop
from buckler.mbs.elements.strut import Strut
from buckler.mbs.elements.torque import Torque
from buckler.mbs.elements.torsion_spring import TorsionSpring
from buckler.mbs.elements.weld import Weld

KINDS: dict[str, type] = {
    "links": Link, "joints": Joint, "guides": Guide, "stops": Stop, "drives": Drive, "loads": Load, "masses": Mass,
    "couplings": Coupling,
}  # fmt: skip
"""What the lists of a mechanism hold: every kind of that."""

__all__ = [
    "KINDS", "STEEL", "AdamsDamping", "Beam", "Belt", "Body", "Cable", "Clearance", "Coupling", "Drive", "Force", "Gear", "Guide",
    "GuideFriction", "Inertia", "Joint", "LineLoad", "Link", "Load", "Mass", "Material", "Modal", "Motion", "Motor", "Profile",
    "Rack", "Ramp", "Revolute", "Rigid", "Rope", "Section", "Slider", "Slot", "Spring", "States", "Stop", "Strut", "Torque",
    "TorsionSpring", "Weld",
]  # fmt: skip
