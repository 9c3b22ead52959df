"""A planar mechanism as one immutable value in SI units, checked when it is made; no solver is needed for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .assembly import Assembly, Pair, assemble, carried_points, check_links
from .declare import Part, Quantity, RefusalError, Schema, build, declared, field, fields_written, vector
from .declare.compound import Either, Named, Several, Vector
from .documents import document
from .documents.document import PARAMETERS
from .documents.shorthand import SHORT, expand, substitute
from .elements import KINDS, Coupling, Drive, Guide, Joint, Link, Load, Mass, Stop
from .elements.element import GROUND, Element, Parts, place
from .elements.link import Frozen
from .elements.references import UnknownError, check_known
from .imports import import_late
from .validate import short

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RUN = "run"
"""Table of a file with the settings of a run, such as duration and accuracy."""
ASIDE = ("about", RUN)
"""Tables of a file that are no part of the mechanism."""


class Placed(Frozen):
    """Places of all points [m] by name, immutable; the attribute `given` has the places that the user gave."""

    __slots__ = ("given",)

    def __init__(self, items: Any, given: Mapping[str, Pair]) -> None:
        super().__init__(items)
        self.given = given


class Places(Named):
    """Type of the field `points`: files hold given places only, as the others follow from lengths and angles."""

    def read(self, name: str, given: object) -> dict[str, Any]:
        """Read the given places."""
        return super().read(name, given.given if isinstance(given, Placed) else given)

    def write(self, name: str, value: Any) -> dict[str, Any]:
        """Write the given places."""
        return super().write(name, value.given)


class Links(Several):
    """Type of the field `links`: a list of links, in files a table for each, by the link's name."""

    words = "a list of links, in files tables by name"

    def read(self, name: str, given: object) -> tuple[Any, ...]:
        """Read links from a list, or from tables by name, into a tuple."""
        if not isinstance(given, Mapping):
            return super().read(name, given)
        for key, table in given.items():
            if isinstance(table, Mapping) and table.get("name", key) != key:
                raise ValueError(f"{name}.{key}: has another name, {table['name']!r}")
        tables = {key: {**table, "name": key} if isinstance(table, Mapping) else table for key, table in given.items()}
        return tuple(self.item.read(f"{name}.{key}", table) for key, table in tables.items())

    def write(self, name: str, value: Any) -> Any:
        """Write a table for each link, by name."""
        tables = {link.name: self.item.write(f"{name}.{link.name}", link) for link in value}
        return {key: {k: v for k, v in table.items() if k != "name"} for key, table in tables.items()}

    def schema(self) -> Schema:
        """Return the schema of tables by name."""
        return {"type": "object", "additionalProperties": self.item.schema()}


def _elements(kind: str, doc: str) -> Any:
    """Make a field for a tuple of elements, empty by default."""
    return field(Several(Part((KINDS[kind],))), doc, default=())


@declared
class Mechanism(Parts):
    """A planar mechanism; a ValueError on elements that contradict each other begins with the place in a file, as `joints[0]`.

    >>> arm = Link("arm", "O", "A", Rigid(Section(width=0.03, thickness=5e-3)))
    >>> Mechanism({"O": (0, 0), "A": (0.2, 0)}, [arm], joints=[Revolute("O", "ground", "arm")], gravity=(0, -9.81)).gravity
    (0.0, -9.81)
    """

    __slots__ = ("scene",)  # cache of `Scene.of`

    points: Mapping[str, Pair] = field(
        Places(Vector("m"), "points"),
        "places at t = 0; a point may be left out if lengths and angles of links determine it, or if a link `carries` it",
    )
    links: Sequence[Link] = field(Links(Part((Link,))), "what moves; by name in files")
    joints: Sequence[Joint] = _elements("joints", "what joins links")
    guides: Sequence[Guide] = _elements("guides", "slider blocks")
    stops: Sequence[Stop] = _elements("stops", "what points must not pass")
    drives: Sequence[Drive] = _elements("drives", "prescribed motions")
    loads: Sequence[Load] = _elements("loads", "forces, torques, motors, springs")
    masses: Sequence[Mass] = _elements("masses", "masses fixed to links")
    couplings: Sequence[Coupling] = _elements("couplings", "gears, racks, belts, ropes")
    velocities: Mapping[str, float | Pair] = field(
        Named(Either((Quantity("rad/s"), Vector("m/s"))), "links and points"),
        "velocities at t = 0: angular velocity of a link, rad/s, or velocity of a point, m/s",
        default_factory=dict,
    )
    gravity: Pair = vector("m/s^2", doc="in the plane; zero also for gravity normal to it", default=(0.0, 0.0))
    near: Mapping[str, Pair] = field(
        Named(Vector("m"), "points"),
        "rough places of points left out: of several poses of the same lengths the nearest is taken; by default the topmost",
        default_factory=dict,
    )

    def agree(self) -> None:
        """Complete the places of points and check that names and elements fit together; called when all fields are read."""
        given = dict(self.points)
        found = assemble(given, self.links, self.guides, self.near)
        object.__setattr__(self, "points", Placed(carried_points(given | found.points, self.links), given))
        check_links(self.points, self.links)
        object.__setattr__(self, "near", Frozen(self.near))
        object.__setattr__(self, "velocities", Frozen(self.velocities))
        names = [link.name for link in self.links]
        if not names:
            raise ValueError("links: a mechanism needs at least one link")
        doubled = {name for name in names if names.count(name) > 1} | ({GROUND} & set(names)) | (set(names) & set(self.points))
        if doubled:
            raise ValueError(f"link names must be unique, not '{GROUND}' and not a point's name; doubled: {sorted(doubled)}")
        _check_velocities(self)
        for kind in KINDS:
            for k, element in enumerate(getattr(self, kind)):
                try:
                    element.check(self)
                except ValueError as error:
                    where = f"links.{element.name}" if kind == "links" else f"{kind}[{k}]"  # place in a file
                    field_name = error.field_of(element) if isinstance(error, UnknownError) else ""  # with the name
                    raise RefusalError(str(error), f"{where}.{field_name}".rstrip(".")) from None

    def __getstate__(self) -> dict[str, object]:
        """Return the fields for pickling, without the slot `scene`, which is computed again."""
        return dict(vars(self))

    def __str__(self) -> str:
        links = ", ".join(f"{link.name} ({type(link.body).__name__})" for link in self.links)
        rest = [f"{len(found)} {kind}" for kind in KINDS if kind != "links" and (found := getattr(self, kind))]
        return f"Mechanism of {len(self.points)} points, links {links}" + "".join(f", {part}" for part in rest)

    def __repr__(self) -> str:
        return f"<{self}>"  # all fields of a mechanism would fill pages

    def link(self, name: str) -> Link:
        """Return the link of a name; raise a KeyError if it is unknown."""
        return {link.name: link for link in self.links}[name]

    def guide(self, point: str) -> Guide:
        """Return the guide of a point; raise a KeyError if the point has none."""
        return {guide.point: guide for guide in self.guides}[point]

    def assemblies(self) -> Assembly:
        """Return the poses that lengths and angles allow: places of the points whose places were left out."""
        return assemble(self.points.given, self.links, self.guides, self.near)  # type: ignore[attr-defined]

    def elements(self) -> dict[str, Element]:
        """Return all elements by name; a second element of the same name is `name.2`."""
        found: dict[str, Element] = {}
        for kind in KINDS:
            for element in getattr(self, kind):
                name, number = element.key, 2
                while name in found:
                    name, number = f"{element.key}.{number}", number + 1
                found[name] = element
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return plain dictionaries, lists, numbers and names, as in files; ValueError for a value without a form in a file."""
        return fields_written("", self)

    @classmethod
    def from_dict(cls, content: Mapping[str, object]) -> Mechanism:
        """Make the mechanism that `to_dict` or a file describes; ValueError of one line that begins with the place of a fault."""
        if not isinstance(content, Mapping):
            raise ValueError(f"file = {short(content)}: must be a table")
        full = substitute(expand(content))  # with shorthand written out and values in place of the names of parameters
        described = {key: value for key, value in full.items() if key not in ASIDE}
        also_known = (*ASIDE, *SHORT, PARAMETERS)  # keys of a file beside the fields, for messages; SHORT: those of shorthand
        kinds = {"": cls}  # '' is the kind of a table that names none
        mechanism: Mechanism = build("", described, kinds, also_known)  # '' is the place of the whole file
        return mechanism

    def save(self, path: str | Path) -> Path:
        """Write the mechanism as a `.toml` or `.json` file; ValueError for another ending or a value without a form in a file."""
        return document.write(self.to_dict(), Path(path))

    @classmethod
    def load(cls, path: str | Path) -> Mechanism:
        """Read the mechanism of a `.toml` or `.json` file; ValueError of one line with the file, the place and the fault."""
        content = document.read(Path(path))
        try:
            return cls.from_dict(content)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    def plot(self, axes: Axes | None = None, names: bool = True) -> Any:
        """Draw the mechanism at t = 0, with `names` of links and points, in matplotlib's `axes` or new ones, which it returns."""
        return import_late("view.plot:plot_mechanism")(self, axes, names)


def _check_velocities(mechanism: Mechanism) -> None:
    """Raise a ValueError unless each velocity is one number of a link, or a vector of a point on a link."""
    links = {link.name: link for link in mechanism.links}
    for name, value in mechanism.velocities.items():
        where = f"velocities['{name}']"
        if isinstance(value, float):
            check_known("link", name, links, where)
            continue
        if name in links:
            raise ValueError(f"{where} = {short(value)}: a link has an angular velocity, one number, rad/s")
        body, point = place(name)  # `coupler:A` names a body and a point, `A` a point alone
        if body:
            check_known("link", body, links, where)
        on_links = {p for link in links.values() for p in link.points if not body or link.name == body}
        check_known("point of a link", point, on_links, where)
