"""Response curves: periodic motions over a frequency, a load or any number of a mechanism, around their folds."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..progress import watch
from ..validate import positive, whole
from .answer import FIRST_STEP, KEYS, MAX_STEP, Route, check_path, explain_end, parameters_at
from .curve import KINDS, ResponseCurve
from .cycles import Periodic, failure_of, prepare
from .problem import SEARCH_STOPS, Problem
from .varied import Paced, problem_over


@dataclass(frozen=True)
class Response(Route):
    """Response curve: periodic `motions` over a parameter; the status is OK if the end was reached, or the start again.

    `parameter` is the frequency of the motion [Hz], the factor of the loads, or the number that changes. `points` are
    folds, branchings and doublings. `errors` are changes of their parameters by finer steps and a higher degree of the strips.
    """

    motions: list[Periodic] = field(default_factory=list)
    ordinate: ClassVar[str] = "amplitude of "

    folds = parameters_at("fold", "Parameters at which the curve turns back.")
    doublings = parameters_at("doubling", "Parameters at which motions of twice the period leave the curve.")
    branchings = parameters_at("branching", "Parameters at which other motions of the same period leave the curve.")

    @property
    def stable(self) -> Array:
        """True for each stable motion, shape (steps,)."""
        return np.array([motion.stable for motion in self.motions])

    def amplitude(self, link: str, point: str) -> Array:
        """Return half the range of a point of a link along x and y [m], shape (steps, 2)."""
        return np.array([motion.amplitude(link, point) for motion in self.motions])

    def ordinates(self, link: str, point: str) -> tuple[Array, list[Array]]:
        """Return amplitudes along x and y to draw, on the curve and at critical points."""
        return self.amplitude(link, point), [critical.motion.amplitude(link, point) for critical in self.points]


@watch("periods integrated")
def response(
    mechanism: Mechanism, period: float, *, to: float, load: str | list[str] | None = None, parameter: str | None = None,
    settle: int = 0, start: Periodic | None = None, steps: int = 400, step: float = FIRST_STEP, longest: float = MAX_STEP,
    degree: int | None = None, timeout: float | None = None, progress: bool | None = None,
) -> Response:  # fmt: skip
    """Follow a periodic motion of a driven mechanism over its frequency, a load or any number, around the folds of the curve.

    Raise a ValueError for an invalid argument, or if nothing in the mechanism depends on time.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism with a drive, load or motion that depends on time.
    period : float
        Period of the drive or load as given, or a multiple [s].
    to : float
        Parameter at which the curve ends. It is the frequency [Hz], which begins at 1/period and scales all functions of time and
        drives; or the factor of the load, which begins at 1; or the value of the number.
    load : str or list of str, optional
        Names of the loads ('force.A', 'gravity') that grow, instead of the frequency.
    parameter : str, optional
        Path of a number, as in files, that changes instead of the frequency.
    settle, start, degree
        Options of `periodic` for the first motion, `settle` in periods. The degree is 8 by default. Without a given degree errors
        come from motions with a higher one as well as finer steps.
    steps : int
        Largest number of steps.
    step, longest : float
        Arc lengths of the first and the longest step: root of the sum of squares of the changes of the parameter over its range,
        and of coordinates and rates over the largest range of a coordinate in a period.
    timeout, progress
        Time limit [s], after which the best so far is the answer; True shows the expected time, by default in terminals.
    """
    check_path(to, steps, step, longest, load=load, parameter=parameter)
    whole("settle", settle, 0, 1_000_000)
    shooting, state = prepare(mechanism, period, start, degree)
    if shooting.autonomous:
        raise ValueError("mechanism: nothing in it depends on time, so that no frequency drives it")
    if load is None and parameter is None:
        positive("to", to, "Hz")
        problem: Problem = Paced(shooting.scene, initial=1.0 / shooting.period)
    else:
        problem = problem_over(mechanism, shooting.scene.degree, load=load, parameter=parameter)
    if float(to) == problem.initial:
        raise ValueError(f"to = {to:g}: the curve begins there")
    curve = ResponseCurve(shooting, problem, float(to), keeps_degree=degree is not None)
    curve.set_parameter(problem.initial)
    try:
        first = shooting.search(shooting.advance(state, settle)).state
        orbits, criticals, ended = curve.follow(first, int(steps), step, longest)
        parameters, q = np.array([orbit.parameter for orbit in orbits]), np.array([orbit.found.state.q for orbit in orbits])
        errors = {KEYS[kind]: np.array([critical.error for critical in criticals if critical.kind == kind]) for kind in KINDS}
        motions = [curve.make_motion(orbit) for orbit in orbits]
        status = explain_end(ended, parameters[-1], curve.start, curve.to, len(orbits) - 1)
        return Response(*status, ended, curve.shooting.scene, parameters, q, criticals, errors, curve.problem.label, motions)
    except SEARCH_STOPS as error:
        no_states = np.empty((0, shooting.scene.size))
        # "singular", as no step was possible; the cause is in the status and message
        return Response(*failure_of(error), "singular", shooting.scene, parameter=np.empty(0), q=no_states, points=[])
    finally:
        curve.set_parameter(problem.initial)  # so that the scene of the result is the mechanism as given
