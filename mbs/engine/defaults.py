"""A run with the engine's own default settings: what run times are held against, and nothing else."""

from __future__ import annotations

import exudyn as exu
import numpy as np

from buckler.mbs.elements.signal import Moved
from buckler.mbs.engine import System
from buckler.mbs.engine.build import build
from buckler.mbs.engine.placed import States
from buckler.mbs.geometry import Array
from buckler.mbs.mechanism import Mechanism


def with_default_settings(mechanism: Mechanism, duration: float, steps: int) -> tuple[Array, dict[str, Moved], str]:
    """Run a mechanism with the engine's own default settings, in equal steps: nothing is controlled or checked.

    Parameters
    ----------
    mechanism : Mechanism
    duration : float
        s.
    steps : int
        The one setting that has no default that works.

    Returns
    -------
    time : array, shape (steps,)
    places : dict
        Motions of links and blocks by name; velocities and accelerations are left out as zero.
    message : str
        What the engine said, if it failed.
    """
    scene = build(mechanism)
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = duration, steps
    settings.timeIntegration.verboseMode, settings.solution.file.write = 0, False
    time: list[float] = []
    rows: list[Array] = []

    def keep(_system: System, t: float) -> bool:
        time.append(t)
        rows.append(scene.system.systemData.GetODE2Coordinates())
        return True

    scene.system.SetPostStepUserFunction(keep)
    message = ""
    try:
        if not scene.system.SolveDynamic(settings):
            message = "no convergence"
    except exu.ExudynError as error:
        message = " ".join(str(error).split())[-200:]
    q = np.array(rows).reshape(len(time), -1)
    still = States(q, np.zeros_like(q), np.zeros_like(q))
    return np.array(time), {name: placed.motion(still) for name, placed in scene.placed.items()}, message
