"""Links and what they are made of: fidelity is the type of a link's body, never a flag."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from buckler.elastica import law
from buckler.mbs.elements.section import Section
from buckler.mbs.modal.spec import Modal as Modal
from buckler.mbs.validate import number, whole


class _Chosen(int):
    """A number of elements nobody asked for: an int like any other, which the accuracy asked of a run may replace."""


CHOSEN = _Chosen(8)
"""Elements of a flexible link whose maker names no number: 8, or what the accuracy asked of a run takes."""


@dataclass(frozen=True)
class Rigid:
    """A uniform rigid bar of this section."""

    section: Section


@dataclass(frozen=True)
class Strut:
    """A massless pinned strip: straight and stiff up to the Euler load, then the post-buckled force of the exact elastica.

    Parameters
    ----------
    section : Section
    load : callable
        Normalised force p(u), p = P L^2/(E I), of the normalised bending shortening u >= 0: `buckler.elastica.law.fast` (default,
        exact to 1e-12 for u <= 1), `buckler.elastica.pinned.load` (to u = 1.5) or the published `buckler.elastica.law.quartic`.
    """

    section: Section
    load: Callable[[Any], Any] = law.fast


@dataclass(frozen=True)
class Beam:
    """A flexible link of geometrically exact (shear-deformable) beam elements.

    Parameters
    ----------
    section : Section
    elements : int, optional
        Number of elements, 1 to 1000. By default as many as the accuracy asked of a run takes, or 8 where none is asked.
    nodes : int
        Nodes an element, 2 (linear) or 3 (quadratic; far more accurate for its price).
    imperfection : float
        Stress-free half-sine bow, m, at mid-span; positive to the left of the direction from start to end.
    """

    section: Section
    elements: int = CHOSEN
    nodes: int = 3
    imperfection: float = 0.0

    def __post_init__(self) -> None:
        whole("elements", self.elements, 1, 1000)
        whole("nodes", self.nodes, 2, 3)
        number("imperfection", self.imperfection, -1.0, 1.0, "m")


@dataclass(frozen=True)
class Cable:
    """A flexible link of shear-rigid ANCF cable elements (cubic Hermite).

    Parameters
    ----------
    section : Section
    elements : int, optional
        Number of elements, 1 to 1000. By default as many as the accuracy asked of a run takes, or 8 where none is asked.
    imperfection : float
        Stress-free half-sine bow, m, at mid-span; positive to the left of the direction from start to end.
    """

    section: Section
    elements: int = CHOSEN
    imperfection: float = 0.0

    def __post_init__(self) -> None:
        whole("elements", self.elements, 1, 1000)
        number("imperfection", self.imperfection, -1.0, 1.0, "m")


def chooses(body: Body) -> bool:
    """Whether a link leaves its number of elements to the accuracy asked of a run."""
    return isinstance(body, Beam | Cable) and isinstance(body.elements, _Chosen)


Body = Rigid | Strut | Beam | Cable | Modal


@dataclass(frozen=True)
class Link:
    """A named link from one point to another.

    Parameters
    ----------
    name, start, end : str
        Its name, and the names of the points at its two ends.
    body : Rigid, Strut, Beam or Cable
        What it is made of, and so how it is modelled.
    carries : sequence of str
        Further points fixed to a rigid link (a coupler point, a third joint).
    """

    name: str
    start: str
    end: str
    body: Body
    carries: Sequence[str] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "carries", tuple(self.carries))
        if self.carries and not isinstance(self.body, Rigid):
            raise ValueError(f"link '{self.name}': only a Rigid link carries further points, not a {type(self.body).__name__}")

    @property
    def points(self) -> tuple[str, ...]:
        """All points on the link: start, end, carried."""
        return (self.start, self.end, *self.carries)
