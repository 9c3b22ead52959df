"""Dense output: states of a run between the steps of an integrator.

Coordinates and rates follow from the polynomial of fifth degree with their values, rates and second rates at both ends of a
step. Second rates and multipliers follow from the equations of motion.
"""

import numpy as np

from ..geometry import Array
from ..record.lookup import quintic
from .explicit import fill_accelerations
from .output import Output
from .scene import CompiledScene
from .start import dormand_prince
from .tables import Memory


def refine_times(scene: CompiledScene, out: Output, between: int) -> Output:
    """Return a run with `between` more states at equal distances in each step that is not tiny."""
    long = np.diff(out.time) > 1e-9 * out.time[-1]  # in shorter steps rates are lost in the rounding of coordinates
    fractions = np.arange(1, between + 1) / (between + 1)
    inner = out.time[:-1][long, None] + np.diff(out.time)[long, None] * fractions
    return at_times(scene, out, np.sort(np.concatenate([out.time, inner.ravel()])))


def at_times(scene: CompiledScene, out: Output, times: Array) -> Output:
    """Return the states at `times` (times,) within a run; bristles are linear over a step, other memories those of its start."""
    step = np.clip(np.searchsorted(out.time, times, side="right") - 1, 0, max(0, len(out.time) - 2))
    following = np.minimum(step + 1, len(out.time) - 1)
    h = out.time[following] - out.time[step]
    x = np.divide(times - out.time[step], h, out=np.zeros_like(h), where=h > 0)
    memory = out.memory[step].copy()
    memory[:, :, Memory.BRISTLE] += x[:, None] * (out.memory[following, :, Memory.BRISTLE] - memory[:, :, Memory.BRISTLE])
    q, slopes = quintic([(out.q[i], out.v[i], out.a[i]) for i in (step, following)], h[:, None], x[:, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.where(h[:, None] > 0, slopes / h[:, None], out.v[step])
    n, r = scene.size, len(scene.tables.rows)
    time, q, v = map(np.ascontiguousarray, (times, q, rates))
    found = Output(time, q, v, np.empty((len(times), n)), np.empty((len(times), r)), memory)
    fill_accelerations(dormand_prince(scene, scene.q0, np.zeros(n), np.zeros(r), scene.memory()), found)  # as work space
    return found
