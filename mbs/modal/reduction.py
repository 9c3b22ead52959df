"""Reduction of a `Modal` link to its inertia, chosen modes, and the motion of its joints in each mode."""

from dataclasses import dataclass
from functools import lru_cache
from math import isclose
from pathlib import Path
from typing import Any

import numpy as np

from ..elements.modal import CraigBampton, FreeModes, Interface, MeshFile, Modal
from ..geometry import Array
from ..validate import positive
from .mesh import bar_grid, read_mesh
from .planar import PlanarModel
from .solid import MOTIONS, Solid, assemble, craig_bampton, free_modes, participation, rigid_fit, rigid_motions, slices


@dataclass(frozen=True, eq=False)
class ReducedModel:
    """Inertia and chosen modes of a link in space, normalised to modal masses of 1."""

    nodes: Array  # places of the mesh's nodes in link axes [m], (n, 3)
    numbers: Array  # numbers of the modes among all flexible ones, from 1, (m,)
    omega: Array  # angular frequencies [rad/s], (m,)
    modes: Array  # displacements of the nodes [1/sqrt(kg)], (m, n, 3)
    participation: Array  # shares of a mode's kinetic energy in each of `solid.MOTIONS`, (m, 4)
    mass: float  # [kg]
    centre: Array  # centre of mass in link axes [m], (3,)
    plane: PlanarModel  # model of the link in the plane of motion

    @property
    def kinds(self) -> list[str]:
        """Dominant motion of each mode: axial, in-plane bending, out-of-plane bending or torsion."""
        return [MOTIONS[k] for k in np.argmax(self.participation, axis=1)]

    def table(self) -> list[tuple[int, float, str, float, bool]]:
        """Return a row for each mode: number, frequency [Hz], dominant motion, its share of energy, True if in the plane."""
        shares = self.participation.max(axis=1, initial=0.0)
        hertz, is_planar = self.omega / (2 * np.pi), moves_in_plane(self.participation)
        return list(zip(self.numbers.tolist(), hertz.tolist(), self.kinds, shares.tolist(), is_planar.tolist(), strict=True))


def moves_in_plane(shares: Array) -> Array:
    """Return the mask (modes,) of the modes in the plane: half or more of the energy of `MOTIONS` is axial or in-plane bending.

    `shares` (modes, 4) are those of `participation`; their sum is below 1, as they lack the deformation of cross-sections.
    """
    return shares[:, :2].sum(axis=1) >= 0.5 * shares.sum(axis=1)


def reduced(modal: Modal, length: float) -> ReducedModel:
    """Mesh, assemble and reduce a link of a length [m]; the result is cached until the file of the mesh changes."""
    file = Path(modal.mesh.path) if isinstance(modal.mesh, MeshFile) else None
    return _reduce_cached(modal, positive("length", length, "m"), file.stat().st_mtime_ns if file and file.is_file() else 0)


@lru_cache(maxsize=32)
def _reduce_cached(modal: Modal, length: float, _stamp: int) -> ReducedModel:  # a new stamp of the file makes a new entry
    mesh, section = modal.mesh, modal.section
    if isinstance(mesh, MeshFile):
        grid, span = read_mesh(mesh)
        if not isclose(span, length, rel_tol=1e-6):
            expected = f"must be the link's length, {length:.9g} m, to 1e-6 of it"
            raise ValueError(f"mesh '{mesh.path}': distance of its joints = {span:.9g} m: {expected}")
    else:
        grid = bar_grid(length, section.thickness, section.width, mesh.elements)
    # a planar mesh has the width of the section as its thickness
    return reduce_solid(assemble(grid, length, section.material, section.width), modal)


def reduce_solid(solid: Solid, modal: Modal) -> ReducedModel:
    """Compute the modes of an assembled link, choose those that `modal` names, and make the planar model of them."""
    joints = (np.zeros(3), np.array([solid.length, 0.0, 0.0]))
    interfaces = _interfaces(solid, joints, modal.interface)
    choice: Any = modal.modes  # not None: a link with a mesh has modes
    omega, modes = _all_modes(solid, choice, interfaces)
    shares = participation(solid, modes)
    chosen, damping = _choose(modal, moves_in_plane(shares), omega, solid.rigid)
    omega, modes, shares = omega[chosen], modes[chosen], shares[chosen]
    middle = (joints[0] + joints[1]) / 2
    sections = [*zip(interfaces, joints, strict=True), (_section_at(solid, middle), middle)]
    is_planar = moves_in_plane(shares)
    numbers, omega_planar, damping = chosen[is_planar] + 1, omega[is_planar], damping[is_planar]
    plane = _make_planar(solid, sections, modes[is_planar], numbers=numbers, frequency=omega_planar, damping=damping)
    return ReducedModel(solid.nodes, chosen + 1, omega, modes, shares, plane.mass, solid.centre, plane)


def _make_planar(solid: Solid, sections: list[tuple[Array, Array]], modes: Array, **properties: Array) -> PlanarModel:
    """Make the planar model from k modes in the plane, (k, nodes, 3), and `properties`: `numbers`, `frequency` and `damping`.

    `sections` has nodes and axis point of the cross-sections at start, end and middle, as in `planar.STATIONS`. Names are those
    of `PlanarModel`. X is the place of a node from the centre of mass, phi_k the displacement of that node in mode k. Integrals
    over the mass are of the components of X and phi_k in the plane.
    """
    # displacements and rotations in x, y, z of each section in each mode, (3, k, 6)
    at_stations = np.stack([np.hstack(rigid_fit(solid, nodes, about, modes)) for nodes, about in sections])
    axis_x, axis_modes = _sample_axis(solid, modes, joint_modes=at_stations[:2, :, :2])
    arms, shapes = (solid.nodes - solid.centre)[:, :2], modes[..., :2]  # X and phi_k
    mass_shapes = np.array([solid.mass @ shape for shape in shapes])  # `mass` (nodes, nodes) [kg] is the same for x and y
    mass_shapes = mass_shapes.reshape(-1, *arms.shape)  # (k, nodes, 2), also for k = 0
    products = np.einsum("kn,ln->kl", shapes[..., 0], mass_shapes[..., 1])  # integrals of phi_kx phi_ly dm
    return PlanarModel(
        length=solid.length, mass=float(solid.mass.sum()), centre=solid.centre[:2],
        inertia=float(np.einsum("na,na->", arms, solid.mass @ arms)),
        shapes=at_stations[:, :, [0, 1, 5]].transpose(0, 2, 1),  # x, y, rotation in the plane
        radial=np.einsum("na,kna->k", arms, mass_shapes),  # integrals of X . phi_k dm
        gram=np.einsum("kna,lna->kl", shapes, mass_shapes),  # of phi_k . phi_l dm
        gyration=products - products.T,  # of phi_k x phi_l dm
        line=np.column_stack([axis_x, np.zeros_like(axis_x)]) - solid.centre[:2],  # points of the axis, and phi_k there
        line_shapes=axis_modes.transpose(1, 2, 0), **properties,
    )  # fmt: skip


def _all_modes(solid: Solid, choice: FreeModes | CraigBampton, interfaces: tuple[Array, Array]) -> tuple[Array, Array]:
    """Compute the modes among which the user chooses: all Craig-Bampton modes, or free modes up to the highest number."""
    # The eigensolver, ARPACK, finds at most n - 1 modes of n coordinates. The limit `most` leaves out 2, which is chosen.
    if isinstance(choice, CraigBampton):
        most = solid.dim * (len(solid.nodes) - sum(map(len, interfaces))) - 2
        if choice.fixed > most:
            raise ValueError(f"fixed = {choice.fixed}: must lie in [0, {most}] for this mesh")
        return craig_bampton(solid, interfaces, choice.fixed)
    most, highest = solid.dim * len(solid.nodes) - solid.rigid - 2, max(choice.numbers)
    surplus = 2  # so that modes of equal frequency are not cut apart: `solid` makes their combinations unique together
    if choice.counting != "in-plane":
        return free_modes(solid, min(highest + surplus, most))
    count = 3 * highest + surplus  # a first guess, doubled until enough of the modes lie in the plane
    while True:
        omega, modes = free_modes(solid, min(count, most))
        if moves_in_plane(participation(solid, modes)).sum() >= highest or count >= most:
            return omega, modes
        count *= 2


def _choose(modal: Modal, is_planar: Array, omega: Array, rigid: int) -> tuple[Array, Array]:
    """Return indices of the chosen modes among the flexible ones, and their damping ratios.

    The numbers of `FreeModes` or `CraigBampton` count modes by their `counting`: "flexible" ones, "in-plane" flexible ones, or
    "free" ones, of which the first `rigid` are rigid motions. Rigid motions are left out of the result.
    """
    choice: Any = modal.modes
    if choice.numbers is None:  # the default of Craig-Bampton modes
        chosen = np.flatnonzero(is_planar)
        return chosen, np.broadcast_to(modal.ratios(omega[chosen]), chosen.shape).astype(float)  # `Modal` allows no list here
    counted = np.flatnonzero(is_planar) if choice.counting == "in-plane" else np.arange(len(is_planar))
    skipped = rigid if choice.counting == "free" else 0  # the user's numbers up to this one are rigid motions
    numbers, most = np.array(choice.numbers) - skipped, len(counted) + skipped  # `most` is the largest number the user may give
    is_flexible = numbers > 0
    if numbers.max() > len(counted):
        where = f"with counting = {choice.counting!r} on this mesh"
        raise ValueError(f"numbers = {choice.numbers!r}: must lie in [1, {most}] {where}")
    chosen = counted[numbers[is_flexible] - 1]
    if isinstance(modal.damping, tuple):  # one ratio for each of the user's numbers, also of rigid modes
        return chosen, np.array(modal.damping, dtype=float)[is_flexible]
    return chosen, np.broadcast_to(modal.ratios(omega[chosen]), chosen.shape).astype(float)


def _interfaces(solid: Solid, joints: tuple[Array, Array], interface: Interface) -> tuple[Array, Array]:
    """Find the nodes of the two interfaces; too few to determine a rigid motion, or shared nodes, raise a ValueError."""
    found = []
    for name, joint in zip(("start", "end"), joints, strict=True):
        nodes = np.flatnonzero(interface(solid.nodes, joint))
        if not _is_determined(solid, nodes, joint):
            least = "3 at least, not in one line" if solid.dim == 3 else "2 at least"
            raise ValueError(f"interface = {interface!r}: {len(nodes)} nodes at the {name} joint: must be {least}")
        found.append(nodes)
    if set(found[0]) & set(found[1]):
        raise ValueError(f"interface = {interface!r}: the two joints share nodes: must be apart; make it smaller")
    return found[0], found[1]


def _is_determined(solid: Solid, nodes: Array, about: Array) -> bool:
    """Return True if displacements of the nodes determine a rigid motion: 3 nodes not in one line in space, 2 in the plane."""
    motion = rigid_motions((solid.nodes[nodes] - about) / solid.length, solid.dim)
    return bool(np.linalg.matrix_rank(motion, tol=1e-6) == solid.rigid)  # 1e-6 of the length: chosen


def _section_at(solid: Solid, place: Array) -> Array:
    """Find the nodes nearest in x to a place on the axis, as few as determine a rigid motion."""
    away = np.abs(solid.nodes[:, 0] - place[0])
    for nearest in np.unique(away):
        nodes = np.flatnonzero(away <= nearest + 1e-9 * solid.length)  # 1e-9: nodes of one section differ by rounding
        if _is_determined(solid, nodes, place):
            return nodes
    raise ValueError("mesh: all nodes lie on one line: must be a solid")


def _sample_axis(solid: Solid, modes: Array, joint_modes: Array) -> tuple[Array, Array]:
    """Compute places x [m] of points of the link's axis, (p,), and the displacements (x, y) there of k modes, (k, p, 2).

    At start and end they are given as `joint_modes` (2, k, 2). Between them they are rigid motions fitted to slices of the link.
    """
    places, displacements = [0.0], [joint_modes[0]]
    for nodes in slices(solid):
        weights = solid.weights[nodes]  # lumped masses
        x = float(weights @ solid.nodes[nodes, 0] / weights.sum())
        if 0 < x < solid.length:
            places.append(x)
            displacement, _rotation = rigid_fit(solid, nodes, np.array([x, 0.0, 0.0]), modes)
            displacements.append(displacement[:, :2])
    return np.array([*places, solid.length]), np.stack([*displacements, joint_modes[1]], axis=1)
