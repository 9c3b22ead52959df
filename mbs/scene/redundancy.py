"""Constraints that say what others say, and forces that no equation determines."""

from __future__ import annotations

import numpy as np

from ..geometry import Array
from .linkage import ROUNDING, Linkage
from .start import jacobian

SHARE = 1e-6
"""Part of a row in a vector that no force balances, above which its force counts as shared."""


def find_redundant(linkage: Linkage) -> list[str]:
    """Find the elements whose rows depend on those of others in general position; flexible links are flexible."""
    names, matrix = _constraints(linkage)
    kept = independent_rows(matrix)
    return list(dict.fromkeys(name for k, name in enumerate(names) if k not in kept))


def find_undetermined(linkage: Linkage) -> list[str]:
    """Find the elements whose forces no equation determines: redundant ones share them, in poses in general position."""
    names, matrix = _constraints(linkage)
    left, values, _ = np.linalg.svd(matrix)
    shares = left[:, int((values > ROUNDING * values.max(initial=1.0)).sum()) :]
    free = np.abs(shares).max(axis=1, initial=0.0) > SHARE
    return list(dict.fromkeys(name for name, each in zip(names, free, strict=True) if each))


def _constraints(linkage: Linkage) -> tuple[list[str], Array]:
    """Names and derivatives of all lasting rows in general position; rows of drives come first."""
    rigid, loose = jacobian(linkage, linkage.general_pose)
    unit = np.tile([1.0, 1.0, linkage.size], len(linkage.index))
    order = sorted(linkage.lasting, key=lambda k: linkage.named_rows[k][1].motion is None)
    matrix = np.hstack([rigid / unit, loose / (np.abs(loose).max(initial=0.0) or 1.0)])[order]
    return [linkage.names[k] for k in order], matrix


def independent_rows(matrix: Array) -> list[int]:
    """Rows that say what those before do not."""
    kept: list[int] = []
    basis = np.empty((0, matrix.shape[1]))
    for k, row in enumerate(matrix):
        rest = row - basis.T @ (basis @ row)
        rest = rest - basis.T @ (basis @ rest)
        if float(np.linalg.norm(rest)) > ROUNDING * max(1.0, float(np.linalg.norm(row))):
            basis = np.vstack([basis, rest / np.linalg.norm(rest)])
            kept.append(k)
    return kept
