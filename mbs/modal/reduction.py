"""Reduction of a `Modal` link: inertia, chosen modes, their motion at the joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import isclose
from pathlib import Path
from typing import Any

import numpy as np

from ..elements.modal import AdamsDamping, CraigBampton, FreeModes, Interface, MeshFile, Modal
from ..geometry import Array
from ..validate import positive
from .mesh import bar_grid, read_mesh
from .planar import PlanarModel
from .solid import MOTIONS, Solid, assemble, craig_bampton, free_modes, participation, rigid_fit, rigid_motions, slices


@dataclass(frozen=True, eq=False)
class ReducedModel:
    """A solid link by its inertia and some of its modes, mass-normalised (modal masses 1).

    Attributes
    ----------
    nodes : array, shape (n, 3)
        Places of the mesh's nodes in link axes [m].
    numbers : array of int, shape (m,)
        Numbers of the modes among all flexible ones.
    omega : array, shape (m,)
        Angular frequencies [rad/s].
    modes : array, shape (m, n, 3)
        Displacements of the nodes [1/sqrt(kg)].
    participation : array, shape (m, 4)
        Shares of kinetic energy by `buckler.mbs.modal.solid.MOTIONS`.
    mass, centre
        kg; centre of mass in link axes, m, shape (3,).
    plane : PlanarModel
        Its modes and inertia in the plane of motion.
    """

    nodes: Array
    numbers: Array
    omega: Array
    modes: Array
    participation: Array
    mass: float
    centre: Array
    plane: PlanarModel

    @property
    def kinds(self) -> list[str]:
        """Dominant motion of each mode, of `MOTIONS`."""
        return [MOTIONS[k] for k in np.argmax(self.participation, axis=1)]

    @property
    def moves_in_plane(self) -> Array:
        """Mask of the modes in the plane, shape (m,); a planar mechanism cannot excite the others."""
        return plane_part(self.participation)

    def table(self) -> list[tuple[int, float, str, float, bool]]:
        """For each mode: number, Hz, kind, share of that kind, whether it is in the plane of motion."""
        shares = self.participation.max(axis=1, initial=0.0)
        rows = zip(self.numbers, self.omega / (2 * np.pi), self.kinds, shares, self.moves_in_plane, strict=True)
        return [(int(n), float(f), kind, float(share), bool(seen)) for n, f, kind, share, seen in rows]


def plane_part(shares: Array) -> Array:
    """Find the modes with half of their sections' kinetic energy in the plane at least, a mask of shape (modes,)."""
    return shares[:, :2].sum(axis=1) >= 0.5 * shares.sum(axis=1)


def reduced(modal: Modal, length: float) -> ReducedModel:
    """Mesh, assemble and reduce a link of this length [m]; cached while the mesh's file is the same."""
    file = Path(modal.mesh.path) if isinstance(modal.mesh, MeshFile) else None
    return _reduce_cached(modal, positive("length", length, "m"), file.stat().st_mtime_ns if file and file.is_file() else 0)


@lru_cache(maxsize=32)
def _reduce_cached(modal: Modal, length: float, _stamp: int) -> ReducedModel:
    mesh, section = modal.mesh, modal.section
    if isinstance(mesh, MeshFile):
        grid, span = read_mesh(mesh)
        if not isclose(span, length, rel_tol=1e-6):
            wanted = f"must be the link's length, {length:.9g} m, to 1e-6 of it"
            raise ValueError(f"mesh '{mesh.path}': distance of its joints = {span:.9g} m: {wanted}")
    else:
        grid = bar_grid(length, section.thickness, section.width, mesh.elements)
    return reduce_solid(assemble(grid, length, section.material, section.width), modal)


def reduce_solid(solid: Solid, modal: Modal) -> ReducedModel:
    """Reduce an assembled link."""
    joints = (np.zeros(3), np.array([solid.length, 0.0, 0.0]))
    interfaces = _interfaces(solid, joints, modal.interface)
    wanted: Any = modal.modes  # not None: a solid has modes
    omega, modes = _all_modes(solid, wanted, interfaces)
    shares = participation(solid, modes)
    chosen, damping = _choose(modal, plane_part(shares), omega, solid.rigid)
    omega, modes, shares = omega[chosen], modes[chosen], shares[chosen]
    middle = (joints[0] + joints[1]) / 2
    places = [*zip(interfaces, joints, strict=True), (_section_at(solid, middle), middle)]
    seen = plane_part(shares)
    in_plane = modes[seen]
    at_stations = np.stack([np.hstack(rigid_fit(solid, nodes, about, in_plane)) for nodes, about in places])
    line, line_modes = _line(solid, in_plane, at_stations)
    arms, flat = (solid.nodes - solid.centre)[:, :2], in_plane[..., :2]
    heavy = np.array([solid.mass @ mode for mode in flat]).reshape(-1, *arms.shape)
    moments, mass = np.einsum("kn,ln->kl", flat[..., 0], heavy[..., 1]), float(solid.mass.sum())
    plane = PlanarModel(
        length=solid.length,
        mass=mass,
        inertia=float(np.einsum("na,na->", arms, solid.mass @ arms)),
        centre=solid.centre[:2],
        numbers=chosen[seen] + 1,
        frequency=omega[seen],
        damping=damping[seen],
        shapes=at_stations[:, :, [0, 1, 5]].transpose(0, 2, 1),
        radial=np.einsum("na,kna->k", arms, heavy),
        gram=np.einsum("kna,lna->kl", flat, heavy),
        gyration=moments - moments.T,
        line=np.column_stack([line, np.zeros_like(line)]) - solid.centre[:2],
        line_shapes=line_modes.transpose(1, 2, 0),
    )
    return ReducedModel(solid.nodes, chosen + 1, omega, modes, shares, mass, solid.centre, plane)


def _all_modes(solid: Solid, wanted: FreeModes | CraigBampton, interfaces: tuple[Array, Array]) -> tuple[Array, Array]:
    """Compute all modes from which numbers choose; free ones up to the highest number."""
    if isinstance(wanted, CraigBampton):
        most = solid.dim * (len(solid.nodes) - sum(map(len, interfaces))) - 2
        if wanted.fixed > most:
            raise ValueError(f"fixed = {wanted.fixed}: must lie in [0, {most}], as many as the mesh has")
        return craig_bampton(solid, interfaces, wanted.fixed)
    most, highest = solid.dim * len(solid.nodes) - solid.rigid - 2, max(wanted.numbers)
    count = (3 if wanted.counting == "in-plane" else 1) * highest + 2  # both modes of a pair of equal frequency
    while True:
        omega, modes = free_modes(solid, min(count, most))
        found = plane_part(participation(solid, modes)).sum() if wanted.counting == "in-plane" else count
        if found >= highest or count >= most:
            return omega, modes
        count *= 2


def _choose(modal: Modal, seen: Array, omega: Array, rigid: int) -> tuple[Array, Array]:
    """Return indices of the chosen modes among the flexible ones, and their damping ratios; rigid modes are left out."""
    wanted: Any = modal.modes
    if wanted.numbers is None:
        chosen = np.flatnonzero(seen)
        return chosen, np.broadcast_to(modal.ratios(omega[chosen]), chosen.shape).astype(float)
    have = np.flatnonzero(seen) if wanted.counting == "in-plane" else np.arange(len(seen))
    skipped = rigid if wanted.counting == "free" else 0
    numbers, most = np.array(wanted.numbers) - skipped, len(have) + skipped
    if numbers.max() > len(have):
        where = f"with counting = {wanted.counting!r} on this mesh"
        raise ValueError(f"numbers = {wanted.numbers!r}: must lie in [1, {most}] {where}")
    chosen = have[numbers[numbers > 0] - 1]
    if isinstance(modal.damping, AdamsDamping):
        return chosen, modal.ratios(omega[chosen])
    return chosen, np.broadcast_to(modal.damping, numbers.shape)[numbers > 0].astype(float)


def _interfaces(solid: Solid, joints: tuple[Array, Array], interface: Interface) -> tuple[Array, Array]:
    """Nodes of the two interfaces, enough of them to carry a rigid motion."""
    found = []
    for name, joint in zip(("start", "end"), joints, strict=True):
        nodes = np.flatnonzero(interface(solid.nodes, joint))
        if not _carries(solid, nodes, joint):
            least = "3 at least, not in one line" if solid.dim == 3 else "2 at least"
            raise ValueError(f"interface = {interface!r}: {len(nodes)} nodes at the {name} joint: must be {least}")
        found.append(nodes)
    if set(found[0]) & set(found[1]):
        raise ValueError(f"interface = {interface!r}: the two joints share nodes: must be apart; make it smaller")
    return found[0], found[1]


def _carries(solid: Solid, nodes: Array, about: Array) -> bool:
    """True if these nodes determine a rigid motion."""
    motion = rigid_motions((solid.nodes[nodes] - about) / solid.length, solid.dim)
    return bool(np.linalg.matrix_rank(motion, tol=1e-6) == solid.rigid)


def _section_at(solid: Solid, place: Array) -> Array:
    """Nodes of the cross-section nearest to a place on the axis, enough of them to carry a rigid motion."""
    away = np.abs(solid.nodes[:, 0] - place[0])
    for nearest in np.unique(away.round(12)):
        nodes = np.flatnonzero(away <= nearest + 1e-9 * solid.length)
        if _carries(solid, nodes, place):
            return nodes
    raise ValueError("mesh: all nodes lie on one line: must be a solid")


def _line(solid: Solid, modes: Array, ends: Array) -> tuple[Array, Array]:
    """Compute the in-plane motion of the link's axis, slice by slice between the joints: stations (p,) and (modes, p, 2)."""
    stations, moves = [0.0], [ends[0, :, :2]]
    for nodes in slices(solid):
        weights = solid.weights[nodes]
        x = float(weights @ solid.nodes[nodes, 0] / weights.sum())
        if 0 < x < solid.length:
            stations.append(x)
            moves.append(rigid_fit(solid, nodes, np.array([x, 0.0, 0.0]), modes)[0][:, :2])
    return np.array([*stations, solid.length]), np.stack([*moves, ends[1, :, :2]], axis=1)
