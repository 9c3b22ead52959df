"""Elements of a mechanism: links and their bodies, joints, guides, stops, drives. A kind is a line here."""

from .beam import Beam, Cable
from .belt import Belt
from .clearance import Clearance
from .coupling import Coupling
from .drive import Drive, Motion, Ramp
from .element import Body
from .force import Force
from .gear import Gear
from .guide import Guide, GuideFriction
from .joint import Joint
from .line_load import LineLoad
from .link import Link
from .load import Load
from .mass import Mass
from .modal import AdamsDamping, Modal
from .motor import Motor
from .rack import Rack
from .revolute import Revolute
from .rigid import Inertia, Rigid
from .rope import Rope
from .section import STEEL, Material, Profile, Section
from .slider import Slider, Slot
from .spring import Spring
from .states import States
from .stop import Stop
from .strut import Strut
from .torque import Torque
from .torsion_spring import TorsionSpring
from .weld import Weld

KINDS: dict[str, type] = {
    "links": Link, "joints": Joint, "guides": Guide, "stops": Stop, "drives": Drive, "loads": Load, "masses": Mass,
    "couplings": Coupling,
}  # fmt: skip
"""Base class of the elements in each list of a mechanism."""

__all__ = [
    "KINDS", "STEEL", "AdamsDamping", "Beam", "Belt", "Body", "Cable", "Clearance", "Coupling", "Drive", "Force", "Gear", "Guide",
    "GuideFriction", "Inertia", "Joint", "LineLoad", "Link", "Load", "Mass", "Material", "Modal", "Motion", "Motor", "Profile",
    "Rack", "Ramp", "Revolute", "Rigid", "Rope", "Section", "Slider", "Slot", "Spring", "States", "Stop", "Strut", "Torque",
    "TorsionSpring", "Weld",
]  # fmt: skip
