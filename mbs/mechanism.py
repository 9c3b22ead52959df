"""A planar mechanism in one glance: points, links, joints, guides, stops, loads, masses and drives.

Everything here is frozen, in SI, validated when made, and free of the engine. Fidelity is the type of a link or joint, never
a flag: `Rigid`, `Strut`, `Beam`, `Cable`; `Revolute`, `Clearance`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, inf
from numbers import Real
from pathlib import Path
from typing import Any

from buckler.mbs.elements import KINDS, Drive, Guide, Link
from buckler.mbs.elements.element import GROUND, Element, known, place
from buckler.mbs.elements.frozen import Frozen
from buckler.mbs.upper import upper
from buckler.mbs.validate import names_of, number, pair, sequence_of, short

Pair = tuple[float, float]
AGREE = 1e-9
"""Distance, in lengths of the link, within which the place given of an inner point agrees with the link's."""


@dataclass(frozen=True, repr=False)
class Mechanism:
    """A planar mechanism, checked for consistency when made.

    Parameters
    ----------
    points : mapping of str to (float, float)
        Named points at t = 0, m. Those that a link carries at a fraction of its length may be left out: their places follow.
    links : sequence of Link
    joints : sequence of Revolute or Clearance
    guides : sequence of Guide
    stops : sequence of Stop
    drives : sequence of Drive
    loads, masses : sequence
    velocities : mapping of str to float or (float, float)
        Given velocities at t = 0: of a link's turning, rad/s, or of a point, m/s.
    gravity : (float, float)
        Acceleration in the plane, m/s^2. Zero, the default, also stands for gravity normal to the plane.

    Raises
    ------
    ValueError
        If a name is unknown or doubled, a link has no length, a joint's link does not reach its point, a point that a link
        carries at a fraction of its length lies elsewhere, and so on.
    """

    points: Mapping[str, Pair]
    links: Sequence[Link]
    joints: Sequence[Any] = ()
    guides: Sequence[Guide] = ()
    stops: Sequence[Any] = ()
    drives: Sequence[Drive] = ()
    loads: Sequence[Any] = ()
    masses: Sequence[Any] = ()
    velocities: Mapping[str, Any] = field(default_factory=dict)
    gravity: Pair = field(default=(0.0, 0.0))

    def __post_init__(self) -> None:
        if not isinstance(self.points, Mapping):
            raise ValueError(f"points = {short(self.points)}: must be a mapping of names to (x, y), m")
        object.__setattr__(self, "points", Frozen({k: pair(f"points['{k}']", v, "m") for k, v in dict(self.points).items()}))
        for name, kinds in KINDS.items():
            object.__setattr__(self, name, sequence_of(name, getattr(self, name), kinds))
            for k, element in enumerate(getattr(self, name)):
                names_of(f"{name}[{k}]", element)
        object.__setattr__(self, "gravity", pair("gravity", self.gravity, "m/s^2"))
        object.__setattr__(self, "points", Frozen(_with_inner(dict(self.points), self.links)))
        _check_names(self)
        object.__setattr__(self, "velocities", Frozen(_velocities(self)))
        for element in self.elements().values():
            element.check(self)

    def __str__(self) -> str:
        """Return what it is made of, in a line."""
        links = ", ".join(f"{link.name} ({type(link.body).__name__})" for link in self.links)
        rest = [f"{len(found)} {kind}" for kind in KINDS if kind != "links" and (found := getattr(self, kind))]
        return f"Mechanism of {len(self.points)} points, links {links}" + "".join(f", {part}" for part in rest)

    def __repr__(self) -> str:
        """Return the line that `str` gives: all fields of a mechanism fill pages."""
        return f"<{self}>"

    def link(self, name: str) -> Link:
        """The link of that name; KeyError if there is none."""
        return {link.name: link for link in self.links}[name]

    def guide(self, point: str) -> Guide:
        """The guide of that point; KeyError if there is none."""
        return {guide.point: guide for guide in self.guides}[point]

    def length(self, name: str) -> float:
        """Distance of a link's two end points, m."""
        link = self.link(name)
        (x0, y0), (x1, y1) = self.points[link.start], self.points[link.end]
        return hypot(x1 - x0, y1 - y0)

    def elements(self) -> dict[str, Element]:
        """All elements by their names: a second one of a name is `name.2`."""
        found: dict[str, Element] = {}

        def add(name: str, element: Element) -> None:
            number = 2
            unique = name
            while unique in found:
                unique, number = f"{name}.{number}", number + 1
            found[unique] = element

        for kind in KINDS:
            for element in getattr(self, kind):
                add(element.key, element)
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return a description of plain dictionaries, lists, numbers and names; see `buckler.mbs.files`."""
        document = upper("files.encode", "document")

        return document(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Mechanism:
        """Make the mechanism that `to_dict` or a file describes.

        Raises
        ------
        ValueError
            In one line that begins with the place, such as `links.coupler.body.section.thickness`.
        """
        mechanism = upper("files.decode", "mechanism")

        return mechanism(content)

    def save(self, path: str | Path) -> Path:
        """Write the mechanism to `name.toml` or `name.json`.

        Raises
        ------
        ValueError
            If the ending is another, or the mechanism holds what a file has no name for, such as a Python function.
        """
        save = upper("files.document", "save")

        return save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> Mechanism:
        """Read the mechanism of a `.toml` or `.json` file.

        Raises
        ------
        ValueError
            In one line: the file, the place in it, what is wrong.
        """
        load = upper("files.document", "load")

        return load(path)

    def plot(self, axes: Any = None, names: bool = True) -> Any:
        """Draw the mechanism at t = 0: links to scale, joints, guides, stops, springs, loads and drives by their symbols.

        Parameters
        ----------
        axes : matplotlib Axes, optional
            Where to draw; a new figure by default.
        names : bool
            Write the names of links and points.

        Returns
        -------
        matplotlib Axes
        """
        plot_mechanism = upper("files.plot", "plot_mechanism")

        return plot_mechanism(self, axes, names)

    def write_exudyn_script(self, path: str | Path, duration: float, steps: int | None = None) -> Path:
        """Write a plain script that runs this mechanism in Exudyn without Buckler and gives the same numbers.

        The script writes the places of all points into a CSV file beside it. Its numbers are those of
        `simulate(mechanism, duration, solver=Exudyn(Equal(steps)))`; where a drive alone decides the motion, that is answered
        exactly, and the script differs from it by the integrator's error.

        Parameters
        ----------
        path : str or Path
        duration : float
            s, positive.
        steps : int, optional
            Equal steps of the run; by default 400 a turn of the drive, 200 at least.

        Raises
        ------
        ValueError
            If an element needs functions or solids of Buckler: stops, clearances, struts, modal links, motions of any form,
            springs with laws. It names them.
        """
        exudyn_script = upper("engine.script", "exudyn_script")

        path = Path(path)
        text = exudyn_script(self, duration, steps, f"{path.stem}.csv")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path

    def _repr_html_(self) -> str:
        """Picture and parts, for notebooks."""
        mechanism_html = upper("files.notebook", "mechanism_html")

        return mechanism_html(self)


def _with_inner(points: dict[str, Pair], links: Sequence[Link]) -> dict[str, Pair]:
    """Complete the points with those that links carry at a fraction of their length."""
    for link in links:
        if link.start not in points or link.end not in points:
            continue  # the link's own check names it
        start, end = points[link.start], points[link.end]
        for point, (x, y) in link.inner(start, end).items():
            off = hypot(points[point][0] - x, points[point][1] - y) if point in points else 0.0
            if off > AGREE * hypot(end[0] - start[0], end[1] - start[1]):
                right = f"link '{link.name}' carries it at ({x:.9g}, {y:.9g}) m; leave it out"
                raise ValueError(f"points['{point}'] = {short(points[point])} m: {right}")
            points[point] = (x, y)
    return points


def _velocities(mechanism: Mechanism) -> dict[str, Any]:
    """Check the given velocities: a link's turning or a link's point's velocity."""
    if not isinstance(mechanism.velocities, Mapping):
        raise ValueError(f"velocities = {short(mechanism.velocities)}: must be a mapping of links and points to velocities")
    links = {link.name: link for link in mechanism.links}
    found: dict[str, Any] = {}
    for name, value in mechanism.velocities.items():
        where = f"velocities['{name}']"
        if isinstance(value, Real):
            known("link", name, links, where)
            found[name] = number(where, value, -inf, inf, "rad/s")  # type: ignore[arg-type]
            continue
        if name in links:
            raise ValueError(f"{where} = {short(value)}: a link's is its turning, one number, rad/s")
        body, point = place(name)
        carried = {p for link in links.values() for p in link.points if body in ("", link.name)}
        known("link", body or next(iter(links)), links, where)
        known("point of a link", point, carried, where)
        found[name] = pair(where, value, "m/s")
    return found


def _check_names(mechanism: Mechanism) -> None:
    names = [link.name for link in mechanism.links]
    if not names:
        raise ValueError("links: a mechanism needs at least one link")
    doubled = {name for name in names if names.count(name) > 1} | ({GROUND} & set(names)) | (set(names) & set(mechanism.points))
    if doubled:
        raise ValueError(f"link names must be unique, not '{GROUND}' and not a point's name; doubled: {sorted(doubled)}")
