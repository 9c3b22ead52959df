"""Compile all that runs of both integrators need, so that no run waits for it: `buckler --compile`."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from ..elements import Beam, Clearance, Rigid, Section
from ..laws import Coulomb, Impact
from ..library import crank_rocker, slider_crank
from ..mechanism import Mechanism
from ..process import COMPILING, compiler
from ..solvers import Spectral

SHORT = 1e-3
"""Duration of the runs that compile [s]: their results do not matter."""


def compile_all() -> float:
    """Compile what is not on disk yet, in two processes, and return how many seconds they spent on it.

    Raises
    ------
    ModuleNotFoundError
        If there is no compiler.
    """
    if not compiler():
        raise ModuleNotFoundError("Numba is not installed, or is switched off by NUMBA_DISABLE_JIT: pip install 'buckler[fast]'")
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        return sum(pool.map(_time_compiling, (_compile_implicit, _compile_explicit)))


def _time_compiling(part: Callable[[], None]) -> float:
    """Seconds that this process spends on the compilation of a part."""
    from .announce import ANNOUNCER  # needs the compiler

    part()
    ANNOUNCER.close()
    return COMPILING.seconds


def _strip() -> Mechanism:
    return slider_crank(Beam(Section(0.030, 2e-3)), law=None, mass=0.3, speed=1.25)


def _rattling() -> Mechanism:
    def play(point: str, first: str, second: str) -> Clearance:
        """Return a joint with a gap of 0.25 mm, by typical numbers."""
        return Clearance(point, first, second, 5e-3, 2.5e-4, Impact(1e8, 1e4, 1e-5), Coulomb(0.1, 0.1))

    return crank_rocker(Rigid(Section(0.005, 0.020)), speed=30.0, play=play)


def _compile_implicit() -> None:
    """Compile the implicit integrator by the types of its arguments, and contacts for the engine.

    A run would compile first what the other part does.
    """
    import numba

    from ..laws.contact import compile_kernel
    from .fronts import Orders
    from .implicit import run_implicit
    from .integrators import Radau, radau_state
    from .output import CLOCK, CONTROLS, COUNTS, blank, output_for
    from .scene import CompiledScene

    scene = CompiledScene.of(_strip())
    memory, multipliers = scene.memory(), np.zeros(len(scene.tables.rows))
    room = radau_state(scene, scene.q0, scene.q0, scene.q0, multipliers, memory)
    orders, out = Orders(scene.fronts, scene.heavy_fronts), output_for(1, scene.size, len(multipliers), memory.shape)
    given = Radau(scene.tables, orders, scene.work, room), blank(CLOCK), blank(CONTROLS), np.zeros(1), out, blank(COUNTS)
    run_implicit.compile(tuple(map(numba.typeof, given)))  # type: ignore[attr-defined]
    compile_kernel(Impact(1e8, 1e4, 1e-5), Coulomb(0.1, 0.1))


def _compile_explicit() -> None:
    """Compile the explicit integrator and all that is called between runs."""
    from .dense import at_times
    from .recording import record_of
    from .run import integrate
    from .scene import CompiledScene

    scene = CompiledScene.of(_rattling())
    out, _, _ = integrate(scene, SHORT, Spectral(method="explicit"))
    at_times(scene, out, np.array([0.0]))
    record_of(scene, out)
    scene.measure(0, scene.q0)
    scene.mass_at(scene.q0)
