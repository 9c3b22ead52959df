"""Natural frequencies about an equilibrium or a pose, with the geometric stiffness of what the constraints carry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.mbs.spectral.markers import place_markers
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.start import slopes
from buckler.mbs.statics.problem import modes
from buckler.mbs.statics.rest import Equilibrium, equilibrium

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Frequencies:
    """Small motions about a state.

    Attributes
    ----------
    scene : Scene
    q : array, shape (n,)
        The state.
    squared : array, shape (count,)
        Squared angular frequencies, 1/s^2, ascending; negative where the state is unstable.
    shapes : array, shape (n, count)
        Rates of the coordinates, z^T M z = 1.
    """

    scene: Scene
    q: Array
    squared: Array
    shapes: Array

    @property
    def angular(self) -> Array:
        """Angular frequencies, rad/s; nan for those of an instability."""
        return np.where(self.squared >= 0, np.sqrt(np.abs(self.squared)), np.nan)

    @property
    def hertz(self) -> Array:
        """Frequencies, Hz."""
        return self.angular / (2 * np.pi)

    def point(self, link: str, point: str) -> Array:
        """Motion of a point of a link in each shape: x, y, angle; shape (3, count)."""
        place_markers(self.scene.tables, self.scene.work, self.q, np.zeros(self.scene.size))
        return slopes(self.scene, self.scene.marker(link, point), self.q) @ self.shapes


def frequencies(
    mechanism: Any, about: Equilibrium | Array | None = None, *, count: int = 6, degree: int | None = None
) -> Frequencies:
    """Natural frequencies of a mechanism with its drives held.

    Parameters
    ----------
    mechanism : Mechanism
    about : Equilibrium or array (n,), optional
        An equilibrium, or coordinates of any pose, whose multipliers then balance the forces as well as they can. By default the
        equilibrium under the mechanism's loads.
    count : int
        Lowest ones wanted.
    degree : int, optional
        Of the strips' polynomials, where `about` is no equilibrium.

    Raises
    ------
    StaticsError
        If no equilibrium is found.
    """
    if about is None:
        about = equilibrium(mechanism, degree=degree)
    if isinstance(about, Equilibrium):
        scene, q, lam = about.scene, about.q, about.multipliers
    else:
        scene, q = Scene.of(mechanism, degree), np.array(about, dtype=float)
        out = scene.assemble(q, tangents=False)
        lam = np.linalg.lstsq(out.jacobian.T, out.force, rcond=1e-10)[0] if len(out.jacobian) else np.zeros(0)
    a = scene.assemble(q, lam=lam)
    squared, shapes = modes(a.stiffness, scene.mass_at(q), a.jacobian, scene.units, count)
    return Frequencies(scene, q, squared, shapes)
