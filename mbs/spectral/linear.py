"""Terms of the equations of motion at a state, with the matrices of their linearised form, and factors of sparse matrices.

    M da + C dv + K dq + (G - X)^T dlambda = df,    G dq = dg.

M is the mass matrix, `CompiledScene.mass_at`. Here da, dv, dq, dlambda are small changes of accelerations, rates, coordinates and
multipliers; df and dg are small additional forces and prescribed changes of the constraints. X, the transpose of df/dlambda, is
due to friction that a constraint's own force causes.

The integrators factor the same matrices in compiled code (`fronts`), whose pivots need a positive definite mass matrix. SuperLU
chooses its pivots freely. So it also factors where neither mass nor stiffness, but only constraints, hold a mechanism.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from ..geometry import Array

Matrix = Any
"""A matrix, an array or a sparse one: SciPy has no type for both."""
MatrixRow = IntEnum("MatrixRow", "CROSS DAMPING STIFFNESS JACOBIAN", start=0)
"""Rows of `Equations.entries`: -df/dlambda, C, K, and G with its transpose."""


@dataclass(frozen=True)
class Equations:
    """Terms of the equations of motion at a state: many uses need forces only, so the matrices are built at first use."""

    force: Array  # f, without the constraints' forces, (n,)
    residual: Array  # residual g(q, t) of the constraints, (r,)
    speed: Array  # right side of dg/dt = 0, G v = speed, (r,)
    change: Array  # right side of d2g/dt2 = 0, G a = change, (r,)
    entries: Array = field(repr=False)  # (4, slots + 1): nonzeros of `MatrixRow`; the last column takes entries known to be zero
    build: Callable[[Array], Matrix] = field(repr=False)  # builds the matrix of all unknowns, (n + r, n + r), from such a row

    @cached_property
    def stiffness(self) -> Matrix:
        """K = -df/dq + d(G^T lambda)/dq, shape (n, n)."""
        return self.build(self.entries[MatrixRow.STIFFNESS])[: len(self.force), : len(self.force)]

    @cached_property
    def damping(self) -> Matrix:
        """C = -df/dv, shape (n, n)."""
        return self.build(self.entries[MatrixRow.DAMPING])[: len(self.force), : len(self.force)]

    @cached_property
    def cross(self) -> Matrix:
        """X, the transpose of df/dlambda, shape (r, n)."""
        return -self.build(self.entries[MatrixRow.CROSS])[: len(self.force), len(self.force) :].T

    @cached_property
    def jacobian(self) -> Matrix:
        """G, shape (r, n)."""
        return self.build(self.entries[MatrixRow.JACOBIAN])[len(self.force) :, : len(self.force)]


class SingularError(ArithmeticError):
    """Failure to invert a matrix."""


class Factors:
    """LU factors of a square sparse matrix, real or complex, by SuperLU."""

    def __init__(self, matrix: Matrix) -> None:
        self.matrix = csc_array(matrix)
        try:
            self._lu = splu(self.matrix)
        except RuntimeError as error:
            raise SingularError(str(error)) from None

    def solve(self, right: Array) -> Array:
        """Solve for right sides (m,) or (m, columns), with one step of refinement; raise a SingularError if not finite."""
        with np.errstate(all="ignore"):
            out = self._solve_once(right)
            out = out + self._solve_once(right - self.matrix @ out)
        if not np.isfinite(out).all():
            raise SingularError("the solution is not finite")
        return out

    def _solve_once(self, right: Array) -> Array:
        if np.iscomplexobj(right) and not np.iscomplexobj(self.matrix):
            return np.asarray(self._lu.solve(right.real) + 1j * self._lu.solve(right.imag))
        return np.asarray(self._lu.solve(np.asarray(right, dtype=self.matrix.dtype)))
