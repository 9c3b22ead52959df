"""Result of a run: plain arrays with names and units, status, work, provenance."""

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
from ..offers import find_offer
from ..validate import positive
from .errors import Errors, Status
from .lookup import OUTSIDE, between, unknown

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .run import Shape


@dataclass(frozen=True, repr=False)
class Result:
    """Outcome of `simulate`; no engine handles, so that `pickle` keeps it in a file.

    Attributes
    ----------
    status : Status
    message : str
        Why, where the status is not OK; of a chaotic motion also up to when it is one trajectory.
    time : array, shape (samples,)
        The accepted steps, s. They are not equidistant: weight by time, or use `at`.
    signals : dict of str to array, shape (samples,)
        By name, e.g. `B.x`, `B.contact_force`, `drive.torque`.
    units : dict of str to str
        Of each signal.
    work : dict
        wall_s, steps, newton_iterations, jacobians, rejected.
    energy : dict of str to array, shape (samples,)
        The ledger, J, where it was asked for.
    shapes : dict of str to Shape
        Flexible links at the times asked for.
    provenance : dict
        Versions and what was built.
    asked : float
        The accuracy asked for; nan where none was.
    error : Errors
        What is thought to be wrong: `error.motion` of all of it, `error["B.contact_force"]` of a signal; not known of a solver's
        single run.
    film : Film, optional
        The motion, for pictures; `movie` makes it.
    verified : float
        Largest relative difference of places from the other solver; nan where it was not asked for or could
        not be had: then `provenance["notes"]` tells why.
    traits : dict of str to Trait
        What each signal is.

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
        """Signal of that name at the accepted steps, (samples,); UnknownSignalError, naming those near it, if there is none."""
        if name not in self.signals:
            raise unknown(name, list(self.signals))
        return self.signals[name]

    def __repr__(self) -> str:
        """Return status, message, span and what there is, in a few lines at most."""
        said = self.message if len(self.message) <= 120 else f"{self.message[:117]}..."
        asked = f" of {self.asked:.2g} asked" if self.asked > 0 else ""
        error = f", error {self.error.motion:.2g}{asked}" if self.asked > 0 or self.error.known else ", error not known"
        error += f", {self.verified:.2g} from the other solver" if self.verified >= 0 else ""
        what = f"{len(self.signals)} signals" + (", energy ledger" if self.energy else "") + (", shapes" if self.shapes else "")
        end = f"{self.time[-1]:g} s" if len(self.time) else "no time"
        return f"<Result {self.status}{f': {said}' if said else ''}; {len(self.time)} samples to t = {end}{error}; {what}>"

    def at(self, name: str, times: ArrayLike, outside: float | None = None) -> Array:
        """Signal `name` at other times, by cubics between the samples; a signal without a trait is linear between them.

        Parameters
        ----------
        name : str
        times : array_like
            s, within the run.
        outside : float, optional
            What stands for times outside the run, as a run that failed has them; by default they are an error.

        Raises
        ------
        UnknownSignalError
            If there is no such signal.
        ValueError
            If a time lies outside the run.
        """
        values, at = self[name], np.asarray(times, dtype=float)
        off = OUTSIDE * (self.time[-1] - self.time[0])
        wrong = ~((at >= self.time[0] - off) & (at <= self.time[-1] + off))
        if wrong.any() and outside is not None:
            return np.where(wrong, outside, self.at(name, np.clip(at, self.time[0], self.time[-1])))
        if wrong.any():
            first, last = self.time[[0, -1]]
            raise ValueError(f"'{name}' at t = {at[wrong][0]:g} s: the run covers [{first:g}, {last:g}] s ({self.status})")
        trait = self.traits.get(name)
        at = np.clip(at, self.time[0], self.time[-1])
        if trait is None:
            return np.asarray(np.interp(at, self.time, values))
        return between(self.time, values, self.signals.get(trait.rate), at, trait.smooth)

    def mean(self, name: str) -> float:
        """Time-weighted mean of a signal."""
        return float(np.trapezoid(self.signals[name], self.time) / (self.time[-1] - self.time[0]))

    def reading(self, text: str) -> Any:
        """Read a formula such as "rms(B.normal_force)" with its error: a `buckler.mbs.sensitivity.measures.Reading`.

        The error is a bound by the difference of two runs. Of a chaotic motion it is the half-width of a 95 % interval by
        sampling, over batches of the run, and `kind` says which.
        """
        return find_offer("read")(self, text)

    @property
    def energy_balance(self) -> float:
        """Largest ledger error over the run, relative to the energy put through it; nan without a ledger."""
        if not self.energy:
            return float("nan")
        return float(np.abs(self.energy["error"]).max() / max(self.energy["throughput"][-1], np.finfo(float).tiny))

    def suspect(self, reason: str) -> Result:
        """Return the result marked as suspect; a failure stays what it is."""
        if not self.status.finished:
            return self
        return replace(self, status=Status.SUSPECT, message="; ".join(filter(None, (self.message, reason))))

    # --- to look at ---------------------------------------------------------------------------------------------------

    @property
    def movie(self) -> Any:
        """Frames, bent lines and marks over evenly spaced times: a `buckler.mbs.view.movie.Movie`.

        Raises
        ------
        ValueError
            If the result was not made by a run.
        """
        if self.film is None:
            raise ValueError("this result holds no motion: it was made by hand")
        return self.film.movie()

    def plot(self, *names: str, axes: Axes | Sequence[Axes] | None = None) -> Any:
        """Draw signals over time, one row for each unit.

        Parameters
        ----------
        *names : str
            Of `signals`, one at least.
        axes : matplotlib Axes or sequence of Axes, optional
            Where to draw, one for each unit; a new figure by default.

        Returns
        -------
        matplotlib Axes, or array of Axes where there are several units

        Raises
        ------
        ValueError
            If a name is unknown; it names those near it.
        """
        return find_offer("plot_signals")(self, names, axes)

    def plot_energy(self, axes: Axes | None = None) -> Any:
        """Draw the energy ledger over time, J; the run needs `ledger=True`."""
        return find_offer("plot_energy")(self, axes)

    def animate(self, path: str | Path, seconds: float = 6.0, width: float = 640.0) -> Path:
        """Write the motion as a moving picture.

        Parameters
        ----------
        path : str or Path
            Ends in `.gif`.
        seconds : float
            How long the picture runs, s, positive.
        width : float
            Of the picture, pixels.

        Raises
        ------
        ValueError
            If the path ends otherwise.
        """
        return find_offer("animate")(self.movie, path, positive("seconds", seconds, "s"), positive("width", width, "pixels"))

    def write_html(self, path: str | Path, title: str = "") -> Path:
        """Write a report as one page that needs no network: the motion, signals, energies, checks, settings.

        Parameters
        ----------
        path : str or Path
        title : str
            Heading; by default the file's name, or its folder's where the file is `report.html`.
        """
        return find_offer("write_html")(self, path, title)

    def _repr_html_(self) -> str:
        """Return the report, in a frame, for notebooks."""
        return find_offer("notebook_frame")(self)

    # --- for other programs -------------------------------------------------------------------------------------------

    def write_paraview(self, path: str | Path, times: ArrayLike | None = None) -> Path:
        """Write the links for ParaView: a mesh and its displacements over time, in XDMF.

        Point data are `displacement` [m], `curvature` [1/m], `axial_force` [N] and `stress` [Pa] of strips, and the number of
        the `link`.

        Parameters
        ----------
        path : str or Path
            Ends in `.xdmf`.
        times : array of float, optional
            Within the run [s]; by default the evenly spaced ones of the movie. The mesh is that of the first one.

        Raises
        ------
        ValueError
            If the path ends otherwise, or if times are asked of a result that was pickled.
        """
        return find_offer("write_paraview")(self, path, times)

    def to_dataframe(self) -> Any:
        """Return signals as a pandas data frame over the time t [s]; its `attrs` hold units, status and message.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        try:
            import pandas
        except ModuleNotFoundError as error:
            raise ImportError("to_dataframe needs pandas: pip install 'buckler[tables]'") from error
        frame = pandas.DataFrame(dict(self.signals), index=pandas.Index(self.time, name="t"))
        frame.attrs.update(units=dict(self.units), status=str(self.status), message=self.message)
        return frame
