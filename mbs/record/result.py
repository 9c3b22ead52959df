"""Result of a run: named arrays with units, status, computational work, provenance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..elements.signal import Trait
from ..geometry import Array
from ..imports import import_late
from ..validate import positive
from .errors import Errors, Status
from .lookup import OUTSIDE, between, unknown

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .run import Shape


@dataclass(frozen=True, repr=False)
class Result:
    """Outcome of `simulate`; it can be pickled.

    Attributes
    ----------
    status : Status
    message : str
        Reason, if the status is not OK; for a chaotic motion also the time up to which it agrees with a finer run.
    time : array (samples,), times of the accepted steps [s], not equidistant: `mean` weights by time, `at` interpolates
    signals : dict of str to array (samples,), values by name, e.g. `B.x`, `B.contact_force`, `drive.torque`
    units : dict of str to str, unit of each signal
    work : dict, computational work: wall_s, steps, newton_iterations, jacobians, rejected
    energy : dict of str to array (samples,)
        Energies, J, if `ledger=True`, see `record.run.ledger`: `kinetic`, ..., `error` of the balance, `throughput`.
    shapes : dict of str to Shape, shapes of flexible links at the times `shapes` of `simulate`
    provenance : dict, versions, numbers of elements, settings, solver and notes
    asked : float, the requested accuracy; nan without one
    error : Errors
        Relative error estimates, unknown after a single run: `error.motion` is the largest of all places over their ranges,
        `error["B.contact_force"]` that of a signal.
    film : Film, optional, motion from which `movie` is made
    verified : float
        Largest difference of places from those of the other solver, over their ranges. It is nan without `verify=True`, or if
        one of the two solvers gave no finite result.
    traits : dict of str to Trait, of each signal: kind, whether it is smooth, scale of the error, name of the time derivative

    Examples
    --------
    >>> arm = Link("arm", "O", "A", Rigid(Section(width=0.03, thickness=5e-3)))
    >>> parts = {"joints": [Revolute("O", "ground", "arm")], "drives": [Drive("arm", speed=2.0)]}
    >>> drawn = Mechanism({"O": (0, 0), "A": (0.2, 0)}, [arm], **parts)
    >>> result = simulate(drawn, duration=1.0, solver=Closure())
    >>> result.status.name, round(float(result.signals["A.x"][-1]), 6)  # 0.2 cos(2)
    ('OK', -0.083229)
    """

    status: Status
    message: str
    time: Array
    signals: dict[str, Array]
    units: dict[str, str]
    work: dict[str, float]
    energy: dict[str, Array] = field(default_factory=dict)
    shapes: dict[str, Shape] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)
    asked: float = nan
    error: Errors = field(default_factory=Errors)
    film: Any = field(default=None, compare=False, repr=False)
    verified: float = nan
    traits: dict[str, Trait] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """True if the run finished and passed its checks."""
        return self.status is Status.OK

    def __getitem__(self, name: str) -> Array:
        """Return a signal at the accepted steps, (samples,); UnknownSignalError, with similar names, if there is none."""
        if name not in self.signals:
            raise unknown(name, list(self.signals))
        return self.signals[name]

    def __repr__(self) -> str:
        """Return status, message, time span, error and contents, in a few lines."""
        text = self.message if len(self.message) <= 120 else f"{self.message[:117]}..."
        asked = f" of {self.asked:.2g} asked" if self.asked > 0 else ""
        error = f", error {self.error.motion:.2g}{asked}" if self.asked > 0 or self.error.known else ", error not known"
        error += f", {self.verified:.2g} from the other solver" if self.verified >= 0 else ""
        what = f"{len(self.signals)} signals" + (", energy ledger" if self.energy else "") + (", shapes" if self.shapes else "")
        end = f"{self.time[-1]:g} s" if len(self.time) else "no time"
        return f"<Result {self.status}{f': {text}' if text else ''}; {len(self.time)} samples to t = {end}{error}; {what}>"

    def at(self, name: str, times: ArrayLike, outside: float | None = None) -> Array:
        """Interpolate a signal at other times [s], by cubics between the samples; linearly if the signal has no trait.

        `outside` is the value at times outside the run, e.g. after a failure; without it such times raise a ValueError.
        """
        values, times = self[name], np.asarray(times, dtype=float)
        first, last = self.time[[0, -1]]
        margin, inside = OUTSIDE * (last - first), np.clip(times, first, last)  # margin for rounding, 1e-9 of the duration
        is_outside = ~((times >= first - margin) & (times <= last + margin))  # true for nan as well
        if is_outside.any() and outside is not None:
            return np.where(is_outside, outside, self.at(name, inside))
        if is_outside.any():
            raise ValueError(
                f"'{name}' at t = {times[is_outside][0]:g} s: the run covers [{first:g}, {last:g}] s ({self.status})"
            )
        trait = self.traits.get(name)
        if trait is None:
            return np.asarray(np.interp(inside, self.time, values))
        rates = self.signals.get(trait.rate)  # None without a signal of the rate: from differences of the values
        return between(self.time, values, rates, inside, trait.smooth)

    def mean(self, name: str) -> float:
        """Return the time-weighted mean of a signal."""
        return float(np.trapezoid(self.signals[name], self.time) / (self.time[-1] - self.time[0]))

    def reading(self, text: str) -> Any:
        """Compute a formula such as "rms(B.normal_force)" and its error: a `buckler.mbs.sensitivity.reading_errors.Reading`.

        The error is a bound from the difference of two runs. Of a chaotic motion it is half of the 95 % confidence interval, from
        means over parts of the run. Raise a ValueError for an invalid formula.
        """
        return import_late("sensitivity.reading_errors:read")(self, text)

    @property
    def energy_balance(self) -> float:
        """Largest error of the energy balance over the run, relative to the throughput; nan without a ledger."""
        if not self.energy:
            return nan
        return float(np.abs(self.energy["error"]).max() / max(self.energy["throughput"][-1], np.finfo(float).tiny))

    def suspect(self, reason: str) -> Result:
        """Return the result with the status SUSPECT and one more reason; a failed result unchanged."""
        if not self.status.finished:
            return self
        return replace(self, status=Status.SUSPECT, message="; ".join(filter(None, (self.message, reason))))

    @property
    def movie(self) -> Any:
        """Motion at evenly spaced times, for drawing: a `buckler.mbs.view.movie.Movie`; ValueError if no run made the result."""
        if self.film is None:
            raise ValueError("this result holds no motion: it was made by hand")
        return self.film.movie()

    def plot(self, *names: str, axes: Axes | Sequence[Axes] | None = None) -> Any:
        """Draw signals over time in matplotlib's `axes`, one for each unit, of a new figure by default; return the axes."""
        return import_late("view.plot:plot_signals")(self, names, axes)

    def plot_energy(self, axes: Axes | None = None) -> Any:
        """Draw the energies over time, J; the run needs `ledger=True`."""
        return import_late("view.plot:plot_energy")(self, axes)

    def animate(self, path: str | Path, seconds: float = 6.0, width: float = 640.0) -> Path:
        """Write the motion as an animated picture, a `.gif`, of a duration in seconds and a width [pixels]."""
        seconds, width = positive("seconds", seconds, "s"), positive("width", width, "pixels")
        return import_late("view.plot:animate")(self.movie, path, seconds, width)

    def write_html(self, path: str | Path, title: str = "") -> Path:
        """Write a report as one page that needs no network: the motion, signals, energies, checks, settings."""
        return import_late("view.report:write_html")(self, path, title)

    def _repr_html_(self) -> str:
        """Return the report, in a frame, for notebooks."""
        return import_late("view.report:notebook_frame")(self)

    def write_paraview(self, path: str | Path, times: ArrayLike | None = None) -> Path:
        """Write the links for ParaView: a mesh and its displacements over time, in XDMF.

        Point data are `displacement` [m] since the first time, `curvature` [1/m], `axial_force` [N] and `stress` [Pa] of strips,
        and the number of the `link`. The name of the file ends in `.xdmf`. `times` [s] are by default those of the movie. A
        pickled result has the motion at the times of the movie only: others raise a ValueError.
        """
        return import_late("view.paraview:write_paraview")(self, path, times)

    def to_dataframe(self) -> Any:
        """Return signals as a data frame over t [s], `attrs` with units, status, message; raise an ImportError without pandas."""
        try:
            import pandas
        except ModuleNotFoundError as error:
            raise ImportError("to_dataframe needs pandas: pip install 'buckler[tables]'") from error
        frame = pandas.DataFrame(dict(self.signals), index=pandas.Index(self.time, name="t"))
        frame.attrs.update(units=dict(self.units), status=str(self.status), message=self.message)
        return frame
