"""State at the start of a run: rates and accelerations that satisfy the constraints; arrays of the integrators.

Coordinates q (n,), rates v, accelerations a, multipliers lambda (r,), forces f, constraints g(q, t) = 0 with G = dg/dq. Their
first derivative by time is G v = speed, with speed = -dg/dt; their second is G a = change, with the terms without a on the right.
"""

from typing import NamedTuple

import numpy as np

from ..geometry import Array
from .entry_points import place
from .frame_body import FrameBody
from .output import DormandPrince, DormandPrinceState, RadauState
from .scene import CompiledScene
from .strip_body import StripBody
from .tables import BlockColumn, Forces, Markers, Memory, Report, StripColumn, Tables

ROUNDING = 1e-12
"""Relative error that counts as rounding: of G v = speed, before start rates are corrected; of multipliers in `balance`."""
MOST_ITERATIONS = 20
"""Iterations after which `balance` returns the last, converged or not; enough for 1e-12 if each divides the change by 4."""
LEAST_RATE = 1e-3
"""Least scale of errors of rates in the explicit method, in units of coordinates [1/s]: at rest no rate gives a scale."""


class Balance(NamedTuple):
    """Solution of the equations of motion at a state."""

    acceleration: Array  # (n,)
    multipliers: Array  # (r,)


def start_rates(scene: CompiledScene) -> Array:
    """Compute the rates of all coordinates at t = 0, (n,), from the velocities of links that the scene's start has.

    Links move as rigid bodies. Strips bend, too, if the linkage cannot move otherwise: their points then have `additional`
    velocities. If these rates violate G v = speed (a pin inside a curved strip), the change of v has least kinetic energy. Raises
    KinematicsError if drives and given velocities contradict each other.
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


def slopes(scene: CompiledScene, marker: int, q: Array) -> Array:
    """Compute the derivatives of a marker's (x, y, angle) by the coordinates, shape (3, n)."""
    place(scene.tables, scene.work, q, np.zeros(scene.size))  # fills `work.jacobian`, the derivatives of all markers
    first, count = scene.tables.markers[marker, [Markers.FIRST, Markers.COUNT]]
    out = np.zeros((3, scene.size))
    for i in range(first, first + count):
        out[:, scene.tables.dofs[i]] += scene.work.jacobian[:, i]
    return out


def balance(scene: CompiledScene, q: Array, v: Array, t: float = 0.0, memory: Array | None = None) -> Balance:
    """Solve M a + G^T lambda = f, G a = change at a state; multipliers of redundant rows are zero.

    Where friction depends on lambda its force is that of the last lambda, until this fixed point iteration converges.
    """
    lam = np.zeros(len(scene.tables.rows))
    depends_on_multipliers = (scene.tables.forces[:, Forces.ROW] >= 0).any()
    for _ in range(MOST_ITERATIONS):
        out = scene.assemble(q, v, t, lam, memory, tangents=False, sparse=True)
        acceleration, new = scene.accelerate(q, out.force, out.change)
        converged = np.abs(new - lam).max(initial=0.0) <= ROUNDING * np.abs(new).max(initial=1e-300)
        lam = new
        if converged or not depends_on_multipliers:
            break
    return Balance(acceleration, lam)


def offset(scene: CompiledScene, spread: float, seed: int) -> Array:
    """Draw a random change of the coordinates at t = 0, (n,), that satisfies the constraints to first order.

    Components are normal with standard deviation `spread`, in m or rad; those of modal coordinates are 0. The projection by the
    pseudo-inverse of G, which comes after, may change modal coordinates, too.
    """
    step = spread * np.random.default_rng(seed).standard_normal(scene.size)
    for body in scene.builder.bodies.values():
        if isinstance(body, FrameBody):
            step[body.offset + 3 : body.offset + 3 + body.modes] = 0.0
    jacobian = scene.assemble(scene.q0, tangents=False).jacobian
    return step - np.linalg.pinv(jacobian, rcond=1e-10) @ (jacobian @ step) if len(jacobian) else step


def radau_state(scene: CompiledScene, q: Array, v: Array, a: Array, lam: Array, memory: Array) -> RadauState:
    """Allocate the state and work arrays of an implicit run that starts from this state; `memory` has the columns `Memory`.

    The fields are in the order of `output.RadauState`, which tells what they are. `z` makes zeros.
    """
    tables, newton, mass, z = scene.tables, scene.fronts, scene.mass_fronts, np.zeros
    n, r, forces, elastic = len(q), len(lam), len(memory), len(tables.elastic)
    points = int(tables.strips[:, StripColumn.POINTS].sum())  # Gauss points of all strips
    unknowns, slots, entries = n + r, len(tables.mass), _count_jacobian_entries(tables)  # `slots`: one more, for blocks' zeros
    largest, exchanges = max(newton.largest, mass.largest), len(newton.unknowns)
    stresses, reports = (points, 3), (forces, len(Report))
    return RadauState(
        # the state at a step's start, at its nodes, and of the last step
        q=np.array(q, float), v=np.array(v, float), a=np.array(a, float), lam=np.array(lam, float), stress=z(stresses),
        node_q=z((3, n)), node_v=z((3, n)), node_a=z((3, n)), node_lam=z((3, r)),
        node_stress=z((3, *stresses)), node_stress_residual=z((3, *stresses)),
        past_v=z((4, n)), past_lam=z(r), past_stress=z(stresses),
        # Newton's method, and the terms of the equations
        residual=z((3, unknowns)), right_side=z(unknowns), real_solution=z(unknowns),
        complex_solution=z(unknowns, dtype=complex), dq=z((3, n)), dv=z((3, n)),
        force=z(n), violation=z(r), speed=z(r), change=z(r), jacobian=z(entries), start_jacobian=z(entries),
        # matrices, their factors and row exchanges
        saddle_mass=z(slots), damping=z(slots), stiffness=z(slots), real_matrix=z(slots), complex_matrix=z(slots, dtype=complex),
        real_factors=z(newton.size), complex_factors=z(newton.size, dtype=complex),
        real_swaps=z(exchanges, dtype=np.int64), complex_swaps=z(exchanges, dtype=np.int64),
        saddle=tables.mass.copy(), saddle_factors=z(mass.size), saddle_swaps=z(len(mass.unknowns), dtype=np.int64),
        row_magnitude=z(unknowns), front_work=z(largest), complex_front_work=z(largest, dtype=complex),
        # forces, and the error control
        memory=memory.copy(), start_memory=memory.copy(), start_reports=z(reports), end_reports=z(reports),
        largest_force=z(forces), start_deformation=z(elastic), largest_deformation=z(elastic),
        unit=scene.units, inverse_error_unit=z(n), error_unit_across=z(elastic), chord=z((elastic, 2)), error_ratio=np.ones(1),
    )  # fmt: skip


def dormand_prince(scene: CompiledScene, q: Array, v: Array, lam: Array, memory: Array) -> DormandPrince:
    """Allocate the data of an explicit run that starts from this state; `memory` has the columns `Memory`."""
    tables, free_modes = scene.tables, _are_modal_links_free(scene.tables)
    order = scene.find_mass_fronts(constant=free_modes)  # `kernel.couple_modes` then solves for the modes apart
    n, r, k, g, z = len(q), len(lam), len(memory), _count_jacobian_entries(tables), np.zeros
    y = np.concatenate([q, v, memory[:, Memory.BRISTLE]])
    largest_rate = max(LEAST_RATE, np.abs(v / scene.units).max(initial=0.0))
    state = DormandPrinceState(
        y=y, y_new=y.copy(), y_stage=y.copy(), stage_rates=z((7, len(y))),
        lam=np.array(lam, dtype=float), force=z(n), violation=z(r), speed=z(r), change=z(r), jacobian=z(g),
        factored_jacobian=z(g), matrix=tables.mass.copy(), factors=z(order.size), swaps=z(len(order.unknowns), dtype=np.int64),
        row_magnitude=z(n + r), front_work=z(order.largest), right_side=z(n + r),
        memory=memory.copy(), start_reports=z((k, len(Report))),
        largest_rate=np.array([largest_rate]), units=scene.units,
        has_factors=z(1, dtype=np.int64), free_modes=np.array([int(free_modes)]),
    )  # fmt: skip
    return DormandPrince(tables, order, scene.work, state)


def _count_jacobian_entries(tables: Tables) -> int:
    """Count the entries of G as the kernel stores it: the unknowns of all constraints' blocks."""
    return int(tables.blocks[: len(tables.rows), BlockColumn.WIDTH].sum())


def _are_modal_links_free(tables: Tables) -> bool:
    """Return True if there are modal links, and no constraint acts on their coordinates."""
    blocks, unknowns = tables.blocks[: len(tables.rows)], tables.block_unknowns  # blocks of constraints
    constrained = {int(x) for first, width, _ in blocks for x in unknowns[first : first + width]}
    links = [range(first, first + 3 + modes) for first, modes, _ in tables.modal.tolist()]  # 3 coordinates of the frame, modes
    return len(links) > 0 and all(constrained.isdisjoint(link) for link in links)
