"""The crank-rocker with ideal joints, by nothing but geometry and Newton."""

import numpy as np


def inverse_dynamics(bar, speed):
    """Force in B and a_x of coupler and rocker over a turn, ideal joints: circles met, spectral derivatives, Newton; (4096,)."""
    crank = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    a = bar.crank * np.exp(1j * crank)
    to_c = bar.frame - a
    bend = np.arccos((bar.coupler**2 + abs(to_c) ** 2 - bar.rocker**2) / (2 * bar.coupler * abs(to_c)))
    b = a + bar.coupler * to_c / abs(to_c) * np.exp(1j * bend)
    order = 1j * np.fft.fftfreq(len(crank), 1 / len(crank)) * speed

    def twice(x):
        return np.fft.ifft(order**2 * np.fft.fft(x))

    turning = [twice(np.unwrap(np.angle(x))).real for x in (b - a, bar.frame - b)]
    coupler, rocker = twice((a + b) / 2), twice((b + bar.frame) / 2)
    mass, inertia = bar.masses[1:], bar.inertias[1:]
    half, arm = (b - a) / 2, (b - bar.frame) / 2  # from the coupler's centre to B, from the rocker's
    # F on the rocker at B: moments about A for the coupler, about C for the rocker, two equations for fx, fy
    first = inertia[0] * turning[0] + mass[0] * (half.conj() * coupler).imag
    second = inertia[1] * turning[1] + mass[1] * (arm.conj() * rocker).imag
    matrix = np.array([[2 * half.imag, -2 * half.real], [-2 * arm.imag, 2 * arm.real]])
    force = np.linalg.solve(np.moveaxis(matrix, -1, 0), np.stack([first, second], -1)[..., None])[..., 0]
    return np.hypot(*force.T), coupler.real, rocker.real
