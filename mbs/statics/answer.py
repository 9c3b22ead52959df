"""Results of the statics, with status and message, and checks of the input."""

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from ..geometry import Array
from ..imports import import_late
from ..mechanism import Mechanism
from ..process import CTRL_C
from ..scene.scene import Scene
from ..spectral.scene import CompiledScene, MarkerMotion
from ..validate import number, one_of, positive, whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes


DEGREE_STEP = 4
"""Increment of the degree of strips in a refinement: errors fall so fast with it that the change is the coarser one's error."""
MAX_DEGREE = 40
"""Degree of strips at which refinement ends."""
ACCURACY = 1e-8
"""Error at which refinement ends, chosen: of equilibria over the longest link, of frequencies relative."""
CRITICAL_ACCURACY = 1e-6
"""Relative error at which refinement ends, for critical points and periodic motions: chosen."""
LARGEST_ERROR = 1e-4
"""Error from which a result is `INACCURATE`, relative or over the longest link: a convention."""
ROUNDING = 1e-12
"""Size below which places are printed as 0, over the longest link, and angles [rad]: chosen, far below any error of a model."""
FIRST_STEP = 0.02
"""Default arc length of the first step of a path; a change of the parameter by its range has length 1, see `arc`."""
MAX_STEP = 0.1
"""Default arc length of the longest step of a path: at least ten cover the parameter's range."""


class Ending(StrEnum):
    """Status of a result of the statics; any status but OK has a message that says what to do."""

    OK = "OK"
    FREE_MOTION = "FREE_MOTION"  # no equilibrium: a load pushes along a motion that nothing resists
    OPEN_CONTACT = "OPEN_CONTACT"  # no equilibrium: contacts that could resist the motion stay open
    NOT_REACHED = "NOT_REACHED"  # Newton's method failed before the full load, see the message, or found no periodic motion
    UNSTABLE = "UNSTABLE"  # forces balance, but a small motion grows
    INACCURATE = "INACCURATE"  # the result has a larger error than required
    SINGULAR = "SINGULAR"  # a path cannot be followed further
    TOO_MANY_STEPS = "TOO_MANY_STEPS"  # a path did not reach its end, or a search for a periodic motion needed too many steps
    SLACK = "SLACK"  # a rope would have to push
    TIMED_OUT = "TIMED_OUT"  # the time limit was over; the answer is the best so far
    INTERRUPTED = "INTERRUPTED"  # Ctrl-C ended the call; the best so far is the `result` of the exception


@dataclass(frozen=True)
class Answer:
    """Result of the statics: status, message, and a table; base class."""

    status: Ending
    message: str

    def rows(self) -> list[tuple[str, str]]:
        """Return rows of the table: name, and value with unit."""
        raise NotImplementedError

    def mark_stopped(self, why: str) -> Self:
        """Return the answer with the status of a search that Ctrl-C or the time limit ended."""
        status = Ending.INTERRUPTED if why == CTRL_C else Ending.TIMED_OUT
        return replace(self, status=status, message="; ".join(filter(None, (why, self.message))))

    def __str__(self) -> str:
        """Return status, message and a line for each number."""
        head = f"{self.status}: {self.message}" if self.message else str(self.status)
        return "\n".join([head, *(f"{name}: {value}" for name, value in self.rows())])


def check(mechanism: Mechanism, degree: int | None) -> None:
    """Raise a ValueError if an element of the mechanism has states that are integrated, or if the degree is invalid."""
    one_of("mechanism", mechanism, (Mechanism,))
    for name, element in Scene.of(mechanism).elements.items():
        if element.has_states:
            raise ValueError(f"'{name}' has states, which have no statics: they are integrated with a motion only")
    if degree is not None:
        whole("degree", degree, 2, 200)  # more than `MAX_DEGREE`, as only refinement ends there


def check_path(to: float, steps: int, step: float, longest: float, **parameters: object) -> None:
    """Raise a ValueError if the end or a step of a path is invalid, or if more than one of the `parameters` is not None."""
    number("to", to, -np.inf, np.inf, "1")  # any number, in the unit of the parameter
    whole("steps", steps, 1, 100_000)
    for name, value in (("step", step), ("longest", longest)):
        positive(name, value, "1")
    if sum(value is not None for value in parameters.values()) > 1:
        raise ValueError(f"{', '.join(parameters)}: give one of them")


def explain_end(ended: str, last: float, start: float, to: float, steps: int) -> tuple[Ending, str]:
    """Return status and message of a path from `start` to `to` that ended for the reason `ended` at the parameter `last`."""
    led, too_many = f"led to {last:.6g}, not to {to:.6g}", Ending.TOO_MANY_STEPS
    endings = {
        "reached": (Ending.OK, ""),
        "steps": (too_many, f"{steps} steps {led}; give more steps or a longer one"),
        "spent": (too_many, f"the time steps of its periodic motions, as many as allowed, {led}"),
        "singular": (Ending.SINGULAR, f"it cannot be followed beyond {last:.6g}"),
        "closed": (Ending.OK, "it came back to its start"),
        "back": (Ending.OK, f"it turned and came back to {start:.6g}"),  # only a response curve
        "stopped": (Ending.OK, f"it {led}"),  # `mark_stopped` replaces the status
    }
    return endings[ended]


def list_omissions(mechanism: Mechanism, friction_remark: str = "friction may hold it elsewhere") -> list[str]:
    """List effects that the statics leave out: dry friction, with a remark on it, and the modes that modal links leave out."""
    rubbing = [element.friction_at for element in Scene.of(mechanism).elements.values() if element.friction_at]
    modal = [link.name for link in mechanism.links if link.body.linear]  # only modal links are linear
    omissions = [f"{friction_remark}: {', '.join(map(repr, rubbing))}"] if rubbing else []
    return omissions + ([f"errors leave out the choice of modes of {', '.join(map(repr, modal))}"] if modal else [])


def compute_reactions(scene: CompiledScene, multipliers: Array, name: str) -> Array:
    """Convert multipliers lambda (steps, r) to the reactions of an element (steps, rows), with the signs of its signals.

    A joint has the force on its second body, a guide that on its block, a drive its torque or force, a rope its tension.
    """
    rows = [i for i, row in enumerate(scene.row_names) if row == name]
    if not rows:
        raise KeyError(f"no constraint '{name}'; there are: {', '.join(dict.fromkeys(scene.row_names))}")
    element = scene.source.elements[name]
    forces = -element.sense * multipliers[:, rows]  # constraint forces are -G^T lambda; `sense`: sign of the signal
    channels = element.reactions(forces) or {"force": forces}  # arrays by channel; some elements have the force alone
    return np.hstack(list(channels.values()))


KEYS = {"limit": "limits", "branching": "branchings", "flutter": "flutter", "fold": "folds", "doubling": "doublings"}
"""Key of the errors of each kind of critical point; folds and doublings are those of periodic motions."""


@dataclass(frozen=True)
class Equilibrium(Answer):
    """Equilibrium of a mechanism: OK if no small motion grows, UNSTABLE if one does.

    At coordinates `q` (n,) constraints have `multipliers` lambda (r,) in the order of `scene.row_names` [N or N m], with forces
    -G^T lambda; see `reaction`. `load` is the factor of the loads. `growth` is the largest growth rate of a small motion [1/s],
    0 if the equilibrium is `stable`. `neutral` are links that can move without resistance: the equilibrium is one of many.
    `error` is that of positions over the longest link, and of angles [rad]: the larger one of the change by a higher degree of
    the strips and the last step of Newton's method.
    """

    scene: CompiledScene
    q: Array
    multipliers: Array
    load: float
    stable: bool
    growth: float
    neutral: tuple[str, ...]
    error: float

    def point(self, link: str, point: str) -> MarkerMotion:
        """Return position, angle and rates of a point of a link."""
        return self.scene.read(self.scene.marker(link, point), self.q)

    def reaction(self, name: str) -> Array:
        """Return force or torque of a constraint [N or N m], with the signs of a run's signals; see `compute_reactions`."""
        return compute_reactions(self.scene, self.multipliers[None], name)[0]

    def rows(self) -> list[tuple[str, str]]:
        """Return rows of the table: stability, error, and places of points."""
        out = [("stable", "yes" if self.stable else f"no, grows at {self.growth:.4g} 1/s"), ("error", f"{self.error:.1e}")]
        for link in self.scene.mechanism.links:
            if not link.body.massless and np.isfinite(self.q).all():  # massless links have no coordinates; nan: none was found
                for point in link.points:
                    at = self.point(link.name, point)
                    x, y = (value if abs(value) > ROUNDING * self.scene.length else 0.0 for value in at.position)
                    angle = at.angle if abs(at.angle) > ROUNDING else 0.0
                    out.append((f"{link.name}:{point}", f"{x:.9g} m, {y:.9g} m, {angle:.9g} rad"))
        return out


def parameters_at(kind: str, doc: str) -> Any:
    """Make the property that lists the parameters at critical points of a kind."""

    def parameters(route: "Route") -> list[float]:
        """Return the parameters, each as often as its multiplicity."""
        return [point.rest.parameter for point in route.points if point.kind == kind for _ in range(point.multiple)]

    return property(parameters, doc=doc)


@dataclass(frozen=True)
class Route(Answer):
    """Path of equilibria or of periodic motions over a parameter, with critical `points` and their errors.

    `parameter` is (steps,). `q` (steps, n) are coordinates, of a motion those at the start of its period. `points` are `Critical`
    points or `CriticalMotion`s, with the parameter `rest.parameter` and the multiplicity `multiple`. `ended` is 'reached' or
    another reason of `explain_end`. `errors` are arrays by the values of `KEYS`, with m entries for a point of multiplicity m.
    """

    ended: str
    scene: CompiledScene
    parameter: Array
    q: Array
    points: list[Any]
    errors: dict[str, Array] = field(default_factory=dict)
    abscissa: str = "parameter"  # label of the parameter in `plot`
    ordinate: ClassVar[str] = ""  # prefix of the axis label of `plot`

    def plot(self, link: str, point: str, axis: str | None = None, ax: "Axes | None" = None) -> "Axes":
        """Draw position or amplitude of a point along x or y, by default the one that changes more, over the parameter."""
        return import_late("view.plot:plot_path")(self, link, point, axis, ax)

    def rows(self) -> list[tuple[str, str]]:
        """Return rows of the table: critical points in their order, and the end."""
        out, errors = [], {kind: list(self.errors.get(key, ())) for kind, key in KEYS.items()}
        for point in self.points:
            error = f", error {errors[point.kind][0]:.1e}" if errors[point.kind] else ""
            multiple = f", {point.multiple} eigenvalues" if point.multiple > 1 else ""
            out.append((point.kind, f"{point.rest.parameter:.9g}{error}{multiple}"))
            del errors[point.kind][: point.multiple]  # those of this point, of which the first is shown
        end = f" at {self.parameter[-1]:.9g} after {len(self.parameter)} steps" if len(self.parameter) else ""
        return [*out, ("ended", f"{self.ended}{end}")]


@dataclass(frozen=True)
class Path(Route):
    """Equilibria along a path; the status is OK if `to` was reached, or if the path closed.

    `parameter` is the factor of the loads, the travel of the drive [rad or m], or the number that changes. `multipliers`
    (steps, r) are those of constraints. `growth` (steps,) is the largest growth rate of a small motion [1/s], 0 if stable, and
    `unstable` (steps,) the number of negative eigenvalues of K. `points` are limit points, branchings and flutter points in
    their order. `errors` are changes by a higher degree of the strips: of `limits`, `branchings`, `flutter`, and, by the key
    'end', of the last positions. `branches` leave the branchings, if requested.
    """

    multipliers: Array = field(default_factory=lambda: np.empty((0, 0)))
    growth: Array = field(default_factory=lambda: np.empty(0))
    unstable: Array = field(default_factory=lambda: np.empty(0, int))
    branches: list["Path"] = field(default_factory=list)

    def rounding(self, name: str) -> list[float]:
        """Return the errors by rounding of the parameters at `limits`, `branchings` or `flutter`: none can be smaller."""
        return [point.rounding for point in self.points if KEYS[point.kind] == name for _ in range(point.multiple)]

    limits = parameters_at("limit", "Parameters at limit points.")
    branchings = parameters_at("branching", "Parameters at branchings, repeated for each eigenvalue that passes zero.")
    flutter = parameters_at("flutter", "Parameters at which an oscillation begins or ceases to grow.")

    @property
    def stable(self) -> Array:
        """True for each stable equilibrium, shape (steps,)."""
        return self.growth == 0.0

    def point(self, link: str, point: str) -> Array:
        """Return the positions of a point of a link [m], shape (steps, 2)."""
        marker = self.scene.marker(link, point)
        return np.array([self.scene.read(marker, q).position for q in self.q])

    def ordinates(self, link: str, point: str) -> tuple[Array, list[Array]]:
        """Return positions (x, y) to draw, on the path and at critical points."""
        marker = self.scene.marker(link, point)
        return self.point(link, point), [self.scene.read(marker, critical.rest.q).position for critical in self.points]

    def reaction(self, name: str) -> Array:
        """Return force or torque of a constraint [N or N m], shape (steps, rows), with the signs of a run's signals."""
        return compute_reactions(self.scene, self.multipliers, name)
