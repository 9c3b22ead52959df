"""Linkages whose constraints alone determine the motion: loop closure over time, forces by inverse dynamics, no integration.

Coordinates q (times, links, 3) close the loops, and rates solve the equations of `scene.linkage`. The rows exert the forces
J^T mu, and their multipliers mu solve M q_tt = f + J^T mu, M the mass and f applied forces. The only error is rounding. Steps
in time, predicted by q, q_t and q_tt, serve to stay on the branch of the start. Their ends are called anchors; other times start
from poses interpolated between them.
"""

from collections.abc import Callable
from time import perf_counter

import numpy as np

from ..elements.element import GROUND, place
from ..elements.link import Link
from ..geometry import Array, cross, rotate_left
from ..mechanism import Mechanism
from ..process import Progress
from ..record.errors import Failure, Status
from ..record.lookup import corrected_trapezoidal, quintic
from ..record.record import BlockMotion, Record, RigidMotion
from ..scene.linkage import carried_masses, invert
from ..scene.scene import Scene
from .closing import Course, choose_independent_rows, close_loops, explain_singularity, passes_singularity

LARGEST_ERROR = 0.05
"""Largest error of the prediction of a step, over the longest link: chosen; a step with a larger error is halved."""
STEEPEST = 0.7
"""Largest change of ln D in a step, D the determinant of the Jacobian: chosen; D at most halves or doubles.

D is in the denominator of rates and forces. So the distance to its zeros, also to those at complex times, bounds the steps: they
pass over neither a dead centre nor the peak of a force near one. At ten times it they would pass over both."""


class UnclosedError(Exception):
    """Loops do not close at a time between two anchors: the linkage is close to a singular pose."""

    def __init__(self, time: float) -> None:
        super().__init__(f"loops do not close at t = {time:.6g} s, though they do before and after")
        self.time = time


class Follower:
    """Loop closure of a linkage from its start, step by step; a `failure` says why the motion ends at the last anchor."""

    def __init__(
        self, mechanism: Mechanism, duration: float,
        deadline: float | None = None, progress: Progress | None = None, interrupted: Callable[[], bool] = lambda: False,
    ) -> None:  # fmt: skip
        self.deadline, self.progress, self.interrupted = deadline, progress, interrupted
        self.linkage = Scene.of(mechanism).linkage.limit_drives(duration)  # a drive may be known up to the end only
        # factors (links, 3), in the order of coordinates, with which errors of places and of angles are compared, as lengths
        self.lengths = np.array([[1.0, 1.0, mechanism.length(link.name)] for link in mechanism.links])
        self.has_redundant_rows = len(self.linkage.rows) > self.linkage.reference.size
        self.failure: Failure | None = None
        self.anchors = self._follow(duration)

    def _follow(self, duration: float) -> Course:
        """Follow the motion from the start to the end or to a singular pose, and return the anchors."""
        state = close_loops(self.linkage, np.zeros(1), self.linkage.reference[None].copy())
        assert state is not None  # the scene has checked the start
        anchors, t = [state], 0.0
        fastest = float(np.abs(state.q_t[..., 2]).max())
        h = min(duration, 0.02 / fastest if fastest > 0 else duration / 100)  # 0.02 rad, or any first step, which adapts
        while self._steepness(state.jacobian, self.linkage.jacobian(state.q + h * state.q_t)) > STEEPEST:
            h /= 2
        slow = 0.01 * self.linkage.size / duration  # [m/s]: least scale of errors of speeds, for a start at rest
        while t < duration:
            if self.deadline and perf_counter() > self.deadline:
                self.failure = Failure(Status.TIMED_OUT, f"out of time at t = {t:.6g} s of {duration:.6g} s")
                break
            if self.interrupted():
                self.failure = Failure(Status.INTERRUPTED, f"Ctrl-C at t = {t:.6g} s of {duration:.6g} s")
                break
            h = duration - t if duration - t - h < 1e-12 * duration else h  # no last step of the size of rounding
            guess = state.q + h * state.q_t + h * h / 2 * state.q_tt
            after = close_loops(self.linkage, np.array([t + h]), guess)
            error = steepness = np.inf
            if after is not None:
                error = float(np.abs((after.q - guess) * self.lengths).max()) / self.linkage.size
                steepness = self._steepness(state.jacobian, after.jacobian)
            if after is None or error > LARGEST_ERROR or steepness > STEEPEST or self._is_refused(state, after, slow):
                h /= 2
                if h < 1e-9 * duration:
                    self.failure = self._diagnose_end(anchors)
                    break
                continue
            t, state = t + h, after
            if self.progress is not None:
                self.progress(t / duration)
            anchors.append(state)
            h *= _step_factor(error, steepness)
        return Course(*(np.concatenate(part) for part in zip(*anchors, strict=True)))

    def _is_refused(self, before: Course, after: Course, slow: float) -> bool:
        """Return True if speeds differ much from their linear prediction in a step, or if a singular pose lies in it."""
        h = float(after.time[0] - before.time[0])
        error = float(np.abs((after.q_t - before.q_t - h * before.q_tt) * self.lengths).max())
        largest = max(slow, self._largest_speed(before), self._largest_speed(after))
        is_inaccurate = error > 0.3 * largest  # 0.3: chosen
        if is_inaccurate or self.has_redundant_rows:
            return is_inaccurate or passes_singularity(self.linkage, before, after)
        # Rounding eps of residuals errs the pose, angles as lengths, by eps |1/J| and its Jacobian J by about as much. If that is
        # more than the least singular value of J, about 1 / |1/J|, the side of the dead centre on which the pose lies is unknown.
        amplification = float(np.linalg.norm(np.linalg.inv(after.jacobian[0]) * self.lengths.reshape(-1, 1)))  # |1/J|
        return amplification**2 * float(np.finfo(float).eps) > 1

    def _steepness(self, before: Array, after: Array) -> float:
        """Return |ln(D_after/D_before)|, D the determinants of two Jacobians (1, rows, columns); infinite if their signs differ.

        It is 0 with redundant rows, which may all be dependent in a pose from which there is one way on.
        """
        if self.has_redundant_rows:
            return 0.0
        (sign, log), (next_sign, next_log) = (np.linalg.slogdet(jacobian[0]) for jacobian in (before, after))
        return float(abs(next_log - log)) if sign == next_sign else np.inf

    def _largest_speed(self, course: Course) -> float:
        return float(np.abs(course.q_t * self.lengths).max())  # of start points, and of angles times lengths [m/s]

    def _diagnose_end(self, anchors: list[Course]) -> Failure:
        """Diagnose the early end at the last anchor: a locked pose, or another singular pose."""
        speeds, last = [self._largest_speed(anchor) for anchor in anchors], anchors[-1]
        t, where = float(last.time[0]), explain_singularity(self.linkage, last.q[0], choose_independent_rows(last.jacobian[0]))
        if speeds[-1] > 20.0 * float(np.median(speeds)):  # 20: by choice; towards a locked pose speeds grow beyond bounds
            return Failure(Status.LOCKED, f"the linkage locks at t = {t:.6g} s ({where})")
        after = "what follows is not determined"
        return Failure(Status.SINGULAR, f"the linkage is in a singular pose at t = {t:.6g} s ({where}): {after}")

    def at(self, times: Array) -> Course:
        """Return the motion at times before the end [s]; raise an UnclosedError with a time at which loops do not close."""
        # all at once, if there are not too many (1024 is chosen); if that fails, each half
        found = close_loops(self.linkage, times, _quintic(self.anchors, times)) if len(times) <= 1024 else None
        if found is not None:
            return found
        if len(times) == 1:
            raise UnclosedError(float(times[0]))
        halves = [self.at(part) for part in np.array_split(times, 2)]
        return Course(*(np.concatenate(part) for part in zip(*halves, strict=True)))

    def record(self, course: Course) -> Record:
        """Make the record of the motions of links and blocks, without channels."""
        linkage, mechanism = self.linkage, self.linkage.mechanism
        links, blocks = {link.name: self._motion(course, link) for link in mechanism.links}, {}
        for guide in mechanism.guides:
            i, origin = linkage.index[guide.link], np.array(mechanism.points[guide.point])
            _, position, *rates = self._point_motion(course, i, complex(*(origin - linkage.reference[i, :2])))
            travels = (values @ np.array(guide.along) for values in (position - origin, *rates))
            blocks[guide.point] = BlockMotion(guide.mass, (origin[0], origin[1]), guide.along, *travels)
        undetermined = Scene.of(mechanism).undetermined
        # the record integrates powers over time by the rule
        return Record(mechanism, course.time, links, blocks, rule=corrected_trapezoidal, undetermined=undetermined)

    def _point_motion(self, course: Course, i: int, arm: complex) -> tuple[Array, Array, Array, Array]:
        """Compute arm, place, velocity, acceleration (times, 2) of a point of link i from its arm at t = 0, a complex number."""
        turned = arm * np.exp(1j * (course.q[:, i, 2] - self.linkage.reference[i, 2]))
        arms, omega, alpha = np.column_stack([turned.real, turned.imag]), course.q_t[:, i, 2:], course.q_tt[:, i, 2:]
        place, velocity, acceleration = (values[:, i, :2] for values in (course.q, course.q_t, course.q_tt))
        across = rotate_left(arms)
        return arms, place + arms, velocity + omega * across, acceleration + alpha * across - omega**2 * arms

    def _motion(self, course: Course, link: Link) -> RigidMotion:
        """Compute the motion of a link's centre of mass."""
        mechanism, i = self.linkage.mechanism, self.linkage.index[link.name]
        start = self.linkage.reference[i]
        mass, inertia, centre = link.body.mass_properties(mechanism.length(link.name))
        arm = complex(*centre) * np.exp(1j * start[2])
        _, *places = self._point_motion(course, i, arm)
        turns = course.q[:, i, 2:] - start[2], course.q_t[:, i, 2:], course.q_tt[:, i, 2:]
        centre_of_mass = start[:2] + np.array([arm.real, arm.imag])
        # to all points at t = 0: an element may act on a link at a point that another link has
        arms = {point: np.subtract(position, centre_of_mass) for point, position in mechanism.points.items()}
        return RigidMotion(mass, inertia, arms, *(np.hstack(pair) for pair in zip(places, turns, strict=True)))

    def reactions(self, course: Course, record: Record) -> dict[str, dict[str, Array]]:
        """Compute the reactions of elements with rows from the multipliers mu with J^T mu = M q_tt - f, of least norm."""
        right = self._inertia_less_weight(course) - self._applied_forces(record)
        inverse = invert(course.jacobian.mT)  # the Moore-Penrose inverse if rows are redundant
        multipliers = (inverse @ right.reshape(len(right), -1, 1))[..., 0]
        element_of_row = np.array(self.linkage.names)
        channels: dict[str, dict[str, Array]] = {}
        for name, element in Scene.of(self.linkage.mechanism).elements.items():
            rows = np.flatnonzero(element_of_row == name)
            if len(rows):
                channels[name] = dict(element.reactions(multipliers[:, rows]) or {})
        return channels

    def _inertia_less_weight(self, course: Course) -> Array:
        """Compute M q_tt less the weight, (times, links, 3)."""
        linkage, gravity = self.linkage, np.array(self.linkage.mechanism.gravity)
        total = np.zeros_like(course.q)
        for i, mass, inertia, arm in carried_masses(linkage):
            arms, _, _, acceleration = self._point_motion(course, i, arm)
            force = mass * (acceleration - gravity)
            total[:, i, :2] += force
            total[:, i, 2] += cross(arms, force) + inertia * course.q_tt[:, i, 2]
        return total

    def _applied_forces(self, record: Record) -> Array:
        """Compute forces of guide friction and loads, and moments about the links' starts, (times, links, 3)."""
        linkage, mechanism = self.linkage, self.linkage.mechanism
        total = np.zeros((len(record.time), len(linkage.index), 3))
        for name, element in Scene.of(mechanism).elements.items():
            for reference, force, moment in element.pushes(name, record) or ():
                body, point = place(reference)
                body = linkage.carrying_link(body)  # on which a guide's block slides; other bodies stay
                if body != GROUND:
                    i, motion = linkage.index[body], record.links[body]
                    arm = motion.point(point)[0] - motion.point(mechanism.link(body).start)[0]
                    total[:, i, :2] += force
                    total[:, i, 2] += cross(arm, force) + moment
        return total


def _step_factor(error: float, steepness: float) -> float:
    """Return the factor of the next step; the error of the prediction grows with the step's third power."""
    small = 0.01  # over the longest link, chosen: below it the next step is longer
    if error < small:
        factor = 2.0 if error < small / 8 else 1.3  # at most to `small`; the error grows by 2.2
    else:
        factor = 0.8 if error > LARGEST_ERROR / 2 else 1.0  # 0.8: about half of the error
    return min(factor, 0.26 / max(steepness, 0.1))  # 0.26, chosen: towards D = 0 each step then reduces D by 1.5


def _quintic(anchors: Course, times: Array) -> Array:
    """Interpolate coordinates between anchors by quintic Hermite polynomials."""
    k = np.clip(np.searchsorted(anchors.time, times, side="right") - 1, 0, max(0, len(anchors.time) - 2))
    if len(anchors.time) < 2:  # the motion ended at the start
        return np.repeat(anchors.q, len(times), axis=0)
    h = (anchors.time[k + 1] - anchors.time[k])[:, None, None]
    s = (times - anchors.time[k])[:, None, None] / h
    return quintic([(anchors.q[i], anchors.q_t[i], anchors.q_tt[i]) for i in (k, k + 1)], h, s)[0]
