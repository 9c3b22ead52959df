"""State at the start of a run: rates and accelerations that satisfy the constraints; arrays of the integrators.

Coordinates q (n,), rates v, accelerations a, multipliers lambda (r,), forces f, constraints g(q, t) = 0 with G = dg/dq. Their
first derivative by time is G v = speed, with speed = -dg/dt; their second is G a = change, with the terms without a on the right.
"""

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Array
from .elimination import Fronts
from .entry_points import place
from .frame_body import FrameBody
from .fronts import EliminationOrders
from .output import DORMAND_PRINCE_SHAPES, RADAU_SHAPES, DormandPrince, DormandPrinceState, Radau, RadauState, allocate
from .scene import CompiledScene
from .strip_body import StripBody
from .tables import BlockColumn, Forces, Markers, Memory, StripColumn, Tables

ROUNDING = 1e-12
"""Relative error that counts as rounding: of G v = speed, before start rates are corrected; of multipliers in `balance`."""


def start_rates(scene: CompiledScene) -> Array:
    """Compute the rates of all coordinates at t = 0, (n,), from the velocities of links that the scene's start has.

    Links move as rigid bodies. If the linkage cannot move so, points of strips have `additional` velocities, which bend strips.
    If these rates violate G v = speed (a pin inside a curved strip), the change of v has least kinetic energy.
    """
    found = scene.source.start  # velocities of links as rigid bodies, from the closure of the linkage
    v = np.zeros(scene.size)
    for name, body in scene.builder.bodies.items():
        if isinstance(body, FrameBody | StripBody):
            v += body.rigid_motion(scene.builder) @ found.rates[found.linkage.index[name]]
        if isinstance(body, StripBody) and name in found.additional:
            v += body.bending_rates(scene.builder, found, scene.mechanism.link(name))
    for dof, link, point, is_rotor in scene.builder.separate_masses:  # point masses and rotors with dofs of their own from `dof`
        if is_rotor:
            v[dof] = found.rates[found.linkage.index[link], 2]
        else:
            v[dof : dof + 2] = found.velocity(link, point)
    for dof, initial_state in scene.builder.state_rates.items():
        v[dof] = initial_state  # a law's state is the rate of a coordinate made for it (`stateful`)
    equations = scene.assemble(scene.q0, tangents=False, sparse=True)
    missing = equations.speed - equations.jacobian @ v
    if np.abs(missing).max(initial=0.0) > ROUNDING * max(1.0, np.abs(equations.speed).max(initial=0.0)):
        # the equations of accelerations without forces: M dv + G^T mu = 0, G dv = missing
        least_change, _ = scene.accelerate(scene.q0, np.zeros(scene.size), missing)
        v = v + least_change
    return v


def differentiate_marker(scene: CompiledScene, marker: int, q: Array) -> Array:
    """Compute the derivatives of a marker's (x, y, angle) by the coordinates, shape (3, n)."""
    place(scene.tables, scene.work, q, np.zeros(scene.size))  # fills `work.jacobian`, the derivatives of all markers
    first, count = scene.tables.markers[marker, [Markers.FIRST, Markers.COUNT]]
    out = np.zeros((3, scene.size))
    for i in range(first, first + count):  # a dof may be there twice
        out[:, scene.tables.dofs[i]] += scene.work.jacobian[:, i]
    return out


def balance(scene: CompiledScene, q: Array, v: Array, t: float, memory: Array) -> tuple[Array, Array]:
    """Solve M a + G^T lambda = f, G a = change at a state; return a and lambda, which is zero for redundant rows.

    Friction that follows reactions makes lambda = F(lambda), with F linear while no reaction changes its sign. Newton's method,
    with derivatives by differences, starts without friction: of several solutions, as a guide may have near self-locking, it
    finds that of the frictionless signs. After 20 iterations the last values are returned, converged or not.
    """

    def solve(lam: Array) -> tuple[Array, Array]:
        """Return a and lambda with the friction that a given lambda causes."""
        out = scene.assemble(q, v, t, lam, memory, tangents=False, sparse=True)
        return scene.accelerate(q, out.force, out.change)

    rows = scene.tables.forces[:, Forces.ROW]  # constraint whose reaction presses, or -1
    pressing = np.unique(rows[rows >= 0])
    acceleration, new = solve(np.zeros(len(scene.tables.rows)))
    for _ in range(20 if len(pressing) else 0):  # a solution takes two, and one more for each change of signs
        lam, largest = new.copy(), np.abs(new).max()
        acceleration, new = solve(lam)
        if np.abs(new - lam).max() <= ROUNDING * np.abs(new).max():
            break
        steps = np.where(lam[pressing] < 0, -largest, largest)  # away from zero, where F has a kink
        moved = [solve(lam + step * (np.arange(len(lam)) == row))[1] for row, step in zip(pressing, steps, strict=True)]
        slopes = (np.array(moved)[:, pressing] - new[pressing]) / steps[:, None]  # of F, (by which, of which)
        new[pressing] = lam[pressing] + np.linalg.lstsq(np.eye(len(pressing)) - slopes.T, (new - lam)[pressing])[0]
    return acceleration, new


def draw_offset(scene: CompiledScene, spread: float, seed: int) -> Array:
    """Draw a random change of the coordinates at t = 0, (n,), for members of an ensemble; constraints hold to first order.

    Components are normal with standard deviation `spread`, in m or rad; those of modal coordinates are 0 before the projection.
    """
    step = spread * np.random.default_rng(seed).standard_normal(scene.size)
    for body in scene.builder.bodies.values():
        if isinstance(body, FrameBody):
            step[body.offset + 3 : body.offset + 3 + body.modes] = 0.0
    jacobian = scene.assemble(scene.q0, tangents=False).jacobian
    return step - np.linalg.pinv(jacobian, rcond=1e-10) @ (jacobian @ step) if len(jacobian) else step


def radau(scene: CompiledScene, q: Array, v: Array, a: Array, lam: Array, memory: Array) -> Radau:
    """Allocate the data of an implicit run that starts from this state; `memory` has the columns `Memory`."""
    newton, saddle = scene.fronts, scene.mass_fronts
    sizes = _count_sizes(scene, saddle) | {
        "p": int(scene.tables.strips[:, StripColumn.POINTS].sum()),  # Gauss points of all strips
        "e": len(scene.tables.elastic),
        "newton_entries": newton.size,
        "newton_swaps": len(newton.unknowns),
        "front": max(newton.largest, saddle.largest),
    }
    angles = [body.offset + 2 for body in scene.builder.bodies.values() if isinstance(body, FrameBody)]
    values = {"q": q, "v": v, "a": a, "lam": lam, "memory": memory, "start_memory": memory, "unit": scene.units}
    values["turns"] = np.isin(np.arange(scene.size), angles)
    tables = scene.tables._replace(edges=scene.edges())
    return Radau(tables, EliminationOrders(newton, saddle), scene.work, RadauState._make(allocate(RADAU_SHAPES, sizes, values)))


def dormand_prince(scene: CompiledScene, q: Array, v: Array, lam: Array, memory: Array) -> DormandPrince:
    """Allocate the data of an explicit run that starts from this state; `memory` has the columns `Memory`."""
    free_modes = _are_modal_links_free(scene.tables)
    saddle = scene.find_mass_fronts(constant=free_modes)  # `kernel.couple_modes` then solves for the modes apart
    y = np.concatenate([q, v, memory[:, Memory.BRISTLE]])
    sizes = _count_sizes(scene, saddle) | {"y": len(y), "front": saddle.largest}
    largest_rate = max(1e-3, np.abs(v / scene.units).max(initial=0.0))  # 1e-3 1/s, chosen: not zero at rest
    values: dict[str, ArrayLike] = {"y": y, "y_new": y, "y_stage": y, "lam": lam, "memory": memory, "units": scene.units}
    # with `free_modes` M in [M G^T; G 0] is the constant `tables.mass`; else the integrator writes the whole matrix
    values |= {"largest_rate": largest_rate, "free_modes": free_modes, "matrix": scene.tables.mass}
    state = DormandPrinceState._make(allocate(DORMAND_PRINCE_SHAPES, sizes, values))
    return DormandPrince(scene.tables, saddle, scene.work, state)


def _count_sizes(scene: CompiledScene, saddle: Fronts) -> dict[str, int]:
    """Count the sizes of arrays that both integrators have, n to g as in `output`; `saddle` are the fronts of [M G^T; G 0]."""
    tables, n, r = scene.tables, scene.size, len(scene.tables.rows)
    g = int(tables.blocks[:r, BlockColumn.WIDTH].sum())  # entries of G as the kernel stores it: unknowns of constraints' blocks
    of_factors = {"saddle_entries": saddle.size, "saddle_swaps": len(saddle.unknowns)}
    return {"n": n, "r": r, "u": n + r, "k": len(tables.forces), "s": len(tables.mass), "g": g, **of_factors}


def _are_modal_links_free(tables: Tables) -> bool:
    """Return True if there are modal links, and no constraint acts on their coordinates."""
    widths = tables.blocks[: len(tables.rows), BlockColumn.WIDTH]  # blocks of constraints come first
    constrained = set(tables.block_unknowns[: widths.sum()].tolist())
    links = [range(first, first + 3 + modes) for first, modes, _ in tables.modal.tolist()]  # 3 coordinates of the frame, modes
    return len(links) > 0 and all(constrained.isdisjoint(link) for link in links)
