"""Static equilibrium of the pinned strip on the engine, started from the exact elastica so that it cannot miss the branch.

The static solver stays on the straight branch of a strut without a word. Here every value starts on the buckled branch, and is
checked to be there still: by its force against the closed form and by its deflection's side.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Any, cast

import exudyn as exu
import numpy as np
from numpy.typing import ArrayLike

from buckler.elastica import pinned

from ..elements import Beam, Cable, Drive, Guide, Link, Motion, Profile, Revolute, Section
from ..geometry import Array
from ..mechanism import Mechanism
from ..record.errors import Status
from ..validate import one_of, positive
from . import System
from .build import build
from .placed import States
from .scene import SPARSE_FROM, EngineScene
from .strip import PlacedStrip

OFF_BRANCH = 0.5
"""Relative distance from the exact force beyond which a state is not on the buckled branch."""
MESH = 1e-2
"""The same, beyond which it has too few elements; a thick strip may be off by its shear and compression besides."""


@dataclass(frozen=True)
class Equilibria:
    """Equilibria of a pinned strip at prescribed end shortenings.

    Attributes
    ----------
    status : Status
    message : str
    shortening : array, shape (values,)
        End shortening over length, u.
    load : array, shape (values,)
        Normalised force p = P L^2/(E I).
    shapes : array, shape (values, stations, 2)
        Positions along the strip, m.
    work : dict
        wall_s, newton_iterations.
    """

    status: Status
    message: str
    shortening: Array
    load: Array
    shapes: Array
    work: dict[str, float]


def pinned_strip(body: Beam | Cable, length: float, shortenings: ArrayLike, *, tolerance: float = 1e-7) -> Equilibria:
    """Equilibrium of a strip pinned at both ends at each of some end shortenings.

    Parameters
    ----------
    body : Beam or Cable
        The strip and its elements.
    length : float
        Distance of the straight strip's ends, m.
    shortenings : array_like, shape (values,)
        End shortening over length, in [1e-6, 1.5].
    tolerance : float
        Newton's relative tolerance on the residual of the starting shape.

    Returns
    -------
    Equilibria
        Its status is SUSPECT if a value left the buckled branch, or its elements are too few for it, and NEWTON_DIVERGED if
        one did not converge.

    Raises
    ------
    ValueError
        If a shortening is out of range.
    """
    one_of("body", body, (Beam, Cable))
    positive("length", length, "m")
    positive("tolerance", tolerance, "1")
    u = np.atleast_1d(np.asarray(shortenings, dtype=float))
    if not u.size:
        raise ValueError("shortenings = []: must be one at least, in [1e-06, 1.5]")
    if not ((u >= 1e-6) & (u <= 1.5)).all():
        raise ValueError(f"shortenings = {u[~((u >= 1e-6) & (u <= 1.5))][0]!r}: must lie in [1e-06, 1.5]")
    start = perf_counter()
    travel = [0.0]  # of the moving end, m; the engine asks for it by callback
    scene = build(_between_ground_and_slider(body, length, travel))
    guesses = _exact_coordinates(scene, body, u)
    engine, settings = exu.MainSolverStatic(), _static_settings(scene, tolerance)
    unit = body.section.bending_stiffness / length**2
    row = int(scene.multipliers("drive")[0])
    load, states, iterations, failure = np.full(len(u), np.nan), [], 0, (Status.OK, "")
    for k, guess in enumerate(guesses):
        travel[0] = -u[k] * length
        scene.system.systemData.SetODE2Coordinates(guess, configuration=exu.ConfigurationType.Initial)
        if not _solve(engine, scene.system, settings):
            failure = (Status.NEWTON_DIVERGED, f"no equilibrium found at u = {u[k]:g}")
            break
        iterations += engine.it.newtonStepsCount
        states.append(scene.system.systemData.GetODE2Coordinates())
        load[k] = abs(float(scene.system.systemData.GetAECoordinates()[row])) / unit
    wall = perf_counter() - start
    shapes = _shapes(scene, states)
    if failure[0] is Status.OK:
        failure = _branch(u, load, shapes, MESH + _thickness(body.section, length))
    return Equilibria(*failure, u, load, shapes, {"wall_s": wall, "newton_iterations": float(iterations)})


def _between_ground_and_slider(body: Beam | Cable, length: float, travel: list[float]) -> Mechanism:
    return Mechanism(
        points={"A": (0.0, 0.0), "B": (length, 0.0)},
        links=[Link("strip", "A", "B", body)],
        joints=[Revolute("A", "ground", "strip")],
        guides=[Guide("B", "strip")],
        drives=[Drive("B", Motion(lambda _t: travel[0], lambda _t: 0.0))],
    )


def _exact_coordinates(scene: EngineScene, body: Beam | Cable, u: Array) -> Array:
    """Displacements of all coordinates in the exact shape, shape (values, coordinates)."""
    strip = scene.placed["strip"]
    columns, length = strip.columns(), scene.mechanism.length("strip")
    s = np.linspace(0.0, 1.0, len(strip.nodes))
    x, y, theta = pinned.shape(u[:, None], s)
    rotation = [theta] if body.turns else [np.cos(theta), np.sin(theta)]
    total = np.stack([x * length, y * length, *rotation], axis=-1)
    guesses = np.zeros((len(u), scene.system.systemData.ODE2Size()))
    guesses[:, columns] = total - strip.reference
    guesses[:, scene.placed["B"].columns()[0, 0]] = -u * length
    return guesses


def _static_settings(scene: EngineScene, tolerance: float) -> exu.SimulationSettings:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    static = settings.staticSolver
    static.verboseMode = 0
    static.numberOfLoadSteps = 1
    static.useLoadFactor = False
    static.adaptiveStep = False
    static.newton.relativeTolerance = tolerance
    static.newton.absoluteTolerance = 2e-6
    if scene.system.systemData.ODE2Size() >= SPARSE_FROM:
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    return settings


def _solve(engine: Any, system: System, settings: exu.SimulationSettings) -> bool:
    """Return True if the engine finds an equilibrium."""
    try:
        return bool(engine.SolveSystem(system, settings))
    except exu.ExudynError:
        return False


def _shapes(scene: EngineScene, states: list[Array]) -> Array:
    placed = cast(PlacedStrip, scene.placed["strip"])
    if not states:
        return np.empty((0, 0, 2))
    q = np.array(states)
    return placed.motion(States(q, np.zeros_like(q), np.zeros_like(q))).line()


def _thickness(section: Section | Profile, length: float) -> float:
    """Bound the relative difference of the Euler load with and without shear and axial stiffness."""
    return 2 * section.euler_load(length) * (1 / section.shear_stiffness + 1 / section.axial_stiffness)


def _branch(u: Array, load: Array, shapes: Array, coarse: float) -> tuple[Status, str]:
    """Check that every state is on the exact buckled branch, on the side it started, and as exact as a fine mesh."""
    exact = pinned.load(u)
    error = np.abs(load / exact - 1)
    middle = shapes[:, shapes.shape[1] // 2, 1] - shapes[:, 0, 1]
    off = (error > OFF_BRANCH) | (middle <= 0)
    if off.any():
        k = int(np.argmax(off))
        return Status.SUSPECT, f"BRANCH: at u = {u[k]:g} the force is {load[k]:.4g}, on the buckled branch {exact[k]:.4g}"
    if (error > coarse).any():
        k = int(np.argmax(error))
        return Status.SUSPECT, f"MESH: at u = {u[k]:g} the force is {load[k]:.4g}, exact {exact[k]:.4g}: too few elements"
    return Status.OK, ""
