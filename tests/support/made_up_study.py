"""A study that exists only for tests, and how what it wrote is read."""

import json
import math
from dataclasses import dataclass

import numpy as np

from buckler.studies.kit.parameters import StudyParameters, choice, choices, integer, quantities, quantity
from buckler.studies.kit.report import QUIET, Metric, StudyResult
from buckler.studies.kit.style import subplots


@dataclass(frozen=True)
class Parameters(StudyParameters):
    thickness: float = quantity(3e-4, "m", 1e-5, 1e-2, "thickness of the strip", "strip")
    speed: float = quantity(1.25, "rad/s", -100, 100, "speed of the crank", "drive")
    restitution: float = quantity(0.8, "1", 0, 1, "restitution, 80 % by default")
    widths: tuple[float, ...] = quantities((0.03,), "m", 1e-3, 1, "widths to run", "strip")
    elements: int = integer(8, 1, 64, "beam elements")
    ending: str = choice("fine", ("fine", "suspect", "raises", "interrupts", "undrawable", "prints"), "how it ends")
    models: tuple[str, ...] = choices(("strut",), ("stitched", "strut", "beam"), "models to run")

    def agree(self):
        if self.elements == 13 and self.thickness > 1e-3:
            raise ValueError("elements = 13: not with a thickness above 0.001 m")


def run(parameters, progress=QUIET):
    for _ in progress(range(3), label="cases"):
        pass
    if parameters.ending == "raises":
        raise ZeroDivisionError("no stiffness left")
    if parameters.ending == "interrupts":
        raise KeyboardInterrupt
    if parameters.ending == "prints":
        print("engine chatter")
    suspect = {"status": "SUSPECT", "message": "energy grew by 3 %"} if parameters.ending == "suspect" else {}
    metrics = {
        "force": Metric(np.float64(1.7), "N", published=1.7684, exact=1.72465),
        "lost": Metric(math.nan, "J"),
    }
    signals = {"time": np.linspace(0, 1, 5), "force": np.arange(5.0)}
    return StudyResult(
        parameters=parameters,
        metrics=metrics,
        signals=signals,
        work={"steps": np.int64(5), "peak": math.inf},
        **suspect,
    )


def figure(result):
    if result.parameters.ending == "undrawable":
        raise RuntimeError("no ink")
    fig, ax = subplots(height=60)
    ax.plot(result.signals["time"], result.signals["force"], label="force")
    ax.set(xlabel="time [s]", ylabel="force [N]")
    return {"history": fig}


def metrics_of(folder):
    """Content of metrics.json, refusing the NaN and Infinity that only Python's reader takes."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    return json.loads((folder / "metrics.json").read_text(), parse_constant=refuse)
