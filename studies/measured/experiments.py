"""Measured mechanisms: what was given, what is fitted, what is then predicted, and how far off.

The single and the triple pendulum of Kaheman et al., released and left to swing, their cart fixed. Parameters and the start of
each segment are fitted to the authors' fitting segments; each validation segment is then predicted from its first sample
alone. The data are not part of Buckler: `data` names the folder of `single.csv` and `triple.csv`, columns segment, use, t_s,
angles in rad with 0 upwards, speeds in rad/s.

References
----------
K. Kaheman et al., The Experimental Multi-Arm Pendulum on a Cart: A Benchmark System for Chaos, Learning, and Control,
arXiv 2205.06231, doi 10.48550/arXiv.2205.06231.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import simulate
from buckler.mbs.geometry import Array

from ..kit.parameters import StudyParameters, choices, integer, quantity, text
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Figure, subplots
from .chain import Chain, Data, Fit, apart, fitted, predicted


class Measured(NamedTuple):
    """An experiment.

    Attributes
    ----------
    published : with the authors' estimates
    models : name of a model and the parameters that are fitted in it; the first one is the study's own
    blocks : pieces of a segment that are taken to err apart: of a second or so
    given : what is taken from the source
    """

    published: Chain
    models: dict[str, tuple[str, ...]]
    blocks: int
    given: str


TRIPLE = ("a2", "a3", "I1", "I2", "I3", "k1", "k2", "k3")
EXPERIMENTS = {
    "single": Measured(
        Chain((0.14758,), (0.0,), {"a": (0.14775,), "I": (1.0912e-4,), "k": (2.2394e-4,)}),
        {
            "": ("I1", "c1", "q1", "tilt"),
            "viscous": ("I1", "k1", "tilt"),
            "dry": ("I1", "k1", "c1", "tilt"),
            "drag": ("I1", "k1", "q1", "tilt"),
        },
        9,
        "mass, centre of mass",
    ),
    "triple": Measured(
        Chain(
            (0.25817, 0.27943, 0.11862),
            (0.17280, 0.22870, 0.0),
            {
                "a": (0.16000, 0.20294, 0.18371),
                "I": (1.0004e-4, 3.1416e-4, 1.6874e-4),
                "k": (1.4771e-3, 2.5958e-4, 1e-5),
            },
        ),
        # Any factor of all inertias, weights and frictions cancels: the first centre of mass stays as published.
        {"": (*TRIPLE, "c1", "c2", "c3", "tilt"), "viscous": (*TRIPLE, "tilt")},
        1,
        "masses, lengths, centre of mass of the first arm",
    ),
}
UNITS = {"a": "m", "I": "kg.m^2", "k": "N.m.s/rad", "c": "N.m", "q": "N.m.s^2", "t": "rad"}


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    data: str = text("", "folder of the measurements", "data")
    experiment: tuple[str, ...] = choices(tuple(EXPERIMENTS), tuple(EXPERIMENTS), "which", "data")
    alternatives: int = integer(1, 0, 1, "also fit the models that turn out to be too simple", "data")
    times: int = integer(10_000, 20, 10_000, "samples of each segment, at most", "data")
    accuracy: float = quantity(1e-4, "1", 1e-6, 1e-1, "of the runs of the mechanism", "numerics")

    def check(self) -> None:
        """The files are there, where a folder is named."""
        for name in self.experiment if self.data else ():
            if not (Path(self.data) / f"{name}.csv").is_file():
                raise ValueError(f"data = {self.data}: there is no {name}.csv")


def read(path: Path, times: int) -> tuple[Data, Data]:
    """Segments to fit and to validate, cut to the shortest.

    Raises
    ------
    ValueError
        If the file has other columns.
    """
    header, *lines = path.read_text(encoding="utf-8").split()
    if not header.startswith("segment,use,t_s,angle1_rad"):
        raise ValueError(f"data: {path}: columns must be segment, use, t_s, angles, speeds")
    rows = [line.split(",") for line in lines]
    found: dict[str, list[Array]] = {"fit": [], "validate": []}
    for segment in dict.fromkeys(row[0] for row in rows):
        mine = [row for row in rows if row[0] == segment]
        found[mine[0][1]].append(np.array([row[2:] for row in mine], float))
    shortest = min(times, *(len(each) for some in found.values() for each in some))
    arms = (len(rows[0]) - 3) // 2
    step = float(found["fit"][0][1, 0] - found["fit"][0][0, 0])
    both = (np.array([each[:shortest] for each in some]) for some in found.values())
    fit, validate = (Data(each[..., 1 : 1 + arms], each[..., 1 + arms :], step) for each in both)
    return fit, validate


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Fit and predict each experiment."""
    if not p.data:
        return StudyResult(
            parameters=p, status="NO_DATA", message="the measurements are not part of Buckler: name their folder by --data"
        )
    metrics: dict[str, Metric] = {}
    signals: dict[str, Array] = {}
    rows: list[list[Any]] = []
    wrong = []
    for name in progress(p.experiment, label="experiments"):
        fit, validate = read(Path(p.data) / f"{name}.csv", p.times)
        case = EXPERIMENTS[name]
        metrics[f"{name}.angle.measured"] = Metric(fit.scatter, "rad")
        metrics[f"{name}.published.predicted"] = Metric(apart(predicted(case.published, validate), validate), "rad")
        for model, free in list(case.models.items())[: None if p.alternatives else 1]:
            found = _fitted(case, fit, free)
            whole = f"{name}.{model}".rstrip(".")
            metrics |= _metrics(whole, case, found, validate)
            rows.append(
                [name, model or "own", ", ".join(free), 1e3 * found.residual, 1e3 * metrics[f"{whole}.angle.predicted"].value]
            )
            if not model:
                ours, off = _simulated(found.chain, validate, p.accuracy)
                metrics[f"{name}.simulated.predicted"] = Metric(apart(ours, validate), "rad", error=off / apart(ours, validate))
                metrics |= _last_peak(name, ours, validate)
                signals |= _signals(name, found, fit, ours, validate)
                if off > 1e-2:
                    wrong.append(f"{name}: two solutions of the same equations differ by {off:.1e} rad")
    return StudyResult(
        parameters=p, **judged(wrong), metrics=metrics, signals=signals,
        tables=[Table(["experiment", "model", "fitted", "fitted, rms [mrad]", "predicted, rms [mrad]"], rows)],
    )  # fmt: skip


def _fitted(case: Measured, data: Data, free: Sequence[str]) -> Fit:
    """The fit, begun with the first half of the segments' time, in which less can go wrong."""
    begin = case.published.without_friction_but(free)
    half = fitted(begin, data.some(slice(None), data.angle.shape[1] // 2), free)
    return fitted(half.chain, data, free, case.blocks, half.starts)


def _metrics(whole: str, case: Measured, found: Fit, validate: Data) -> dict[str, Metric]:
    """Estimates with their standard errors; distances of fitted and predicted angles."""
    metrics = {
        f"{whole}.angle.estimated": Metric(found.residual, "rad"),
        f"{whole}.angle.predicted": Metric(apart(predicted(found.chain, validate), validate), "rad"),
    }
    values = dict(zip(found.chain.names, found.chain.vector, strict=True))
    published = dict(zip(case.published.names, case.published.vector, strict=True))
    for name, error in found.errors.items():
        known = published[name] or None
        relative = error / abs(values[name]) if values[name] else None
        metrics[f"{whole}.{name}.estimated"] = Metric(values[name], UNITS[name[0]], published=known, error=relative)
    if len(case.published.mass) == 1:  # what a single pendulum tells whatever its mass
        for part, chain in (("", found.chain), ("published.", case.published)):
            A, G = chain.constants(chain.vector)
            metrics[f"{whole}.{part}rate.estimated"] = Metric(float(G[0] / A[0, 0]), "1/s^2")
    return metrics


def _simulated(chain: Chain, data: Data, accuracy: float) -> tuple[Array, float]:
    """Validation segments as `simulate` predicts them, and the largest distance from the other solution, rad."""
    time = data.step * np.arange(data.angle.shape[1])
    out = np.empty_like(data.angle)
    for i, (angle, speed) in enumerate(zip(data.angle[:, 0], data.speed[:, 0], strict=True)):
        result = simulate(chain.mechanism(angle, speed), float(time[-1]), accuracy=accuracy)
        for arm in range(data.angle.shape[2]):
            out[i, :, arm] = angle[arm] - result.at(f"arm{arm + 1}.angle", np.minimum(time, result.time[-1]))
    return out, float(np.abs(out - predicted(chain, data)).max())


def _last_peak(name: str, ours: Array, data: Data) -> dict[str, Metric]:
    """Largest deflection of the last arm in the last second of the last segment, measured and predicted."""
    last = slice(-round(1.0 / data.step), None)
    pair = {"measured": data.angle, "predicted": ours}
    found = {kind: float(np.abs(angle[-1, last, -1] - np.pi).max()) for kind, angle in pair.items()}
    return {
        f"{name}.last_peak.measured": Metric(found["measured"], "rad", error=data.scatter / found["measured"]),
        f"{name}.last_peak.predicted": Metric(found["predicted"], "rad"),
    }


def _signals(name: str, found: Fit, fit: Data, ours: Array, validate: Data) -> dict[str, Array]:
    """What the figure draws."""
    chain, starts = found.chain, found.starts
    vectors = np.tile(chain.vector, (len(starts), 1))
    again = np.moveaxis(chain.moved(vectors, starts[:, 0], starts[:, 1], fit.angle.shape[1], fit.step), 0, 1)
    return {
        f"{name}.time": fit.step * np.arange(fit.angle.shape[1]),
        f"{name}.measured": validate.angle,
        f"{name}.predicted": ours,
        f"{name}.fit_left": again - fit.angle,
    }


def figure(result: StudyResult) -> Figure:
    """Measured and predicted angle of a validation segment, and what is left of every segment."""
    names = [name.removesuffix(".time") for name in result.signals if name.endswith(".time")]
    fig, axes = subplots(2, len(names), height=120, squeeze=False)
    for (above, below), name in zip(axes.T, names, strict=True):
        time, measured, ours = (result.signals[f"{name}.{part}"] for part in ("time", "measured", "predicted"))
        for arm in range(measured.shape[2]):
            label = f"arm {arm + 1}" if measured.shape[2] > 1 else "predicted"
            above.plot(time, measured[-1, :, arm] - np.pi, color="black", linewidth=2.2, label=None if arm else "measured")
            above.plot(time, ours[-1, :, arm] - np.pi, "--", color=COLOURS[arm], linewidth=1.2, label=label)
        above.set(ylabel="angle from hanging [rad]", title=f"{name} pendulum, last validation segment")
        above.margins(y=0.35)
        above.legend(loc="upper center", ncols=2)
        left = {"fitted": (result.signals[f"{name}.fit_left"], "#999999"), "predicted": (ours - measured, COLOURS[0])}
        for kind, (distance, colour) in left.items():
            for i, line in enumerate(each for segment in distance for each in segment.T):
                below.plot(time, 1e3 * line, color=colour, linewidth=0.6, label=None if i else kind)
        below.set(xlabel="time [s]", ylabel="less measured [mrad]")
        below.margins(y=0.2)
        below.legend(loc="upper center", ncols=2)
    return fig
