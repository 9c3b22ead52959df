"""Who holds and who takes the energy: the balance any run can be asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from buckler.mbs.engine.joints import StrutSpring
from buckler.mbs.mechanism import Beam, Cable, Guide, GuideFriction, Rigid
from buckler.mbs.modal.spec import Modal
from buckler.mbs.record.contacts import energies
from buckler.mbs.record.signals import History, drive_power, strut_state

Array = np.ndarray[Any, Any]
STRUT_POINTS = 400


def ledger(history: History) -> dict[str, Array]:
    """Energies over the run, J, each of shape (times,).

    Returns
    -------
    dict
        Held: `kinetic`, `strain`, `contact`, `weight`. Taken since t = 0: `taken_contact`, `taken_friction`, `taken_damping`.
        Given since t = 0: `given_drive`. `error` = change of what is held + taken - given. `throughput`: the most that was
        held and taken by then, the measure for the error. Of each joint with play `<point>.taken_contact` and `.taken_friction`.
    """
    held = {"kinetic": _kinetic(history), "strain": _strain(history)}
    taken = {"taken_damping": _since_start(history, _damping_power(history))}
    single: dict[str, Array] = {}
    if history.scene.stops:
        potential, power = _contact(history)
        held["contact"] = potential
        taken["taken_contact"] = _since_start(history, power) - (potential - potential[0])
    for group in range(len(history.scene.clearances)):
        potential, lost, rubbed = energies(history, group)
        held["contact"] = held.get("contact", 0.0) + potential.sum(axis=1)
        taken["taken_contact"] = taken.get("taken_contact", 0.0) + lost.sum(axis=1)
        taken["taken_friction"] = taken.get("taken_friction", 0.0) + rubbed.sum(axis=1)
        for j, joint in enumerate(history.scene.clearances[group].joints):
            single |= {f"{joint.point}.taken_contact": lost[:, j], f"{joint.point}.taken_friction": rubbed[:, j]}
    if any(guide.friction for guide in history.scene.mechanism.guides):
        taken["taken_friction"] = taken.get("taken_friction", 0.0) + _since_start(history, _friction_power(history))
    if any(history.scene.mechanism.gravity):
        held["weight"] = _weight(history)
    given = np.zeros_like(history.time)
    if history.scene.mechanism.drive is not None:
        given = _since_start(history, drive_power(history))
    zero = np.zeros_like(history.time)
    total, lost = sum(held.values(), zero), sum(taken.values(), zero)
    error = total - total[0] + lost - given
    active = sum((value - value.min() if name == "weight" else value) for name, value in held.items())
    throughput = np.maximum.accumulate(active + lost)
    return {**held, **taken, "given_drive": given, "error": error, "throughput": throughput, **single}


def _since_start(history: History, power: Array) -> Array:
    return cumulative_trapezoid(power, history.time, initial=0.0)


def _strips(history: History) -> list[Any]:
    names = [link.name for link in history.scene.mechanism.links if isinstance(link.body, Beam | Cable | Modal)]
    return [history.strip(name) for name in names]


def _masses(history: History) -> list[tuple[Array, float, float]]:
    """Rigid links and sliders: columns, mass, moment of inertia about the centre."""
    found = []
    for placed in history.scene.placed.values():
        columns = placed.columns(history.scene.system)[0]
        if isinstance(placed.body, Guide):
            found.append((columns, placed.body.mass, 0.0))
        elif isinstance(placed.body, Rigid):
            length, section = history.scene.mechanism.length(placed.name), placed.body.section
            mass = section.mass_per_length * length
            found.append((columns, mass, mass * (length**2 + section.thickness**2) / 12))
    return found


def _kinetic(history: History) -> Array:
    total = sum((strip.kinetic() for strip in _strips(history)), np.zeros_like(history.time))
    for columns, mass, inertia in _masses(history):
        speed = history.q_t[:, columns]
        total = total + 0.5 * mass * (speed[:, :2] ** 2).sum(axis=1)
        if inertia:
            total = total + 0.5 * inertia * speed[:, 2] ** 2
    return total


def _strain(history: History) -> Array:
    total = np.zeros_like(history.time)
    for strip in _strips(history):
        total = total + sum(strain.energy for strain in strip.strains())
    for name, spring in history.scene.struts.items():
        total = total + _strut_energy(spring, strut_state(history, name)[0])
    return total


def _strut_energy(spring: StrutSpring, elongation: Array) -> Array:
    """Work of a strut's force: exact on the straight branch, Gauss quadrature of its force law beyond it."""
    straight = 0.5 * spring.rigidity * np.maximum(elongation, spring.kink) ** 2
    deepest = float(elongation.min())
    if deepest >= spring.kink:
        return straight
    grid = spring.kink + (deepest - spring.kink) * np.linspace(0, 1, STRUT_POINTS)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    half = np.diff(grid)[:, None] / 2
    force = np.array([[spring.elastic(float(e)) for e in row] for row in grid[:-1, None] + half + half * nodes])
    work = np.concatenate([[0.0], np.cumsum((force * weights * half).sum(axis=1))])
    return straight + np.interp(-elongation, -grid, work, left=0.0)


def _damping_power(history: History) -> Array:
    total = np.zeros_like(history.time)
    for strip in _strips(history):
        total = total + sum(strain.power for strain in strip.strains())
    for name, spring in history.scene.struts.items():
        total = total + spring.damping_power(*strut_state(history, name))
    return total


def _contact(history: History) -> tuple[Array, Array]:
    """Elastic potential of all stops, and the power into them."""
    potential, power = np.zeros_like(history.time), np.zeros_like(history.time)
    for k, contact in enumerate(history.scene.stops.values()):
        column = history.scene.placed[contact.stop.point].columns(history.scene.system)[0, 0]
        potential = potential + contact.stop.law.potential(contact.depth(history.q[:, column]))
        power = power + history.contact[:, k] * contact.side * history.q_t[:, column]
    return potential, power


def _friction_power(history: History) -> Array:
    total = np.zeros_like(history.time)
    for guide in history.scene.mechanism.guides:
        if guide.friction is not None:
            column = history.scene.placed[guide.point].columns(history.scene.system)[0, 0]
            speed = history.q_t[:, column]
            total = total + friction_force(guide.friction, speed) * speed
    return total


def friction_force(friction: GuideFriction, speed: Array) -> Array:
    """Friction force along the speed, N; odd in it (see `GuideFriction`)."""
    size = np.abs(speed)
    beyond = np.maximum(size - friction.regularisation, 0.0)
    sliding = friction.dynamic + friction.static_offset * np.exp(-beyond / friction.stribeck) + friction.viscous * beyond
    creeping = (friction.dynamic + friction.static_offset) * size / friction.regularisation
    return np.sign(speed) * np.where(size <= friction.regularisation, creeping, sliding)


def _weight(history: History) -> Array:
    """Potential of gravity, J."""
    gravity = np.array(history.scene.mechanism.gravity)
    total = np.zeros_like(history.time)
    for strip in _strips(history):
        total = total - strip.centre_integral() @ gravity
    for placed in history.scene.placed.values():
        columns = placed.columns(history.scene.system)[0]
        if isinstance(placed.body, Rigid):
            place = history.q[:, columns[:2]] + placed.reference[0, :2]
            section = placed.body.section
            mass = section.mass_per_length * history.scene.mechanism.length(placed.name)
            total = total - mass * place @ gravity
        elif isinstance(placed.body, Guide):
            total = total - placed.body.mass * np.outer(history.q[:, columns[0]], placed.along) @ gravity
    return total
