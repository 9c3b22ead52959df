"""A study for the tests of sweeps: quick, noisy by seed, and able to end in every way. Workers import it by name."""

import os
import signal
import sys
import time
from dataclasses import dataclass

import numpy as np

from buckler.studies.kit import registry
from buckler.studies.kit.cli import main
from buckler.studies.kit.parameters import StudyParameters, choice, choices, integer, quantity
from buckler.studies.kit.report import QUIET, Metric, StudyResult
from buckler.studies.kit.style import subplots

ENDINGS = ("fine", "suspect", "fails", "raises", "dies", "interrupts")


@dataclass(frozen=True)
class Parameters(StudyParameters):
    length: float = quantity(0.3, "m", 0, 10, "length")
    speed: float = quantity(1, "rad/s", -100, 100, "speed")
    order: int = integer(1, 0, 100, "a whole number")
    models: tuple[str, ...] = choices(("strut",), ("strut", "beam", "cable"), "models to run")
    ending: str = choice("fine", ENDINGS, "how it ends")
    noise: float = quantity(0, "N", 0, 10, "standard deviation of the force")
    pause: float = quantity(0, "s", 0, 100, "how long it takes")
    seed: int = integer(0, 0, 10**9, "of the noise")

    def agree(self):
        if self.order == 13 and self.speed > 5:
            raise ValueError("order = 13: not with a speed above 5 rad/s")


def run(parameters, progress=QUIET):
    p = parameters
    time.sleep(p.pause)
    if p.ending == "raises":
        raise ZeroDivisionError("no stiffness left")
    if p.ending == "interrupts":
        raise KeyboardInterrupt
    if p.ending == "dies":
        os.kill(os.getpid(), signal.SIGKILL)
    noise = p.noise * np.random.default_rng(p.seed).standard_normal()
    metrics = {}
    for model in p.models:
        metrics[f"{model}.force"] = Metric(10 * p.length + p.speed**2 + noise, "N", exact=10 * p.length + p.speed**2)
        metrics[f"{model}.time"] = Metric(np.nan if p.length > 5 else 1 / (1 + p.length), "s")
    checks = {"status": "SUSPECT", "message": "energy grew by 3 %"} if p.ending == "suspect" else {}
    checks = {"status": "TIMED_OUT", "message": "after 1 s"} if p.ending == "fails" else checks
    signals = {"time": np.linspace(0, 1, 5), "force": p.length * np.arange(5.0)}
    return StudyResult(parameters=p, metrics=metrics, signals=signals, work={"steps": np.int64(7)}, **checks)


def toys(n, **shared):
    """Cases that differ in their lengths."""
    return [Parameters(length=i / 8, **shared) for i in range(n)]


def figure(result):
    return subplots()[0]


def register():
    registry.STUDIES["toy"] = registry.StudyEntry("sweep_toy", "a study for tests")


if __name__ == "__main__":  # python sweep_toy.py sweep toy --vary ...
    register()
    sys.exit(main(argv=sys.argv[1:]))
