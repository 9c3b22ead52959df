"""Elements of a mechanism: links and their bodies, joints, guides, stops, drives, loads, masses, couplings."""

from .beam import Beam, Cable
from .clearance import Clearance
from .coupling import Belt, Coupling, Gear, Rack, Rope
from .drive import Drive, Motion, Ramp
from .element import Body
from .force import Force, LineLoad, Torque
from .guide import Guide, GuideFriction
from .joint import Joint, Revolute, Slider, Slot, Weld
from .link import Link
from .load import Load, States
from .modal import AdamsDamping, Modal
from .motor import Motor
from .rigid import Mass, Rigid
from .section import STEEL, Material, Profile, Section
from .spring import Spring, TorsionSpring
from .stop import Stop
from .strut import Strut

KINDS: dict[str, type] = {
    "links": Link, "joints": Joint, "guides": Guide, "stops": Stop, "drives": Drive, "loads": Load, "masses": Mass,
    "couplings": Coupling,
}  # fmt: skip
"""Base class of the elements in each list of a mechanism."""

__all__ = [
    "KINDS", "STEEL", "AdamsDamping", "Beam", "Belt", "Body", "Cable", "Clearance", "Coupling", "Drive", "Force", "Gear", "Guide",
    "GuideFriction", "Joint", "LineLoad", "Link", "Load", "Mass", "Material", "Modal", "Motion", "Motor", "Profile",
    "Rack", "Ramp", "Revolute", "Rigid", "Rope", "Section", "Slider", "Slot", "Spring", "States", "Stop", "Strut", "Torque",
    "TorsionSpring", "Weld",
]  # fmt: skip
