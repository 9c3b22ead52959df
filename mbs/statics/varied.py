"""Problems of the statics whose parameter is a number of the mechanism or the frequency of its motion."""

import numpy as np

from ..documents.document import change, get
from ..geometry import Array
from ..mechanism import Mechanism
from ..spectral.scene import CompiledScene
from .problem import Problem, Rest, StaticsError, loads_of


class Varied(Problem):
    """Problem whose parameter is a number of the mechanism; `scene` is that for the value `current`, made anew for each value."""

    def __init__(self, mechanism: Mechanism, name: str, degree: int | None) -> None:
        self.name, self.document, self.degree = name, mechanism.to_dict(), degree
        try:
            value = get(self.document, name)
        except (KeyError, IndexError) as error:
            raise ValueError(f"parameter = '{name}': there is no {error} in the mechanism") from None
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"parameter = '{name}': must be a number of the mechanism, in SI, not {value!r}")
        self.current = float(value)
        super().__init__(CompiledScene.of(mechanism, degree), initial=self.current)
        self.label = f"{self.name} [SI]"

    def set_parameter(self, parameter: float) -> None:
        """Make the scene with a value of the number."""
        if parameter != self.current:
            self.current = parameter
            self.scene = CompiledScene.of(self.mechanism_at(parameter), self.degree)

    def mechanism_at(self, parameter: float) -> Mechanism:
        """Make the mechanism with a value of the number; raise a ValueError if there is none."""
        return Mechanism.from_dict(change(self.document, {self.name: parameter}))

    def slope(self, rest: Rest, residuals: tuple[Array, Array] | None = None) -> Array:
        """Return the derivative of (f - G^T lambda, g) by the number, a central difference: `residuals` are not needed."""
        # a half width of h = 1e-5 over the number has relative errors of about h^2 by truncation, 1e-16/h by rounding
        step = 1e-5 * max(abs(rest.parameter), abs(self.initial), 1e-300)
        sides = [self.residual(rest._replace(parameter=rest.parameter + change), False)[:2] for change in (step, -step)]
        return (np.concatenate(sides[0]) - np.concatenate(sides[1])) / (2 * step)

    def with_degree(self, increment: int) -> "Varied":
        """Return the problem with strips of a higher degree."""
        return Varied(Mechanism.from_dict(self.document), self.name, self.scene.degree + increment)


class Paced(Problem):
    """Equations over the frequency of a motion [Hz]; time runs faster in all functions, by the factor parameter/`initial`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.label = "frequency [Hz]"

    def set_parameter(self, parameter: float) -> None:
        """Set the frequency [Hz]."""
        self.scene.tables.time_factor[:] = parameter / self.initial  # an array of one number, for compiled code


def problem_over(
    mechanism: Mechanism, degree: int, *,
    load: str | list[str] | None = None, drive: str | None = None, parameter: str | None = None,
) -> Problem:  # fmt: skip
    """Make the problem over loads, by default all, over a drive or over any number of a mechanism."""
    if parameter is not None:
        return Varied(mechanism, parameter, degree)
    scene = CompiledScene.of(mechanism, degree)
    if drive is None:
        return Problem(scene, loads_of(scene, [load] if isinstance(load, str) else load))
    if drive not in scene.row_names:
        raise StaticsError(f"drive = '{drive}': unknown; constraints: {', '.join(dict.fromkeys(scene.row_names))}")
    return Problem(scene, row=scene.row_names.index(drive), initial=0.0)  # a drive has one row
