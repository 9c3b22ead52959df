"""The crank-rocker with ideal joints, by nothing but geometry and Newton."""

from dataclasses import replace

import numpy as np


def inverse_dynamics(bar, speed):
    """Force in B and a_x of coupler and rocker over a turn, ideal joints: closed form of the motion, Newton; (4096,)."""
    bar = replace(bar, speed=speed)
    place, _, rush = bar.ideal(np.linspace(0, bar.period, 4096, endpoint=False))
    (coupler, turning), (rocker, swinging) = ((rush[:, k, 0] + 1j * rush[:, k, 1], rush[:, k, 2]) for k in (1, 2))
    mass, inertia = bar.masses[1:], bar.inertias[1:]
    half, arm = (bar.lengths[k] / 2 * np.exp(1j * place[:, k, 2]) for k in (1, 2))  # from the coupler's centre to B, the rocker's
    # F on the rocker at B: moments about A for the coupler, about C for the rocker, two equations for fx, fy
    first = inertia[0] * turning + mass[0] * (half.conj() * coupler).imag
    second = inertia[1] * swinging + mass[1] * (arm.conj() * rocker).imag
    matrix = np.array([[2 * half.imag, -2 * half.real], [-2 * arm.imag, 2 * arm.real]])
    force = np.linalg.solve(np.moveaxis(matrix, -1, 0), np.stack([first, second], -1)[..., None])[..., 0]
    return np.hypot(*force.T), coupler.real, rocker.real
