"""Natural frequencies about an equilibrium, with damping and follower forces, each with its error."""

from dataclasses import dataclass, replace

import numpy as np

from ..functions import has_user_code
from ..geometry import Array
from ..mechanism import Mechanism
from ..process import one_thread
from ..progress import USER_STOPS, watch, watching
from ..spectral.scene import CompiledScene
from ..validate import whole
from .answer import ACCURACY, DEGREE_STEP, LARGEST_ERROR, MAX_DEGREE, Answer, Ending, Equilibrium, check, list_omissions
from .problem import SEARCH_STOPS, Problem, Rest, find_moving_link, loads_of
from .rest import equilibrium
from .spectrum import Spectrum


@dataclass(frozen=True)
class Frequencies(Answer):
    """Small motions exp(s t) about an equilibrium, in the order of |s|; those that decay without oscillation come last.

    At the coordinates `q` (n,), `values` (count,) are the exponents s [1/s], zero below the rounding error, and `shapes`
    (n, count) their eigenvectors. Of two conjugate exponents only the one with Im s > 0 is given.

    `errors` (count,) of |s|/2 pi [Hz] are the largest of three: rounding, the change by a higher degree of the strips, and the
    change by kinks of laws. `names` are 'rigid motion of ...', 'vibration', 'decay', 'growth', 'flutter'.
    """

    scene: CompiledScene
    q: Array
    values: Array
    shapes: Array
    errors: Array
    names: list[str]
    stable: bool

    @property
    def angular(self) -> Array:
        """Angular frequencies [rad/s], the imaginary parts of s; 0 without oscillation."""
        return np.asarray(self.values.imag)

    @property
    def hertz(self) -> Array:
        """Frequencies [Hz]."""
        return self.angular / (2 * np.pi)

    @property
    def damping(self) -> Array:
        """Damping ratios -Re s / |s|: 1 for decay without oscillation, negative for growth; 0 for rigid motions."""
        return 0.0 - self.values.real / np.maximum(np.abs(self.values), 1e-300)

    def rows(self) -> list[tuple[str, str]]:
        """Return rows of the table, one for each frequency."""
        damping = 0.0 + np.round(self.damping, 12)  # without rounding, and without a negative zero
        lines = zip(self.names, self.hertz, damping, self.errors, strict=True)
        rows = [(name, f"{hertz:.9g} Hz, damping ratio {ratio:.4g}, error {error:.1e} Hz") for name, hertz, ratio, error in lines]
        return rows or [("nothing vibrates", "drives and joints hold all of it")]


@watch("steps")  # uses timeout and progress
@one_thread()
def frequencies(
    mechanism: Mechanism, about: Equilibrium | None = None, *, count: int = 6, degree: int | None = None,
    timeout: float | None = None, progress: bool | None = None,
) -> Frequencies:  # fmt: skip
    """Compute natural frequencies of a mechanism with its drives fixed; raise a ValueError for an invalid argument.

    Parameters
    ----------
    about : Equilibrium, optional
        Equilibrium about which the mechanism vibrates; by default the equilibrium under the loads.
    count : int
        Number of lowest frequencies, rigid motions included.
    degree : int, optional
        Degree of the strips; by default it is increased until all relative errors are below 1e-8, or are rounding.
    timeout, progress
        Time limit [s], after which the best so far is the answer; True, the default in terminals, shows the expected time.
    """
    check(mechanism, degree)
    whole("count", count, 1, 1000)
    try:
        about = about or equilibrium(mechanism, degree=degree)
        if about.status not in (Ending.OK, Ending.UNSTABLE, Ending.INACCURATE):
            return _make_failure(about.scene, about.status, about.message)
        rest = Rest(about.q, about.multipliers, about.load)
        return _refine(Problem(about.scene, loads_of(about.scene)), rest, int(count), degree is not None)
    except USER_STOPS:
        scene = about.scene if about else CompiledScene.of(mechanism, degree)
        return _make_failure(scene, Ending.NOT_REACHED, "none was found yet")


def _make_failure(scene: CompiledScene, status: Ending, message: str) -> Frequencies:
    """Make the result without any frequency."""
    nothing, shapes = np.empty(0), np.empty((scene.size, 0), complex)
    return Frequencies(status, message, scene, scene.q0, nothing.astype(complex), shapes, nothing, [], False)


def _spectrum(problem: Problem, rest: Rest) -> Spectrum:
    """Compute the spectrum at a state; eigenvalues below their rounding error become zero."""
    found = problem.spectrum(rest)  # changes the load factor in the scene to that of the state
    problem.set_parameter(problem.initial)  # restores the loads as given
    return replace(found, values=np.where(found.neutral, 0.0, found.values))


def _refine(problem: Problem, rest: Rest, count: int, keeps_degree: bool) -> Frequencies:
    """Increase the degree, unless it `keeps_degree`, until the lowest frequencies stay; errors are their last changes."""
    found = _spectrum(problem, rest)
    errors, previous = found.rounding[:count], np.inf  # errors of `found`; relative change in the refinement before
    while problem.scene.strips:
        finer, state = problem.refine(rest, max(DEGREE_STEP, problem.scene.degree // 4))  # larger steps where degrees are high
        try:
            watching.get().step()
            state = finer.newton(state)
            new = _spectrum(finer, state)
        except SEARCH_STOPS as error:
            # errors of an earlier refinement hold if the user stops; they are unknown without one, or if a finer search fails
            keeps_errors = isinstance(error, USER_STOPS) and previous < np.inf
            if not keeps_errors:
                errors = np.full(len(errors), np.inf)
            break
        coarse = found
        if not keeps_degree:  # else the finer frequencies only give the errors
            problem, rest, found = finer, state, new
        change = np.full(min(count, len(found.values)), np.inf)
        common = min(count, len(coarse.values), len(new.values))
        # compared by their order: where two change places, their errors are too large
        change[:common] = np.abs(new.values[:common] - coarse.values[:common])
        rounding, is_neutral = found.rounding[:count], found.neutral[:count]  # neutral: zero to rounding
        errors = np.maximum(change, np.where(is_neutral, 0.0, rounding))
        relative = float(np.max(change / np.maximum(np.abs(found.values[:count]), 1e-300), initial=0.0, where=~is_neutral))
        is_rounding = 0.5 * previous < relative < 1e-5  # small, by convention, and not halved: rounding of the equilibrium
        previous = relative
        highest = max(MAX_DEGREE, 3 * count)  # the k-th mode of a strip has about k half-waves; the 3 is chosen
        is_enough = is_rounding or relative <= ACCURACY or (change <= rounding).all()
        if keeps_degree or is_enough or problem.scene.degree > highest:
            break
    changes = _changes_by_kinks(problem, rest, found, count)
    return _frequencies(problem.scene, rest.q, found, np.maximum(errors, changes), count, bool(changes.any()))


def _changes_by_kinks(problem: Problem, rest: Rest, found: Spectrum, count: int) -> Array:
    """Compute the changes of eigenvalues of the tangent at displaced states, (count,); 0 if no law of a user has a kink.

    A displaced state need not be an equilibrium: only the change of the tangent counts.
    """
    values = found.values[:count]
    changes = np.zeros(len(values))
    scene = problem.scene.source
    has_laws = has_user_code(scene.mechanism) or any(getattr(load, "law", None) for load in scene.mechanism.loads)
    for k, shape in enumerate(np.real(found.shapes[:, :count]).T if has_laws else ()):
        # the coordinate that changes most changes by 1e-4 of its unit, a chosen number
        step = 1e-4 * shape / max(np.abs(shape / problem.units).max(), 1e-300)
        for sign in (1, -1):
            displaced = _spectrum(problem, rest._replace(q=rest.q + sign * step)).values[: len(values)]
            changes[k] = max(changes[k], np.abs(displaced[k] - values[k]) if k < len(displaced) else 0.0)
    return np.where(changes > 0.05 * np.abs(values), changes, 0.0)  # 0.05, chosen: smooth laws change values far less


def _frequencies(scene: CompiledScene, q: Array, found: Spectrum, errors: Array, count: int, kinked: bool) -> Frequencies:
    """Make the result with names, status and message; `kinked` if a law has a kink near the equilibrium."""
    names, values = [], found.values[:count]
    for value, neutral, growth, shape in zip(values, found.neutral, found.growth, found.shapes.T, strict=False):
        if neutral:
            names.append(f"rigid motion of {find_moving_link(scene, q, np.real(shape))}")
        elif growth > 0.0:  # Re s, zero below its rounding error
            names.append("flutter" if value.imag else "growth")
        else:
            names.append("vibration" if value.imag else "decay")
    limits = LARGEST_ERROR * np.abs(values)  # [1/s], as `errors`; LARGEST_ERROR is the 1e-4 of the message below
    wrong = [i + 1 for i, (limit, error) in enumerate(zip(limits, errors, strict=True)) if error > limit > 0.0]
    notes = [] if found.stable else [f"unstable: a small motion grows at {found.growth.max():.4g} 1/s"]
    advice = "a law has a kink where it rests: simulate small motions" if kinked else "give a higher degree"
    notes += [f"frequencies {', '.join(map(str, wrong))} are not known to 1e-4; {advice}"] if wrong else []
    notes += list_omissions(scene.mechanism, "friction damps as its law does near rest")
    status = Ending.INACCURATE if wrong else Ending.OK if found.stable else Ending.UNSTABLE
    return Frequencies(
        status, "; ".join(notes), scene, q, values, found.shapes[:, :count], errors / (2 * np.pi), names, found.stable
    )  # fmt: skip
