"""Forces along a measure as functions of it and its rate, compiled: springs, contacts, friction, struts, motors, laws."""

from __future__ import annotations

import numpy as np

from ..laws.calls import call
from . import tables as col
from .compiling import draft
from .lawtable import normal_force, normal_slopes, rubbing, rubbing_slope


@draft
def dry(speed, p):
    """Friction given as a force: dynamic, static minus dynamic, viscous, regularisation and Stribeck speeds."""
    fast = abs(speed) - p[3]
    if fast <= 0.0:
        return (p[0] + p[1]) * speed / p[3]
    return np.sign(speed) * (p[0] + p[1] * np.exp(-fast / p[4]) + p[2] * fast)


@draft
def strut(value, rate, p, address):
    """Tension of a post-buckled strut; p: length, rigidity, unit load, compliance, critical load, damping."""
    stretch = value - p[0]
    if stretch > 0.0:
        return max(0.0, p[1] * stretch + p[5] * rate)
    total = -stretch / p[0]
    if total <= p[3] * p[4]:
        return p[1] * stretch
    bending = max(0.0, total - p[3] * p[4])
    u = max(0.0, total - p[3] * call(address, (bending,)))
    return -p[2] * call(address, (u,))


@draft
def motor(t, speed, p, address):
    """Torque of a DC motor on its link; p: voltage, resistance, constant, gear, friction, dead band, regularisation."""
    voltage = p[0] if address == 0 else call(address, (t,))
    voltage = np.sign(voltage) * max(0.0, abs(voltage) - p[5])
    fast = p[3] * speed
    current = (voltage - p[2] * fast) / p[1]
    return p[3] * (p[2] * current - p[4] * min(max(fast / p[6], -1.0), 1.0))


@draft
def value_along(tables, k, now, value, rate, reaction):
    """Force of row k along its measure; reaction is the multiplier of the constraint it rubs on."""
    t, mem = tables.pace[0] * now.time, now.memory[k]
    kind, number = tables.forces[k, col.KIND], tables.forces[k, col.NUMBERS]
    p = tables.data[number : number + 8]
    if kind == col.LINE_SPRING:
        return -p[0] * (value - p[2]) - p[1] * rate
    if kind == col.CONTACT:
        depth = p[0] * (value - p[1])
        if depth <= 0.0:
            return 0.0
        return -p[0] * normal_force(tables, tables.forces[k, col.LAW_OF], depth, p[0] * rate, mem[col.ONSET])
    if kind == col.DRY:
        return -dry(rate, p)
    if kind == col.SEAT:
        return -rubbing(tables, tables.forces[k, col.FRICTION_OF], rate, mem, now.since)[0] * abs(reaction)
    if kind == col.STRUT:
        return -strut(value, rate, p, tables.laws[tables.forces[k, col.LAW_OF], col.CALL])
    if kind == col.GIVEN:
        address = tables.laws[tables.forces[k, col.LAW_OF], col.CALL] if tables.forces[k, col.LAW_OF] >= 0 else 0
        return p[0] if address == 0 else call(address, (t,))
    if kind == col.MOTOR:
        return motor(t, rate, p, tables.laws[tables.forces[k, col.LAW_OF], col.CALL] if tables.forces[k, col.LAW_OF] >= 0 else 0)
    if p[0] == 1.0:  # a spring's law
        return -call(tables.laws[tables.forces[k, col.LAW_OF], col.CALL], (value - p[2], rate))
    return call(tables.laws[tables.forces[k, col.LAW_OF], col.CALL], (t, value - p[2], rate))


@draft
def slopes_along(tables, k, now, value, rate, reaction):
    """Derivatives of the force along a measure by the measure and its rate."""
    mem = now.memory[k]
    kind, number = tables.forces[k, col.KIND], tables.forces[k, col.NUMBERS]
    p = tables.data[number : number + 8]
    if kind == col.LINE_SPRING:
        return -p[0], -p[1]
    if kind == col.CONTACT:
        depth = p[0] * (value - p[1])
        if depth <= 0.0:
            return 0.0, 0.0
        by_depth, by_rate = normal_slopes(tables, tables.forces[k, col.LAW_OF], depth, p[0] * rate, mem[col.ONSET])
        return -by_depth, -by_rate
    if kind == col.GIVEN:
        return 0.0, 0.0
    if kind == col.SEAT:
        return 0.0, -rubbing_slope(tables, tables.forces[k, col.FRICTION_OF], rate, mem, now.since) * abs(reaction)
    by_value, hr = 0.0, 1e-6 * max(abs(rate), p[6] if kind == col.MOTOR else 1e-3)
    if kind == col.STRUT or kind == col.LAW:
        hv = 1e-6 * max(abs(value), 1e-3) if kind == col.LAW else 1e-4 * max(abs(value - p[0]), 1e-2 * p[3] * p[4] * p[0])
        by_value = (
            value_along(tables, k, now, value + hv, rate, reaction) - value_along(tables, k, now, value - hv, rate, reaction)
        ) / (2.0 * hv)
    by_rate = (
        value_along(tables, k, now, value, rate + hr, reaction) - value_along(tables, k, now, value, rate - hr, reaction)
    ) / (2.0 * hr)
    return by_value, by_rate
