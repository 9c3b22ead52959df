"""Equilibria of drawn mechanisms against the engine's own equations: its forces, differences of them, its finite elements."""

from dataclasses import replace
from itertools import pairwise

import exudyn as exu
import numpy as np
import pytest

from buckler.mbs import Force, Motor, Torque, TorsionSpring, equilibrium
from buckler.mbs.engine.build import build
from buckler.mbs.spectral.basis import basis
from buckler.mbs.statics.problem import places
from buckler.studies.kit.drawn import Dice, draw

FAMILIES = (
    "any chain",
    "any cantilever",
    "any landing",
    "any spinning",
    "any coupled",
    "any sliding",
    "any guided",
    "near critical",
)
OFFSET = 1e-7
"""Of the differences, m and rad."""
NEAR = 0.05
"""How far from some coordinates an equilibrium is another one, m and rad."""


def resting(seed, k):
    """A drawn mechanism that is let go, its loads as they are at t = 0; a share of forces follow, or pull the other way."""
    made = draw(seed, k, FAMILIES).mechanism
    d, loads = Dice(seed, k), []
    for load in made.loads:
        if isinstance(load, Force) and isinstance(load.value, tuple):
            link = next(link for link in made.links if load.point in link.points)
            value = tuple(d.one(-1.0, 1.0) * d.log(0.3, 3.0) * each for each in load.value)
            load = replace(load, value=value, follows=link.name if link.body.turns and d.chance(0.3) else None)
        loads.append(load)
    if made.couplings:
        loads.append(TorsionSpring("ground", "one", stiffness=d.log(0.3, 3.0)))
    return replace(made, loads=loads, velocities={}, drives=[])


class Engine:
    """A mechanism in Exudyn, its strips of so many elements: forces and constraints at coordinates."""

    def __init__(self, mechanism, elements):
        links = [replace(x, body=replace(x.body, elements=elements)) if x.body.meshed else x for x in mechanism.links]
        self.scene = build(replace(mechanism, links=links))
        self.system, self.solver = self.scene.system, exu.MainSolverImplicitSecondOrder()
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        self.solver.InitializeSolver(self.system, settings)
        self.size = self.system.systemData.ODE2Size()

    def force(self, q, v):
        """Forces, constraints and their rows."""
        data, solver, n = self.system.systemData, self.solver, self.size
        data.SetODE2Coordinates(q)
        data.SetODE2Coordinates_t(v)
        solver.ComputeODE2RHS(self.system)
        force = np.array(solver.GetSystemResidual())[:n]
        solver.ComputeAlgebraicEquations(self.system, False)
        gaps = np.array(solver.GetSystemResidual())[n:]
        solver.ComputeJacobianODE2RHS(self.system, 0.0, 0.0)
        solver.ComputeJacobianAE(self.system, 1.0, 1.0)
        return force, gaps, np.array(solver.GetSystemJacobian())[n:, :n]

    def unbalanced(self, x):
        """Forces and gaps of coordinates and multipliers."""
        force, gaps, rows = self.force(x[: self.size], np.zeros(self.size))
        return np.append(force - rows.T @ x[self.size :], gaps)

    def rest(self, q):
        """The equilibrium near some coordinates, by Newton's method with differences; None where it finds none."""
        force, _, rows = self.force(q, np.zeros(self.size))
        x = np.append(q, np.linalg.lstsq(rows.T, force, rcond=1e-12)[0])
        for _ in range(25):
            step = np.linalg.lstsq(-differences(self.unbalanced, x), self.unbalanced(x), rcond=1e-13)[0]
            x = x + step
            size = np.abs(step[: self.size]).max()
            if size < 1e-8:
                return x if np.abs(x[: self.size] - q).max() < NEAR else None
            if size > 1.0:
                return None
        return None

    def growth(self, x):
        """Largest real part of an exponent, and the smallest exponent's size, on what the constraints leave free."""
        n, q = self.size, x[: self.size]
        rows = self.force(q, np.zeros(n))[2]
        free = np.linalg.svd(rows)[2][np.linalg.matrix_rank(rows, 1e-9 * np.abs(rows).max(initial=1.0)) :].T
        self.solver.ComputeMassMatrix(self.system)
        mass = free.T @ np.array(self.solver.GetSystemMassMatrix())[:n, :n] @ free
        stiffness = -free.T @ differences(self.unbalanced, x)[:n, :n] @ free
        damping = -free.T @ differences(lambda v: self.force(q, v)[0], np.zeros(n)) @ free
        none = np.zeros_like(mass)
        values = np.linalg.eigvals(
            np.block([[none, np.eye(len(mass))], [-np.linalg.solve(mass, np.hstack([stiffness, damping]))]])
        )
        return values.real.max(initial=0.0), np.abs(values).min(initial=np.inf)

    def held(self, placed):
        """Coordinates of the points of a link."""
        columns = placed.columns()
        return columns[sorted(placed.at.values()), :2].ravel() if hasattr(placed, "at") else columns.ravel()

    def coordinates(self, found):
        """Those of an equilibrium of the statics."""
        q, mechanism = np.zeros(self.size), found.scene.mechanism
        for name, placed in self.scene.placed.items():
            columns = placed.columns()
            if name not in found.scene.builder.bodies:
                guide = next(each for each in mechanism.guides if each.point == name)
                moved = places(found.scene, found.q, guide.link, name).position - mechanism.points[name]
                q[columns[0, 0]] = moved @ guide.along
            elif placed.body.meshed:
                q[columns] = along(found, name, placed) - placed.reference
                for point, node in placed.anchors.items():
                    first, at = self.system.GetNodeODE2Index(node), places(found.scene, found.q, name, point)
                    before = placed.reference[placed.at[point]]
                    q[first : first + 3] = [*(at.position - before[:2]), at.angle - np.arctan2(before[3], before[2])]
            else:
                start = places(found.scene, found.q, name, mechanism.link(name).start)
                turn = start.angle - places(found.scene, found.scene.q0, name, mechanism.link(name).start).angle
                c, s = np.cos(turn), np.sin(turn)
                arm = placed.reference[0, :2] - mechanism.points[mechanism.link(name).start]
                q[columns[0]] = [*(start.position + np.array([[c, -s], [s, c]]) @ arm - placed.reference[0, :2]), turn]
        return q


def differences(function, x):
    return np.array([(function(x + h) - function(x - h)) / (2 * OFFSET) for h in OFFSET * np.eye(len(x))]).T


def along(found, name, placed):
    """Coordinates of the engine's nodes on a strip of the statics."""
    strip, step = found.scene.builder.bodies[name], placed.body.step
    ends = np.concatenate([[0.0], np.cumsum(placed.pieces)]) / placed.pieces.sum() * strip.length
    arcs = np.concatenate([[0.0], *(np.linspace(a, b, step + 1)[1:] for a, b in pairwise(ends))])
    out = []
    for arc in arcs:
        element = next((e for e in strip.elements if arc <= e.end * (1 + 1e-9)), strip.elements[-1])
        degree, x = element.places.shape[1] - 1, (arc - element.start) / element.jacobian - 1.0
        out.append([basis(degree, x)[0] @ found.q[each] for each in element.places])
        if len(out[-1]) == 2:
            out[-1] += [basis(degree, x, 1)[0] @ found.q[each] / element.jacobian for each in element.places]
    return np.array(out)


def judged(made):
    """Whether an equilibrium is one of the engine's, as stable as that, and in words what is not so."""
    found = equilibrium(made)
    if found.status != "OK":
        return str(found.status), found.message
    off, grown = [], []
    for elements in (8, 16, 32, 64):
        engine = Engine(made, elements)
        q = engine.coordinates(found)
        x = engine.rest(q)
        if x is not None:
            off.append(max(np.abs((x[: engine.size] - q)[engine.held(each)]).max() for each in engine.scene.placed.values()))
            grown.append(engine.growth(x))
        if len(off) == 2:
            break
    else:
        return "wrong", "the engine has none near"
    if off[1] > abs(off[0] - off[1]) + found.error * found.scene.length + 1e-7:
        return "wrong", f"off by {off[0]:.1e}, {off[1]:.1e}, told {found.error:.1e}"
    both = [growth > 0.1 * least for growth, least in grown]  # near a critical load one mesh's differences are rounding
    fastest = max(growth for growth, _ in grown)
    if (all(both) and found.stable) or fastest < 1e-3 * found.growth:
        return "wrong", f"grows at {fastest:.3g}, told {found.growth:.3g} 1/s"
    return ("right" if found.stable else "right, unstable"), f"{off[1]:.1e} {found.error:.1e}"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_drawn_equilibria_are_the_engines(seed):
    """A force that follows, or a torque, may leave none; without these each of them rests somewhere."""
    for k in range(24):
        made = resting(seed, k)
        if any(link.body.linear for link in made.links):
            continue
        word, said = judged(made)
        turned = any(isinstance(load, Torque | Motor) or getattr(load, "follows", None) for load in made.loads)
        assert word.startswith("right") or (word == "FREE_MOTION" and turned), f"{seed}.{k}: {word}: {said}"
