"""The crank-rocker with clearance on both solvers: how far they are apart, and its flexible rockers."""

from math import nan

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from buckler.mbs import Material, Section
from buckler.mbs.modal import BarModes, Modal

JOINTS = {"O": "ground-crank", "A": "crank-coupler", "B": "coupler-rocker", "C": "ground-rocker"}
CENTRES = {"crank": 0, "coupler": 2, "rocker": 5}
"""First column of each bar's centre among the coordinates of a run."""


def distance(result, run):
    """Largest distance of a bar's centre from the compiled solver's at each of the engine's steps, m, shape (times,)."""
    return np.max([np.hypot(*(_apart(result, run, bar, k, axis) for axis in (0, 1))) for bar, k in CENTRES.items()], axis=0)


def _apart(result, run, bar, k, axis):
    if run.time[-1] < result.time[-1] * (1 - 1e-12):
        return np.full_like(result.time, nan)
    path = CubicHermiteSpline(run.time, run.q[:, k + axis], run.q_t[:, k + axis])
    return result.signals[f"{bar}.{'xy'[axis]}"] - path(result.time)


def forces(result):
    """Size of each joint's force at each step, N, shape (times, 4)."""
    return np.stack([np.hypot(*(result.signals[f"{p}.{pair}.f{axis}"] for axis in "xy")) for p, pair in JOINTS.items()], axis=1)


def beam_modes(*, thickness=0.020, width=0.005, bending=2, axial=1, damping=0.01, density=7850.0, modulus=207e9, shear=True):
    """A rocker of modes of beam theory."""
    section = Section(width, thickness, Material(modulus=modulus, density=density, poisson=0.29))
    return Modal(section, BarModes(bending, axial, shear), damping)
