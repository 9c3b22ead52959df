"""Modes of a solid link: free ones, Craig-Bampton ones, and what each of them does (bends, twists, stretches).

All modes are mass-normalised, orthogonal to the six rigid motions, and have the shape (modes, nodes, 3).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from ..geometry import Array
from .solid import Solid, rigid_motions

MOTIONS = ("axial", "in-plane bending", "out-of-plane bending", "torsion")
"""Motions of a mode; the first two move the link in the plane."""
SLABS = 24
"""Slices across the link by which a mode's motion is read."""
IN_PLANE = 1e-6
"""Mean share of energy in the plane below which modes of one frequency stay as they are: rounding leaves 1e-12."""
CLUSTER = 1e-3
"""Relative distance of frequencies that count as one: a square bar's two bending modes come in any mixture."""


def free_modes(solid: Solid, count: int) -> tuple[Array, Array]:
    """Compute the lowest flexible modes of the unsupported link.

    Returns
    -------
    omega : array, shape (count,)
        Angular frequencies, rad/s.
    shapes : array, shape (count, nodes, 3)
        1/sqrt(kg).
    """
    stiffness, mass = solid.stiffness, solid.full_mass
    speed = np.sqrt(solid.material.modulus / solid.material.density)
    shift = -1e-4 * (speed / solid.length) ** 2  # below all of them; the unshifted stiffness is singular
    factors = scipy.sparse.linalg.splu((stiffness - shift * mass).tocsc())
    squares, vectors = _lowest(stiffness, mass, count + solid.rigid, shift, factors)
    flexible = np.argsort(squares)[solid.rigid :]
    return _tidy(solid, np.sqrt(squares[flexible]), vectors[:, flexible])


def craig_bampton(solid: Solid, interfaces: tuple[Array, Array], fixed: int) -> tuple[Array, Array]:
    """Compute flexible Craig-Bampton modes (doi 10.2514/3.4741), made orthogonal: 6 static (3 in the plane) and vibrating ones.

    Parameters
    ----------
    interfaces : two arrays of int
        Nodes of the two interfaces; each moves as a rigid body.
    fixed : int
        Number of fixed-interface modes.

    Returns
    -------
    omega, shapes
        As `free_modes`; as many as static and fixed ones.
    """
    dim, static = solid.dim, 2 * solid.rigid
    boundary = np.concatenate([np.add.outer(dim * nodes, np.arange(dim)).ravel() for nodes in interfaces])
    inner = np.setdiff1d(np.arange(dim * len(solid.nodes)), boundary)
    centred = (solid.nodes[nodes] - solid.nodes[nodes].mean(axis=0) for nodes in interfaces)
    motion = scipy.linalg.block_diag(*(rigid_motions(places, dim) for places in centred))
    stiffness, mass = solid.stiffness.tocsr(), solid.full_mass.tocsr()
    inside = stiffness[inner][:, inner].tocsc()
    factors = scipy.sparse.linalg.splu(inside)
    basis = np.zeros((dim * len(solid.nodes), static + fixed))
    basis[boundary, :static] = motion
    basis[inner, :static] = -factors.solve(stiffness[inner][:, boundary] @ motion)
    if fixed:
        _, basis[inner, static:] = _lowest(inside, mass[inner][:, inner].tocsc(), fixed, 0.0, factors)
    scale = np.sqrt(np.einsum("ij,ij->j", basis, mass @ basis))
    basis = basis / scale
    squares, mix = scipy.linalg.eigh(basis.T @ (stiffness @ basis), basis.T @ (mass @ basis))
    return _tidy(solid, np.sqrt(squares[solid.rigid :]), basis @ mix[:, solid.rigid :])


def _lowest(stiffness: Any, mass: Any, count: int, shift: float, factors: Any) -> tuple[Array, Array]:
    """Eigenvalues next to the shift, which the factors have in them, and eigenvectors."""
    inverse = scipy.sparse.linalg.LinearOperator(stiffness.shape, factors.solve)
    start = np.cos(np.arange(mass.shape[0]))  # any fixed vector: the modes are the same in each run
    found: tuple[Array, Array] = scipy.sparse.linalg.eigsh(stiffness, count, mass, shift, v0=start, OPinv=inverse)
    return found


def participation(solid: Solid, shapes: Array) -> Array:
    """Shares of each mode's kinetic energy by `MOTIONS`, shape (modes, 4): the cross-sections' rigid motion.

    What is missing to 1 deforms the sections.
    """
    return np.stack([np.einsum("kk->k", form) for form in _section_forms(solid, shapes)], axis=1)


def rigid_fit(solid: Solid, nodes: Array, about: Array, shapes: Array) -> tuple[Array, Array]:
    """Fit the mean motion of some nodes: mass-weighted least squares of a translation of the point `about` and a rotation.

    Returns
    -------
    translation, rotation : arrays, shape (modes, 3)
    """
    motion = rigid_motions(solid.nodes[nodes] - about)
    weights = np.repeat(np.sqrt(solid.weights[nodes]), 3)
    size = np.array([1.0, 1, 1, *np.full(3, 1 / solid.length)])  # one unit for all six columns
    field = shapes[:, nodes].reshape(len(shapes), 3 * len(nodes))
    fitted = size[:, None] * np.linalg.lstsq(weights[:, None] * motion * size, (weights * field).T, rcond=None)[0]
    return fitted[:3].T, fitted[3:].T


def slices(solid: Solid, count: int = SLABS) -> list[Array]:
    """Nodes of the slices across the link, from its one end to the other."""
    x = solid.nodes[:, 0]
    place = (x - x.min()) / np.ptp(x)
    number = np.minimum((place * count + 1e-9).astype(int), count - 1)
    return [found for found in (np.flatnonzero(number == k) for k in range(count)) if len(found)]


def _section_forms(solid: Solid, shapes: Array) -> Array:
    """Kinetic forms of the slices' rigid motion, shape (4, modes, modes), in the order of `MOTIONS`."""
    forms = np.zeros((4, len(shapes), len(shapes)))
    for nodes in slices(solid):
        weights = solid.weights[nodes]
        mass = weights.sum()
        arms = solid.nodes[nodes] - weights @ solid.nodes[nodes] / mass
        moments = np.einsum("n,na,nb->ab", weights, arms, arms)
        inertia = np.trace(moments) * np.eye(3) - moments
        move = np.einsum("n,kna->ka", weights, shapes[:, nodes]) / mass
        spin = np.einsum("n,kna->ka", weights, np.cross(arms, shapes[:, nodes]))
        turn = spin @ np.linalg.pinv(inertia, rcond=1e-9)
        linear = mass * np.einsum("ka,la->akl", move, move)
        rotary = 0.5 * np.einsum("ka,la->akl", turn, spin)
        rotary = rotary + rotary.transpose(0, 2, 1)
        forms += [linear[0], linear[1] + rotary[2], linear[2] + rotary[1], rotary[0]]
    return forms


def _tidy(solid: Solid, omega: Array, vectors: Array) -> tuple[Array, Array]:
    """Remove what rounding left of rigid motion, normalise, settle mixtures and signs."""
    mass, dim = solid.full_mass, solid.dim
    rigid = rigid_motions(solid.nodes - solid.centre, dim)
    vectors = vectors - rigid @ np.linalg.solve(rigid.T @ (mass @ rigid), rigid.T @ (mass @ vectors))
    shapes = (vectors / np.sqrt(np.einsum("ij,ij->j", vectors, mass @ vectors))).T.reshape(len(omega), -1, dim)
    shapes = np.pad(shapes, ((0, 0), (0, 0), (0, 3 - dim)))
    breaks = np.flatnonzero(np.diff(omega) > CLUSTER * omega[1:]) + 1
    # where modes of one frequency mix, the one that moves in the plane most comes first
    for group in np.split(np.arange(len(omega)), breaks):
        if len(group) > 1:
            forms = _section_forms(solid, shapes[group])
            if np.trace(forms[0] + forms[1]) < IN_PLANE * len(group):
                continue
            _, mix = np.linalg.eigh(-(forms[0] + forms[1]) - 1e-3 * forms[0])
            shapes[group] = np.einsum("kl,kna->lna", mix, shapes[group])
            omega[group] = np.sqrt(mix.T**2 @ omega[group] ** 2)
    x = solid.nodes[:, 0]
    first = shapes[:, x <= x.min() + 0.05 * np.ptp(x)].sum(axis=1)
    strongest = np.take_along_axis(first, np.argmax(np.abs(first), axis=1)[:, None], axis=1)
    return omega, shapes * np.where(strongest < 0, -1.0, 1.0)[:, :, None]
