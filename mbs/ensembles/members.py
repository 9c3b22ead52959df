"""Numbers and initial states of the members of an ensemble, by a scrambled Sobol' sequence and random offsets.

A number varies by a list of values or by a distribution. A cell is a mechanism with one value of each list, and has many members.
Without lists, each mechanism is a cell.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any, Self

import numpy as np

from ..documents.document import change
from ..elements.clearance import Clearance
from ..geometry import Array
from ..mechanism import Mechanism
from ..sensitivity.numbers import Family
from ..spectral.scene import CompiledScene
from ..spectral.start import differentiate_marker, draw_offset
from ..spectral.tables import Forces
from ..validate import whole

WIDEST = 0.9
"""Largest initial eccentricity of a journal over its clearance: at 1 a pin touches its bush and would start with an impact."""
TINY = 1e-9
"""Standard deviation of the initial offset of a mechanism without clearance, relative to the longest link or in rad."""


@dataclass(frozen=True)
class Members:
    """Numbers of all members, by their paths in a file, such as `joints[0].gap`, and seed of their initial states."""

    sources: tuple[Mechanism | dict[str, Any], ...]  # mechanisms, or the contents of their files if numbers vary
    paths: tuple[str, ...]  # of the numbers that vary
    numbers: Array  # a row for each member of any cell, (members, paths)
    cells: Array  # index of the member's cell, (members,)
    grid: dict[str, Array]  # lists of values, by path
    seed: int

    @classmethod
    def draw(cls, mechanisms: Sequence[Mechanism], members: int, vary: Mapping[str, Any], seed: int) -> Self:
        """Draw the numbers of all members; each cell has `members` of them.

        `vary` maps a path to a list of values or to a frozen distribution of `scipy.stats`. Quantiles of distributions are the
        points of a scrambled Sobol' sequence. Raise a ValueError if there is no number at a path.
        """
        whole("members", members, 1, 10**8)
        grid = {path: np.asarray(values, dtype=float) for path, values in vary.items() if not hasattr(values, "ppf")}
        for path, listed in grid.items():
            if listed.ndim != 1 or not listed.size or not np.isfinite(listed).all():
                raise ValueError(f"vary['{path}']: give a distribution of scipy.stats, or a list of finite values")
        distributions = {path: distribution for path, distribution in vary.items() if path not in grid}
        for mechanism in mechanisms if vary else ():
            Family.of(mechanism, vary)  # for its ValueError alone, if there is no number at a path
        combinations = np.array(list(product(*grid.values())))  # of listed values, (combinations, lists); without lists (1, 0)
        cell_values = np.tile(combinations, (len(mechanisms), 1))  # (cells, lists)
        count = members * len(cell_values)
        values = {path: np.repeat(cell_values[:, k], members) for k, path in enumerate(grid)}
        if distributions:
            from scipy.stats import qmc  # slow to load

            power = int(np.ceil(np.log2(max(count, 2))))  # the sequence is balanced over 2^power points
            quantiles = qmc.Sobol(len(distributions), seed=np.random.default_rng(seed)).random_base2(power)[:count]
            for column, (path, distribution) in zip(quantiles.T, distributions.items(), strict=True):
                values[path] = np.asarray(distribution.ppf(column), dtype=float)
        numbers = np.column_stack([values[path] for path in vary]) if vary else np.empty((count, 0))
        sources = tuple(mechanism.to_dict() if vary else mechanism for mechanism in mechanisms)
        return cls(sources, tuple(vary), numbers, np.repeat(np.arange(len(cell_values)), members), grid, seed)

    def __len__(self) -> int:
        return len(self.numbers)

    def mechanism_index(self, k: int) -> int:
        """Return the index of the mechanism of member k."""
        cells_per_mechanism = prod(len(values) for values in self.grid.values())
        return int(self.cells[k]) // cells_per_mechanism

    def mechanism(self, k: int) -> Mechanism:
        """Make the mechanism of member k."""
        source = self.sources[self.mechanism_index(k)]
        if isinstance(source, Mechanism):
            return source
        return Mechanism.from_dict(change(source, dict(zip(self.paths, self.numbers[k].tolist(), strict=True))))

    def draw_offset(self, scene: CompiledScene, k: int) -> Array:
        """Draw the initial offset of the coordinates of member k: random places of journals, or a tiny offset, shape (n,)."""
        random = np.random.default_rng([self.seed, k])
        of_journals = displace_journals(scene, random)
        if of_journals is not None:
            return of_journals
        seed_of_offset = int(random.integers(2**31))
        return draw_offset(scene, TINY, seed_of_offset)


def displace_journals(scene: CompiledScene, random: np.random.Generator) -> Array | None:
    """Draw an offset of coordinates (n,) that puts each journal at a random place in its bush; None without clearance.

    Places are distributed uniformly over the bush. Without the offset dq, journals are in the centres of their bushes. It solves
    J dq = places and G dq = 0, where J and G are the Jacobians of the places and of the constraints. The pseudo-inverse gives the
    least such dq.
    """
    elements = scene.source.elements
    joints, relative = [], []
    for k, name in enumerate(scene.force_names):
        if isinstance(joint := elements.get(name), Clearance):
            journal, bush = map(int, scene.tables.forces[k, [Forces.A, Forces.B]])  # their markers
            joints.append(joint)
            of_journal, of_bush = (differentiate_marker(scene, marker, scene.q0) for marker in (journal, bush))
            relative.append((of_journal - of_bush)[:2])  # rows of x and y of d(x, y, angle)/dq, (3, n)
    if not joints:
        return None
    radius = np.array([joint.gap for joint in joints]) * WIDEST * np.sqrt(random.uniform(size=len(joints)))
    angle = random.uniform(0.0, 2 * np.pi, len(joints))
    target = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]).ravel()
    constraints = scene.assemble(scene.q0, tangents=False).jacobian
    matrix, units = np.vstack([*relative, constraints]), scene.units
    right = np.concatenate([target, np.zeros(len(constraints))])
    # rcond, chosen: smaller singular values, over the largest, count as zero; redundant constraints have such
    return np.asarray(units * (np.linalg.pinv(matrix * units, rcond=1e-10) @ right))
