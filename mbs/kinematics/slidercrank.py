"""Slider-crank in closed form, an independent check of the general loop closure."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..laws.pieces import Reals


class SliderCrank(NamedTuple):
    """Slider-crank with a crank of length r, a coupler of length L [m] and a slider at negative x.

    The crank pin is at r (cos theta, sin theta), the slider on the x axis. At theta = pi the slider is farthest from the crank
    pivot. Numbers of equations refer to Demirel et al. 2008, doi 10.1115/IMECE2008-68796.
    """

    crank: float
    coupler: float

    def slider(self, theta: Reals) -> Reals:
        """Compute the slider position x = r cos theta - sqrt(L^2 - r^2 sin^2 theta) [m] (eqs 1-5)."""
        return self.crank * np.cos(theta) - np.sqrt(self.coupler**2 - (self.crank * np.sin(theta)) ** 2)

    def slider_rate(self, theta: Reals) -> Reals:
        """Compute dx/dtheta [m/rad], the slider's velocity over the crank speed."""
        s, c = np.sin(theta), np.cos(theta)
        return -self.crank * s + self.crank**2 * s * c / np.sqrt(self.coupler**2 - (self.crank * s) ** 2)

    def slider_second_rate(self, theta: Reals) -> Reals:
        """Compute d2x/dtheta2 [m/rad^2], the slider's acceleration over the square of a constant crank speed."""
        s, c = np.sin(theta), np.cos(theta)
        q = np.sqrt(self.coupler**2 - (self.crank * s) ** 2)
        return -self.crank * c + self.crank**2 * (c**2 - s**2) / q + (self.crank**2 * s * c) ** 2 / q**3

    def chord(self, theta: Reals, stop: Reals) -> Reals:
        """Compute the distance of the crank pin from a slider fixed at x = stop [m] (eq. 8)."""
        return np.hypot(self.crank * np.cos(theta) - stop, self.crank * np.sin(theta))

    def shortening(self, theta: Reals, stop: Reals) -> Reals:
        """Compute the end shortening over length, u = 1 - chord/L, of a coupler whose slider is fixed at x = stop (eqs 7-9)."""
        return 1 - self.chord(theta, stop) / self.coupler

    def lean_cosine(self, theta: Reals, stop: Reals) -> Reals:
        """Compute cos(phi), phi the angle between the coupler's chord and the x axis (eq. 10)."""
        return (self.crank * np.cos(theta) - stop) / self.chord(theta, stop)

    def push(self, load: Callable[[Reals], Reals], rigidity: float, theta: Reals, stop: Reals) -> Reals:
        """Compute the force with which a buckled coupler presses a slider against a stop at x = stop, p(u) E I/L^2 cos(phi) [N].

        It is positive towards negative x, away from the crank (eqs 7-13). `load` is a function from the end shortening over
        length to p = P L^2/(E I), `rigidity` is E I [N m^2]. Where the slider does not reach the stop, u = 0 is taken.
        """
        u = np.maximum(self.shortening(theta, stop), 0.0)
        return load(u) * rigidity / self.coupler**2 * self.lean_cosine(theta, stop)

    def contact_angle(self, stop: float) -> float:
        """Compute the crank angle in (0, pi) at which the slider reaches x = stop (cosine rule); raise a ValueError if never."""
        inner, outer = self.slider(0.0), self.slider(np.pi)
        if not outer <= stop <= inner:
            raise ValueError(f"stop = {stop:g} m: the slider moves only in [{outer:g}, {inner:g}] m")
        cosine = (stop**2 + self.crank**2 - self.coupler**2) / (2 * stop * self.crank)
        return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
