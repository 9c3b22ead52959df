"""Where a weight hangs between a spring and a magnet."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from buckler.mbs import Link, Mechanism, Rigid, Slider, Spring, equilibrium
from buckler.studies.kit.parameters import StudyParameters, quantity
from buckler.studies.kit.report import QUIET, Metric, StudyResult
from buckler.studies.kit.style import subplots
from buckler_magnets.magnet import Magnet

STIFFNESS, WEIGHT, APART = 400.0, 0.5 * 9.81, 0.1


def hanging(strength):
    """A weight on a vertical guide, a spring above it, a magnet below."""
    return Mechanism(
        {"F": (0, 0.2), "A": (0, 0), "B": (0, 0.05), "G": (0, -APART)},
        [Link("weight", "A", "B", Rigid.of(mass=0.5, inertia=1e-4))],
        [Slider("A", "weight", "ground", along=(0, 1))],
        loads=[Spring("A", "ground:F", STIFFNESS), Magnet("A", "ground:G", strength)],
        gravity=(0, -9.81),
    )


@dataclass(frozen=True)
class Parameters(StudyParameters):
    strength: float = quantity(0.02, "N m^2", 1e-4, 0.04, "of the magnet", "magnet")


def run(parameters, progress=QUIET):
    found = -float(equilibrium(hanging(parameters.strength)).point("weight", "A").position[1])
    exact = brentq(lambda y: STIFFNESS * y - WEIGHT - parameters.strength / (APART - y) ** 2, 0, 0.05)
    return StudyResult(
        parameters=parameters, metrics={"sag": Metric(found, "m", exact=exact)}, signals={"sag": np.array([found])}
    )


def figure(result):
    fig, ax = subplots(height=60)
    ax.bar(["sag"], result.signals["sag"])
    ax.set(ylabel="sag, m", xlabel="weight")
    return fig
