"""What suits a mechanism: which integrator, which tolerance, which steps. It needs no engine."""

from __future__ import annotations

from buckler.mbs.elements.clearance import clearances
from buckler.mbs.mechanism import Mechanism

STIFF = 1e5
"""Decay rate of contact damping, 1/s, from which the implicit integrator is the faster one."""
WITHOUT_PLAY, WITH_PLAY, DAMPED_PLAY = 1e-5, 1e-3, 3e-5
"""Default tolerances of scenes without and with clearance in joints, and with clearance that is stiffly damped: there an impact's
force jumps and decays within a microsecond; a quarter of it may be missed at 1e-3, 2 % at 3e-5."""


def is_loose(mechanism: Mechanism) -> bool:
    """True if an explicit integrator suits: rigid links, play in all joints, no stiff damper, constant drive speed, no states."""
    return (
        bool(mechanism.joints)
        and len(clearances(mechanism)) == len(mechanism.joints)
        and not any(link.body.flexible for link in mechanism.links)
        and not any(each.integrated for each in mechanism.loads)
        and not (mechanism.guides or mechanism.stops or mechanism.couplings)
        and all(isinstance(drive.speed, int | float) for drive in mechanism.drives)
        and not stiffly_damped(mechanism)
    )


def stiffly_damped(mechanism: Mechanism) -> bool:
    """True if a joint with clearance damps the lightest link at a rate beyond `STIFF`; False without clearance."""
    laws = [joint.law for joint in clearances(mechanism)]
    if not laws:
        return False
    lightest = min(link.mass(mechanism.length(link.name)) for link in mechanism.links)
    depth, speed = 1e-5, 1e-3
    jumps = [law.force(depth, speed, 0.1) - law.force(depth, 0.0, 0.1) for law in laws]
    return max(jumps) / speed / lightest >= STIFF


def usual_tolerance(mechanism: Mechanism) -> float:
    """Tolerance of a run that asks for none."""
    if not clearances(mechanism):
        return WITHOUT_PLAY
    return DAMPED_PLAY if stiffly_damped(mechanism) else WITH_PLAY


def position_error(mechanism: Mechanism, tolerance: float | None) -> float:
    """Local position error allowed a step, m, by a tolerance or by the usual one."""
    size = max(mechanism.length(link.name) for link in mechanism.links)
    gaps = [0.1 * joint.gap for joint in clearances(mechanism)]
    return (tolerance or usual_tolerance(mechanism)) * min([size, *gaps])
