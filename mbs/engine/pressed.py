"""Loads of the buckled pinned strip by Newton's method in the engine, started from the exact elastica."""

from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import ArrayLike

from buckler.elastica import pinned

from ..elements import Beam, Cable, Drive, Guide, Link, Motion, Revolute
from ..geometry import Array
from ..mechanism import Mechanism
from .build import build
from .scene import SPARSE_FROM, EngineScene

MESH = 1e-2
"""Relative error of the force that the mesh may cause, in addition to the effects of shear and compression: chosen."""


def pinned_strip(body: Beam | Cable, length: float, shortenings: ArrayLike) -> Array:
    """Compute the forces P L^2/(E I), (values,), that hold a strip, pinned at both ends, at given end shortenings, (values,).

    `body` has section and elements of the strip, which is straight; its length is in [m]. A shortening is end shortening over
    length. It must be larger than that of the compressed strip at buckling, 8e-7 at a thickness of length/1000, and at most 1.5.
    At 1.5 the force of 16 cable elements is 0.9 % off. Raise an ArithmeticError if Newton's method does not converge, or a force
    is off the buckled branch.
    """
    u = np.atleast_1d(np.asarray(shortenings, dtype=float))
    travel = [0.0]  # of the moving end [m]; the drive reads it
    mechanism = Mechanism(
        points={"A": (0.0, 0.0), "B": (length, 0.0)},
        links=[Link("strip", "A", "B", body)],
        joints=[Revolute("A", "ground", "strip")],
        guides=[Guide("B", "strip")],
        drives=[Drive("B", Motion(position=lambda _t: travel[0], speed=lambda _t: 0.0))],
    )
    scene = build(mechanism)
    engine: Any = exu.MainSolverStatic()  # its stubs lack the arguments
    settings, data = _make_static_settings(scene), scene.system.systemData
    unit, loads = body.section.bending_stiffness / length**2, np.empty(len(u))
    (drive_multiplier,) = scene.multiplier_indices("drive")  # of the only drive: the force at B [N]
    for k, guess in enumerate(_compute_exact_coordinates(scene, body, u)):
        travel[0] = -u[k] * length
        data.SetODE2Coordinates(guess, configuration=exu.ConfigurationType.Initial)
        try:
            has_converged = engine.SolveSystem(scene.system, settings)
        except exu.ExudynError:
            has_converged = False
        if not has_converged:
            raise ArithmeticError(f"no equilibrium found at u = {u[k]:g}")
        loads[k] = abs(float(data.GetAECoordinates()[drive_multiplier])) / unit
    _check_branch(body, length, u, loads)
    return loads


def _check_branch(body: Beam | Cable, length: float, u: Array, loads: Array) -> None:
    """Raise an ArithmeticError if a load differs from the elastica's by more than shear, compression and mesh explain."""
    section, exact = body.section, pinned.load(u)
    # the relative change of the buckling load to first order, with a margin of 2
    shear_and_compression = 2 * section.euler_load(length) * (1 / section.shear_stiffness + 1 / section.axial_stiffness)
    error = np.abs(loads / exact - 1)
    k = int(np.argmax(error))
    if error[k] > MESH + shear_and_compression:
        forces = f"at u = {u[k]:g} the force is {loads[k]:.4g}, exact {exact[k]:.4g}"
        raise ArithmeticError(f"{forces}: too few elements, or off the buckled branch")


def _compute_exact_coordinates(scene: EngineScene, body: Beam | Cable, u: Array) -> Array:
    """Compute the engine's coordinates of the exact elastica, (shortenings, coordinates)."""
    strip = scene.placed["strip"]
    columns, length = strip.columns(), scene.mechanism.length("strip")
    s = np.linspace(0.0, 1.0, len(strip.nodes))
    x, y, theta = pinned.shape(u[:, None], s)
    rotation = [theta] if body.has_angles else [np.cos(theta), np.sin(theta)]  # beams have angles at nodes, cables slopes
    total = np.stack([x * length, y * length, *rotation], axis=-1)
    guesses = np.zeros((len(u), scene.system.systemData.ODE2Size()))
    guesses[:, columns] = total - strip.reference
    travel_column = scene.placed["B"].columns()[0, 0]  # of the only coordinate of the guide's block; it is positive away from A
    guesses[:, travel_column] = -u * length
    return guesses


def _make_static_settings(scene: EngineScene) -> exu.SimulationSettings:
    """Return the settings of the static solver: full load in one step."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    static = settings.staticSolver
    static.verboseMode = 0
    static.useLoadFactor = False
    static.adaptiveStep = False
    # ten times larger tolerances of the residual change a load by a relative 1e-7
    static.newton.relativeTolerance = 1e-7  # over the residual at the start of the step
    static.newton.absoluteTolerance = 2e-6  # [N, N m]
    if scene.system.systemData.ODE2Size() >= SPARSE_FROM:
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    return settings
