"""Compile all functions of both integrators before the first run: `buckler --compile`."""

import numpy as np

from ..elements import Beam, Clearance, Rigid, Section
from ..laws import Coulomb, Impact
from ..library import crank_rocker, slider_crank
from ..process import COMPILING, has_compiler
from ..solvers import Spectral


def compile_all() -> float:
    """Compile what is not on disk yet, by short runs of both integrators; return the time spent on it [s]."""
    if not has_compiler():
        raise ModuleNotFoundError("Numba is not installed, or is switched off by NUMBA_DISABLE_JIT: pip install 'buckler[fast]'")
    from ..laws.contact import compile_kernel  # these load the compiler
    from .dense import at_times
    from .recording import record_of
    from .run import integrate
    from .scene import CompiledScene

    law, friction = Impact(1e8, 1e4, 1e-5), Coulomb(0.1, 0.1)  # any: the kernel has the same machine code for all laws

    def play(point: str, first: str, second: str) -> Clearance:
        """Return a joint with a pin of 5 mm and a gap of 0.25 mm, typical sizes."""
        return Clearance(point, first, second, 5e-3, 2.5e-4, law, friction)

    rattling = crank_rocker(Rigid(Section(0.005, 0.020)), speed=30.0, play=play)
    strip = slider_crank(Beam(Section(0.030, 2e-3)), law=None, mass=0.3, speed=1.25)
    before = COMPILING.seconds
    for mechanism, method in ((rattling, "explicit"), (strip, "implicit")):
        scene = CompiledScene.of(mechanism)
        out, _, _ = integrate(scene, 1e-3, Spectral(method=method))  # a short run, whose result is not used
        at_times(scene, out, np.zeros(1))
        record_of(scene, out)
        scene.measure(0, scene.q0)
        scene.mass_at(scene.q0)
    compile_kernel(law, friction)
    return COMPILING.seconds - before
