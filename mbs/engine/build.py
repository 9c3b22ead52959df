"""Assembly of an Exudyn system from a `Mechanism`, settled if it asks for it: only what the mechanism names is built."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np

from .. import elements
from ..elements.element import Element
from ..geometry import Array
from ..kinematics.settle import STEP, About, settle_strips, settles
from ..mechanism import Mechanism
from ..offers import extensions
from . import clearance, loads, modal, rigid, rows, stop, strip
from . import guide as guides
from .loads import attach
from .placed import Placed
from .scene import EngineScene

BODIES: dict[type, Callable[[EngineScene, elements.Link, Array], Placed | None]] = {
    elements.Rigid: rigid.add,
    elements.Beam: strip.add,
    elements.Cable: strip.add,
    elements.Modal: modal.add,
    elements.Strut: loads.add_strut,
}
"""Adds a link: (scene, link, velocity of its start) -> Placed, or None if it has no coordinates."""

CONNECTORS: dict[type, Callable[..., None]] = {
    elements.Revolute: rows.connect,
    elements.Clearance: clearance.connect,
    elements.Weld: rows.connect,
    elements.Slider: rows.add_sliders,
    elements.Slot: rows.add_sliders,
    elements.Guide: guides.connect,
    elements.Strut: loads.join_struts,
    elements.Stop: stop.connect,
    elements.Drive: loads.add_drives,
    elements.Force: loads.add_forces,
    elements.LineLoad: loads.add_line_loads,
    elements.Torque: loads.add_torques,
    elements.Motor: loads.add_motors,
    elements.Spring: loads.add_springs,
    elements.TorsionSpring: loads.add_torsion_springs,
    elements.Mass: loads.add_masses,
}
"""Adds all elements of a kind once the bodies stand: (scene, elements by name)."""


def connect(scene: EngineScene) -> None:
    """Add all elements once the bodies stand: in the order of `CONNECTORS`; a kind without a line there by its rows."""
    found: dict[type, dict[str, Element]] = {kind: {} for kind in CONNECTORS}
    for name, element in scene.source.elements.items():
        body = type(element.body) if isinstance(element, elements.Link) else None
        if body is None or body in CONNECTORS:
            found.setdefault(body or type(element), {})[name] = element
    for kind, each in found.items():
        known = CONNECTORS.get(kind) or extensions("buckler.exudyn").get(kind.__name__)
        if known is None and not all(any(element.rows(scene.mechanism)) for element in each.values()):
            raise ValueError(f"{kind.__name__}: Exudyn's scene does not know this kind, and it has no rows")
        (known or rows.connect)(scene, each)


exu.config.printToConsole = False


def build(mechanism: Mechanism) -> EngineScene:
    """Assemble a mechanism in Exudyn.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    EngineScene
        With the engine's system, not yet stepped.

    Raises
    ------
    ValueError
        If a strut's end has nothing with mass to act on, or a guide that a strut leans on has no mass.
    KinematicsError
        If the drive cannot move the linkage from where it starts.
    """
    container = exu.SystemContainer()
    system = container.AddSystem()
    scene = EngineScene(mechanism, system, container)
    scene.start = begun = scene.source.start
    for link in mechanism.links:
        placed = BODIES[type(link.body)](scene, link, begun.rates[begun.linkage.index[link.name]])
        if placed is not None:
            scene.placed[link.name] = placed
        scene.parts[type(link.body).__name__] += 1
    for guide in mechanism.guides:
        velocity = begun.velocity(guide.link, guide.point)
        scene.placed[guide.point] = guides.place(scene, guide, float(velocity @ guide.along))
        scene.parts["Guide"] += 1
    for burden in scene.source.burdens:
        attach(scene, burden)
    node = scene.system.AddNode(eii.NodePointGround())
    scene.ground = scene.system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    connect(scene)
    _add_gravity(scene)
    scene.system.Assemble()
    for group in scene.remembering:
        group.locate(scene.system)
    for contact in scene.stops.values():
        contact.locate(scene.system, scene.placed)
    settle(scene)
    return scene


def _add_gravity(scene: EngineScene) -> None:
    """Add weight, and only where gravity lies in the plane."""
    gx, gy = scene.mechanism.gravity
    if gx == gy == 0:
        return
    for placed in scene.placed.values():
        for body in placed.objects:
            marker = scene.system.AddMarker(eii.MarkerBodyMass(bodyNumber=body))
            scene.system.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[gx, gy, 0.0]))
    scene.parts["gravity"] += 1


REDUNDANT = 1e-12
"""Compliance of redundant rows, relative to rows scaled to 1."""


class _Equations:
    """Equations of a system: mass, forces and constraints by the engine's solver, constraint accelerations by differences."""

    def __init__(self, scene: EngineScene, step: float) -> None:
        solver: Any = exu.MainSolverImplicitSecondOrder()  # its stubs lack the arguments
        self.system, self.solver, self.step = scene.system, solver, step
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        self.solver.InitializeSolver(self.system, settings)
        self.size = self.system.systemData.ODE2Size()

    def _at(self, q: Array, v: Array, t: float = 0.0) -> None:
        data = self.system.systemData
        data.SetODE2Coordinates(q)
        data.SetODE2Coordinates_t(v)
        data.SetTime(t)

    def _gaps(self, q: Array, v: Array, t: float) -> Array:
        self._at(q, v, t)
        self.solver.ComputeAlgebraicEquations(self.system, False)
        return np.array(self.solver.GetSystemResidual())[self.size :]

    def _matrices(self, q: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        """Mass, stiffness, scaled rows of the constraints, and their scales."""
        self._at(q, v)
        n, solver = self.size, self.solver
        solver.ComputeMassMatrix(self.system)
        mass = np.array(solver.GetSystemMassMatrix())[:n, :n]
        solver.ComputeJacobianODE2RHS(self.system, -1.0, 0.0)
        stiffness = np.array(solver.GetSystemJacobian())[:n, :n]
        solver.ComputeJacobianODE2RHS(self.system, 0.0, 0.0)
        solver.ComputeJacobianAE(self.system, 1.0, 1.0)  # a drive of constant speed is a row of velocities
        rows = np.array(solver.GetSystemJacobian())[n:, :n]
        scales = np.abs(rows).max(axis=1, initial=0.0)
        scales[scales == 0.0] = 1.0
        return mass, stiffness, rows / scales[:, None], scales

    def _solve(self, inner: Array, rows: Array, right: Array, gaps: Array) -> Array:
        """Solve inner x + rows^T mu = right, rows x = gaps for x."""
        unit = np.abs(np.diag(inner)).max()
        whole = np.block([[inner / unit, rows.T], [rows, -REDUNDANT * np.eye(len(rows))]])
        try:
            return np.asarray(np.linalg.solve(whole, np.append(right / unit, gaps))[: self.size])
        except np.linalg.LinAlgError as error:
            raise ArithmeticError(str(error)) from None

    def about(self, q: Array, v: Array, shift: float) -> About:
        """See `Equations`."""
        mass, stiffness, rows, _ = self._matrices(q, v)
        none = np.zeros(len(rows))
        return About(mass, lambda right: self._solve(stiffness + shift * mass, rows, right, none))

    def acceleration(self, q: Array, v: Array) -> Array:
        """See `Equations`."""
        h = self.step
        before, middle, after = (self._gaps(q + k * h * v, v, k * h) for k in range(3))
        mass, _, rows, scales = self._matrices(q, v)
        return self._solve(mass, rows, self.force(q, v), -(after - 2 * middle + before) / h**2 / scales)

    def force(self, q: Array, v: Array) -> Array:
        """See `Equations`."""
        self._at(q, v)
        self.solver.ComputeODE2RHS(self.system)
        return np.array(self.solver.GetSystemResidual())[: self.size]

    def project(self, q: Array, v: Array) -> tuple[Array, Array]:
        """See `Equations`."""
        still, h = np.zeros(self.size), self.step
        mass, _, rows, scales = self._matrices(q, v)
        q = q - self._solve(mass, rows, still, self._gaps(q, v, 0.0) / scales)
        mass, _, rows, scales = self._matrices(q, v)
        before, middle, after = (self._gaps(q + k * h * v, v, k * h) for k in range(3))
        return q, v - self._solve(mass, rows, still, (4 * middle - 3 * before - after) / (2 * h) / scales)


def settle(scene: EngineScene) -> None:
    """Give a system its settled start, if the mechanism asks for it."""
    if not settles(scene.mechanism):
        return
    data, initial = scene.system.systemData, exu.ConfigurationType.Initial
    q, v = (np.array(get(configuration=initial)) for get in (data.GetODE2Coordinates, data.GetODE2Coordinates_t))
    equations = _Equations(scene, STEP * scene.source.axial_period / (2 * pi))
    q, v = settle_strips(equations, scene.mechanism, q, v)
    data.SetODE2Coordinates(q, configuration=initial)
    data.SetODE2Coordinates_t(v, configuration=initial)
    data.SetTime(0.0)
