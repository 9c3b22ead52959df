"""Periodic motions with their Floquet multipliers, and errors of both by refinement of steps and degree."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ..geometry import Array
from ..mechanism import Mechanism
from ..progress import USER_STOPS, watch
from ..spectral.run import RunState
from ..spectral.scene import DEGREE, CompiledScene
from ..spectral.start import start_rates
from ..validate import positive, whole
from .answer import CRITICAL_ACCURACY, DEGREE_STEP, LARGEST_ERROR, MAX_DEGREE, Answer, Ending, check
from .problem import SEARCH_STOPS, distance_between, prolong
from .shooting import Found, Shooting, SpentError, distances_to, find_multipliers


@dataclass(frozen=True)
class Periodic(Answer):
    """Periodic motion with the `period` [s], which is unknown beforehand if nothing depends on time.

    `q`, `v` (times, n) are coordinates and rates at times from 0 to the period [s]. `multipliers` (m,) are Floquet's, the largest
    first; their `errors` (m,) are changes by finer steps, a higher degree of the strips and a narrower difference quotient for
    the monodromy matrix. `trivial` is the index of the multiplier that belongs to a shift in time, None if something depends on
    time. `stable` is True if no other multiplier exceeds 1 in size by more than its error. `error` is the change of the state at
    the start, by the refinement or over a period, whichever is larger: of positions over the longest link, and of angles [rad].
    """

    scene: CompiledScene
    period: float
    time: Array
    q: Array
    v: Array
    multipliers: Array
    errors: Array
    stable: bool
    error: float
    trivial: int | None = None

    def point(self, link: str, point: str) -> Array:
        """Return the positions of a point of a link over the period [m], shape (times, 2)."""
        marker = self.scene.marker(link, point)
        return np.array([self.scene.read(marker, q).position for q in self.q])

    def amplitude(self, link: str, point: str) -> Array:
        """Return half the range of a point of a link along x and y [m], shape (2,)."""
        marker = self.scene.marker(link, point)
        motions = [self.scene.read(marker, q, v) for q, v in zip(self.q, self.v, strict=True)]
        position = CubicHermiteSpline(self.time, [m.position for m in motions], [m.velocity for m in motions])
        rests = position.derivative().roots(extrapolate=False)  # nan where a component is constant
        extrema = (np.append(roots[np.isfinite(roots)], 0.0) for roots in rests)  # 0: a time for a component that never moves
        return np.array([np.ptp(position(times)[:, axis]) / 2 for axis, times in enumerate(extrema)])

    def rows(self) -> list[tuple[str, str]]:
        """Return rows of the table: period, stability, and the multipliers."""
        out = [("period", f"{self.period:.9g} s"), ("stable", "yes" if self.stable else "no"), ("error", f"{self.error:.1e}")]
        for i, (value, error) in enumerate(zip(self.multipliers, self.errors, strict=True)):
            name = "trivial multiplier" if i == self.trivial else "multiplier"
            out.append((name, f"{value:.9g}, size {abs(value):.9g}, error {error:.1e}"))
        return out


@watch("periods integrated")
def periodic(
    mechanism: Mechanism, period: float, *, settle: int = 0, start: Periodic | None = None, degree: int | None = None,
    timeout: float | None = None, progress: bool | None = None,
) -> Periodic:  # fmt: skip
    """Find a periodic motion by shooting, and its stability; raise a ValueError for an invalid argument.

    Parameters
    ----------
    period : float
        Period of the drive or load, or a multiple [s], positive; a first estimate if nothing depends on time.
    settle : int
        Number of periods integrated before the search begins.
    start : Periodic, optional
        Nearby motion from which the search starts; by default it starts from the mechanism at t = 0.
    degree : int, optional
        Degree of the strips; by default it is increased until the error is below 1e-6.
    timeout, progress
        Time limit [s], after which the best so far is the answer; True shows the expected time, by default in terminals.
    """
    whole("settle", settle, 0, 1_000_000)
    shooting, state = prepare(mechanism, period, start, degree)
    try:
        return _refine(shooting, shooting.search(shooting.advance(state, settle)), degree is not None)
    except SEARCH_STOPS as error:
        none, states, values = np.empty(0), np.empty((0, shooting.scene.size)), np.empty(0, complex)
        scene = shooting.scene
        return Periodic(*failure_of(error), scene, period, none, states, states, values, none, stable=False, error=np.inf)


def failure_of(error: BaseException) -> tuple[Ending, str]:
    """Return status and message of a search for a periodic motion that ended with an exception."""
    if isinstance(error, USER_STOPS):
        return Ending.NOT_REACHED, "no periodic motion was found yet"
    return Ending.TOO_MANY_STEPS if isinstance(error, SpentError) else Ending.NOT_REACHED, str(error)


def prepare(mechanism: Mechanism, period: float, start: Periodic | None, degree: int | None) -> tuple[Shooting, RunState]:
    """Check the input; return the map over a period and its first state."""
    check(mechanism, degree)
    period = float(positive("period", period, "s"))
    if start is not None and not (isinstance(start, Periodic) and len(start.q)):
        raise ValueError("start: must be a Periodic that was found")
    scene = CompiledScene.of(mechanism, degree or (start.scene.degree if start else DEGREE))
    state = RunState(0.0, scene.q0, start_rates(scene), scene.memory())
    if start is not None:
        state = state._replace(q=prolong(start.scene, scene, start.q[0]), v=prolong(start.scene, scene, start.v[0]))
    return Shooting(scene, period), state


def _refine(shooting: Shooting, found: Found, keeps_degree: bool) -> Periodic:
    """Refine steps, and the degree unless it `keeps_degree`, until the motion stays the same; errors are its last changes."""
    values, error, previous = find_multipliers(found.monodromy), np.inf, np.inf
    errors = np.full(len(values), np.inf)
    for _ in range(4):  # a chosen limit of refinements, each to half the longest step
        degree = shooting.scene.degree + (DEGREE_STEP if shooting.scene.strips and not keeps_degree else 0)
        finer = shooting.finer(degree)
        q, v = (prolong(shooting.scene, finer.scene, part) for part in (found.state.q, found.state.v))
        start = found.state._replace(q=q, v=v)
        try:
            new = finer.search(start, found.monodromy)  # a matrix for fewer coordinates is not used: `newton` computes one
        except SEARCH_STOPS:
            break
        new_values, changes, change = compare_multipliers(finer, start, new, values)
        largest = changes[np.abs(new_values) > 0.1].max(initial=0.0)  # far smaller ones than 1 do not decide stability
        if largest > previous:  # rounding: keep the motion before
            break
        error, errors, previous = change, changes, largest
        shooting, found, values = finer, new, new_values
        is_highest = degree > MAX_DEGREE  # the motion at the maximum has been compared with this one
        if max(error, largest) <= CRITICAL_ACCURACY or is_highest:
            break
    return motion_of(shooting, found, values, errors, error)


def compare_multipliers(finer: Shooting, start: RunState, new: Found, values: Array) -> tuple[Array, Array, float]:
    """Return multipliers of a refined motion, their errors by changes from `values`, and the error of the state."""
    new_values = find_multipliers(new.monodromy)
    errors = distances_to(new_values, values)
    if finer.autonomous:  # one multiplier is exactly 1: errors of those near 1 are at least their distances from 1
        distance = np.abs(new_values - 1.0)
        is_near = distance < 3.0 * distance.min()  # the trivial one may be any of these; 3: chosen
        errors = np.where(is_near, np.maximum(errors, distance), errors)
    return new_values, errors, max(distance_between(finer.scene, start.q, new.state.q), new.residual)


def describe_change(multiplier: complex) -> str:
    """Describe a small motion after a period: a negative multiplier changes its sign, a complex one turns it in a plane."""
    if abs(multiplier.imag) > 1e-9 * abs(multiplier):  # 1e-9, chosen: above rounding
        return " and turns"
    return " and alternates" if multiplier.real < 0.0 else ""


def motion_of(shooting: Shooting, found: Found, values: Array, errors: Array, error: float) -> Periodic:
    """Make the result: stability, status, message, and the motion over the period; an unstable motion is OK, too."""
    trivial = int(np.argmin(np.abs(values - 1.0))) if shooting.autonomous and len(values) else None
    is_other = np.arange(len(values)) != trivial  # True for all multipliers if `trivial` is None
    grows = (np.abs(values) > 1.0 + np.maximum(errors, CRITICAL_ACCURACY)) & is_other
    message = []
    if grows.any():
        worst = complex(values[grows][0])
        message.append(f"unstable: a small motion grows {abs(worst):.4g} times a period{describe_change(worst)}")
    status = Ending.OK if error < LARGEST_ERROR and not shooting.grazes else Ending.INACCURATE
    if shooting.grazes:
        message.append("its multipliers are not determined: motions beside it touch a contact that it does not, or miss one")
    if error >= LARGEST_ERROR:
        size = f"{error:.1e} of the longest link" if error < np.inf else "not known"  # no refinement has succeeded
        message.append(f"its error is {size}; give a higher degree")
    out = found.out  # rows at the ends of steps, two at the time of an event, of which the first is taken
    is_first = np.diff(out.time, prepend=-np.inf) > 1e-9 * found.period
    ends = out.time[is_first]
    motion = CubicHermiteSpline(ends, out.q[is_first], out.v[is_first])
    time = np.interp(np.arange(4 * (len(ends) - 1) + 1) / 4, np.arange(len(ends)), ends)  # four times a step, to draw it
    return Periodic(
        status, "; ".join(message), shooting.scene, found.period, time, q=motion(time), v=motion(time, 1),
        multipliers=values, errors=errors, stable=not grows.any(), error=error, trivial=trivial,
    )  # fmt: skip
