"""Compile all that runs of both integrators need, so that no run waits for it: `buckler --compile`."""

from __future__ import annotations

import numpy as np

from ..elements import Beam, Clearance, Rigid, Section
from ..laws import Coulomb, Impact
from ..library import crank_rocker, slider_crank
from ..mechanism import Mechanism
from ..process import COMPILING, compiler
from ..solvers import Spectral

SHORT = 1e-3
"""Of the runs that are made for it, s: what they compute does not matter."""


def compile_all() -> float:
    """Compile what is not on disk yet, and return how many seconds that took.

    Raises
    ------
    ModuleNotFoundError
        If there is no compiler.
    """
    if not compiler():
        raise ModuleNotFoundError("Numba is not installed, or is switched off by NUMBA_DISABLE_JIT: pip install 'buckler[fast]'")
    from .announce import ANNOUNCER  # needs the compiler

    begun = COMPILING.seconds
    _implicit()
    _explicit()
    ANNOUNCER.close()
    return COMPILING.seconds - begun


def _strip() -> Mechanism:
    return slider_crank(Beam(Section(0.030, 2e-3)), law=None, mass=0.3, speed=1.25)


def _rattling() -> Mechanism:
    def play(point: str, first: str, second: str) -> Clearance:
        return Clearance(point, first, second, 5e-3, 2.5e-4, Impact(1e8, 1e4, 1e-5), Coulomb(0.1, 0.1))

    return crank_rocker(Rigid(Section(0.005, 0.020)), speed=30.0, play=play)


def _implicit() -> None:
    from .run import once  # compiles, as all that follows

    once(_strip(), SHORT, Spectral())


def _explicit() -> None:
    from .dense import at_times, ledger
    from .run import integrate
    from .scene import CompiledScene

    scene = CompiledScene.of(_rattling())
    out, _, _ = integrate(scene, SHORT, Spectral())
    at_times(scene, out, np.array([0.0]))
    ledger(scene, out, [])
    scene.measured(0, scene.q0)
    scene.mass_at(scene.q0)
