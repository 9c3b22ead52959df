"""Laws compiled for the solver: those of `buckler.mbs.laws.table`, motions of drives, and forces along a measure.

Arguments are the index `law` of a law, the index k of a force, and the memory `mem` of a force (4,). The meaning of the
numbers `p` of a force (7,) depends on its kind. `now` is an `Instant`, `onset` the speed of a contact at its onset [m/s].
Functions of time are taken at `tables.time_factor[0]` times the time: so studies vary the speed.
"""

from enum import IntEnum

import numpy as np

from ..laws import table
from ..laws.table import FrictionKind, LawColumn, call
from .compiling import compile_law, kernel_function
from .tables import FORCE_NUMBERS, ForceKind, Forces, Memory, MotionKind

LawData = IntEnum("LawData", "IS_SPRING OFFSET", start=0)
"""Numbers of a LAW: 1 for the law of a spring, a function of its argument and rate, 0 for one that depends on time, too; value of
the measure at which the argument is 0."""
normal_force, friction = compile_law(table.normal_force), compile_law(table.friction)
bristle_rate, bristle_after = compile_law(table.bristle_rate), compile_law(table.bristle_after)
JUST_AFTER = 1e-6
"""Step [s] of the difference for a drive's acceleration just after a time, short compared with any motion."""
JUST_BEFORE = -JUST_AFTER
"""Step [s] of the difference just before a time, which is another one at a kink of the speed."""


@kernel_function
def differentiate_normal(tables, law, depth, rate, onset):
    """Return the derivatives of the normal force by depth and rate, by central differences."""
    # depth and onset are above 0; 1e-5: cube root of rounding, the best step of such a difference
    h, h_rate = 1e-5 * depth, 1e-5 * (abs(rate) + onset)
    by_depth = normal_force(tables, law, depth + h, rate, onset) - normal_force(tables, law, depth - h, rate, onset)
    by_rate = normal_force(tables, law, depth, rate + h_rate, onset) - normal_force(tables, law, depth, rate - h_rate, onset)
    return by_depth / (2.0 * h), by_rate / (2.0 * h_rate)


@kernel_function
def evaluate_friction(tables, law, speed, mem, since):
    """Return friction coefficient and bristle deflection [m] at a sliding speed [m/s]; laws without bristle return 0."""
    kind = tables.laws[law, LawColumn.KIND]
    if kind != FrictionKind.LUGRE and kind != FrictionKind.BRISTLE_CALLED:
        return friction(tables, law, speed, 0.0), 0.0
    bristle = mem[Memory.BRISTLE]
    if since >= 0.0:  # it is the deflection `since` [s] ago; else a state of the integrator, at present
        bristle = bristle_after(tables, law, mem[Memory.BRISTLE], 0.5 * (mem[Memory.SLIDING] + speed), since)
    return friction(tables, law, speed, bristle), bristle


@kernel_function
def differentiate_friction(tables, law, speed, mem, since):
    """Return the derivative of the friction coefficient by the speed, by central differences."""
    h = 1e-6 * max(abs(speed), 1e-4)  # m/s: far below the speeds over which friction laws change; chosen
    upper, lower = evaluate_friction(tables, law, speed + h, mem, since), evaluate_friction(tables, law, speed - h, mem, since)
    return (upper[0] - lower[0]) / (2.0 * h)


@kernel_function
def evaluate_motion(tables, law, t):
    """Return travel and speed of a drive at time t; `law` is that of its motion."""
    factor = tables.time_factor[0]
    t = factor * t
    if tables.laws[law, LawColumn.KIND] == MotionKind.RAMP:
        first, last, duration = tables.law_numbers[law, 0], tables.law_numbers[law, 1], tables.law_numbers[law, 2]
        on_ramp, slope = min(t, duration), (last - first) / duration  # time on the ramp, rate of the speed on it
        # the last speed stays
        return first * on_ramp + 0.5 * slope * on_ramp * on_ramp + last * (t - on_ramp), factor * (first + slope * on_ramp)
    travel, speed = tables.laws[law, LawColumn.FIRST_ADDRESS], tables.laws[law, LawColumn.SECOND_ADDRESS]
    return call(travel, (t,)), factor * call(speed, (t,))


@kernel_function
def evaluate_acceleration(tables, law, t, side):
    """Return the acceleration of a drive just after time t if `side` is JUST_AFTER, just before it if JUST_BEFORE."""
    factor = tables.time_factor[0]
    t = factor * t
    if tables.laws[law, LawColumn.KIND] == MotionKind.RAMP:
        first, last, duration = tables.law_numbers[law, 0], tables.law_numbers[law, 1], tables.law_numbers[law, 2]
        # before the ramp's end implicit steps ask for times just before it, so `side` is not needed
        return factor * factor * (last - first) / duration if t < duration else 0.0
    # one-sided difference of second order; before t = 0 there is no speed
    speed, h = tables.laws[law, LawColumn.SECOND_ADDRESS], side if t + 2.0 * side >= 0.0 else JUST_AFTER
    return factor * factor * (4.0 * call(speed, (t + h,)) - 3.0 * call(speed, (t,)) - call(speed, (t + 2.0 * h,))) / (2.0 * h)


@kernel_function
def friction_force(speed, p):
    """Return a friction force by the speed, linear up to the regularisation speed; `static_offset` is static less dynamic."""
    dynamic, static_offset, viscous, regularisation, stribeck = p[0], p[1], p[2], p[3], p[4]
    excess = abs(speed) - regularisation
    if excess <= 0.0:
        return (dynamic + static_offset) * speed / regularisation
    return np.sign(speed) * (dynamic + static_offset * np.exp(-excess / stribeck) + viscous * excess)


@kernel_function
def strut(value, rate, p, address):
    """Return the tension of a post-buckled strut of length `value`. Only a taut strut is damped, but never so that it pushes."""
    # L, EA/L, unit EI/L^2 of loads, EI/(EA L^2), critical load, damping. At `address` is the load by the shortening over L
    length, stiffness, unit, compliance, critical, damping = p[0], p[1], p[2], p[3], p[4], p[5]
    elongation = value - length
    if elongation > 0.0:
        return max(0.0, stiffness * elongation + damping * rate)
    shortening = -elongation / length
    if shortening <= compliance * critical:
        return stiffness * elongation
    # shortening by bending alone, from the compression at the critical load, then from that at the load of this guess
    guess = max(0.0, shortening - compliance * critical)
    u = max(0.0, shortening - compliance * call(address, (guess,)))  # one fixed-point iteration; for its error see `StrutLaw`
    return -unit * call(address, (u,))


@kernel_function
def motor(t, speed, p, address):
    """Return the torque of a DC motor on its link; its voltage is p[0] or, unless `address` is 0, the function of time there."""
    resistance, constant, gear, friction_torque, dead_band, regularisation = p[1], p[2], p[3], p[4], p[5], p[6]
    voltage = p[0] if address == 0 else call(address, (t,))
    voltage = np.sign(voltage) * max(0.0, abs(voltage) - dead_band)
    motor_speed = gear * speed
    current = (voltage - constant * motor_speed) / resistance
    return gear * (constant * current - friction_torque * min(max(motor_speed / regularisation, -1.0), 1.0))


@kernel_function
def evaluate_along(tables, k, now, value, rate, reaction):
    """Return force k along its measure, from the measure's `value` and `rate`; `reaction` is the normal force of friction.

    A positive force increases the measure. Laws of springs, struts and friction give tension or drag, so their sign is turned;
    motors and functions of time keep theirs. The numbers p of a force are in the order in which they are read here.
    """
    t, mem = tables.time_factor[0] * now.time, now.memory[k]
    kind, number, law = tables.forces[k, Forces.KIND], tables.forces[k, Forces.NUMBERS], tables.forces[k, Forces.LAW]
    p = tables.data[number : number + FORCE_NUMBERS]
    if kind == ForceKind.SPRING:
        stiffness, damping, free = p[0], p[1], p[2]
        return -stiffness * (value - free) - damping * rate
    if kind == ForceKind.CONTACT:
        side, face = p[0], p[1]
        depth = side * (value - face)
        if depth <= 0.0:
            return 0.0
        return -side * normal_force(tables, law, depth, side * rate, mem[Memory.ONSET])
    if kind == ForceKind.GUIDE_FRICTION:
        return -friction_force(rate, p)
    if kind == ForceKind.FRICTION:
        return -evaluate_friction(tables, tables.forces[k, Forces.FRICTION], rate, mem, now.since)[0] * abs(reaction)
    address = tables.laws[law, LawColumn.FIRST_ADDRESS] if law >= 0 else 0
    if kind == ForceKind.STRUT:
        return -strut(value, rate, p, address)
    if kind == ForceKind.PRESCRIBED:
        return p[0] if address == 0 else call(address, (t,))
    if kind == ForceKind.MOTOR:
        return motor(t, rate, p, address)
    is_spring, argument = p[LawData.IS_SPRING] == 1.0, value - p[LawData.OFFSET]
    return -call(address, (argument, rate)) if is_spring else call(address, (t, argument, rate))


@kernel_function
def differentiate_along(tables, k, now, value, rate, reaction):
    """Return the derivatives of force k by its measure and rate: exact if linear or given in time, else by differences."""
    mem = now.memory[k]
    kind, number = tables.forces[k, Forces.KIND], tables.forces[k, Forces.NUMBERS]
    p = tables.data[number : number + FORCE_NUMBERS]
    if kind == ForceKind.SPRING:
        stiffness, damping = p[0], p[1]
        return -stiffness, -damping
    if kind == ForceKind.CONTACT:
        side, face = p[0], p[1]
        depth = side * (value - face)
        if depth <= 0.0:
            return 0.0, 0.0
        by_depth, by_rate = differentiate_normal(tables, tables.forces[k, Forces.LAW], depth, side * rate, mem[Memory.ONSET])
        return -by_depth, -by_rate
    if kind == ForceKind.PRESCRIBED:
        return 0.0, 0.0
    if kind == ForceKind.FRICTION:
        return 0.0, -differentiate_friction(tables, tables.forces[k, Forces.FRICTION], rate, mem, now.since) * abs(reaction)
    by_value, h = 0.0, 0.0
    if kind == ForceKind.LAW:
        h = 1e-6 * max(abs(value), 1e-3)  # both chosen; 1e-3 m or rad, as the argument may be 0
    elif kind == ForceKind.STRUT:  # 1e-4, chosen, of the shortening, at least of a hundredth of the critical one
        length, compliance, critical = p[0], p[3], p[4]
        h = 1e-4 * max(abs(value - length), 1e-2 * compliance * critical * length)
    if h > 0.0:
        upper = evaluate_along(tables, k, now, value + h, rate, reaction)
        by_value = (upper - evaluate_along(tables, k, now, value - h, rate, reaction)) / (2.0 * h)
    h = 1e-6 * max(abs(rate), p[6] if kind == ForceKind.MOTOR else 1e-3)  # p[6]: regularisation speed; 1e-3 m/s or rad/s: chosen
    upper = evaluate_along(tables, k, now, value, rate + h, reaction)
    return by_value, (upper - evaluate_along(tables, k, now, value, rate - h, reaction)) / (2.0 * h)
