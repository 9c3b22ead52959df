"""Planar mechanisms that buckle, rattle and strike. An import loads no solver; `simulate` loads the one it needs."""

from typing import TYPE_CHECKING

from .elements.beam import Beam, Cable
from .elements.clearance import Clearance
from .elements.coupling import Belt, Gear, Rack, Rope
from .elements.drive import Drive, Motion, Ramp
from .elements.force import Force, LineLoad, Torque
from .elements.guide import Guide, GuideFriction
from .elements.joint import Revolute, Slider, Slot, Weld
from .elements.link import Link
from .elements.load import States
from .elements.modal import AdamsDamping, Modal
from .elements.motor import Motor
from .elements.rigid import Mass, Rigid
from .elements.section import STEEL, Material, Profile, Section
from .elements.spring import Spring, TorsionSpring
from .elements.stop import Stop
from .elements.strut import Strut
from .imports import lazy_attributes
from .library import crank_rocker, slider_crank
from .mechanism import Mechanism
from .record.errors import Status
from .record.result import Result
from .solvers import Closure, Controlled, Equal, Exudyn, Spectral  # Controlled and Equal: lengths of steps

if TYPE_CHECKING:
    from .engine.build import build
    from .ensembles.ensemble import ensemble
    from .sensitivity.derivatives import sensitivities
    from .sensitivity.design import optimise
    from .sensitivity.fitting import fit
    from .simulation import simulate
    from .statics.cycles import periodic
    from .statics.follow import path
    from .statics.resonance import response
    from .statics.rest import equilibrium
    from .statics.vibration import frequencies

__all__ = [
    "STEEL", "AdamsDamping", "Beam", "Belt", "Cable", "Clearance", "Closure", "Controlled", "Drive", "Equal", "Exudyn",
    "Force", "Gear", "Guide", "GuideFriction", "LineLoad", "Link", "Mass", "Material", "Mechanism", "Modal", "Motion", "Motor",
    "Profile", "Rack", "Ramp", "Result", "Revolute", "Rigid", "Rope", "Section", "Slider", "Slot", "Spectral", "Spring",
    "States", "Status", "Stop", "Strut", "Torque", "TorsionSpring", "Weld", "build", "crank_rocker", "ensemble", "equilibrium",
    "fit", "frequencies", "optimise", "path", "periodic", "response", "sensitivities", "simulate", "slider_crank",
]  # fmt: skip

__getattr__ = lazy_attributes(__name__, {
    "simulate": "simulation", "build": "engine.build", "ensemble": "ensembles.ensemble", "equilibrium": "statics.rest",
    "path": "statics.follow", "frequencies": "statics.vibration", "periodic": "statics.cycles", "response": "statics.resonance",
    "sensitivities": "sensitivity.derivatives", "fit": "sensitivity.fitting", "optimise": "sensitivity.design",
})  # fmt: skip
"""Names whose modules need a solver, imported at first use."""


def __dir__() -> list[str]:
    """Return the public names, which include those imported at first use."""
    return sorted(__all__)
