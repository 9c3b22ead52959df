"""Cross-sections of links, and their materials; all quantities in SI.

E, G are the moduli, A the area, I the second moment of area, rho the density, k the shear correction, L the length.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi, sqrt
from typing import Any

from ..declare import Declared, Part, Schema, any_of, declared, did_you_mean, field, quantity, show
from ..validate import number


@declared
class Material(Declared):
    """Linear elastic, isotropic material with Kelvin-Voigt damping.

    The bending moment is E I (kappa + bending_damping dkappa/dt), the normal force E A (eps + axial_damping deps/dt), with the
    curvature kappa and the axial strain eps. The two retardation times differ because measured losses in bending contain losses
    in air and joints.

    >>> Material(modulus=70e9, density=2700.0).poisson
    0.3
    """

    modulus: float = quantity("Pa", above=0, doc="Young's modulus")
    density: float = quantity("kg/m^3", above=0, doc="mass per volume")
    poisson: float = quantity("1", above=-1, high=0.5, doc="Poisson's ratio", default=0.3)
    bending_damping: float = quantity("s", low=0, doc="retardation time of the bending moment", default=0.0)
    axial_damping: float = quantity("s", low=0, doc="retardation time of the normal force", default=0.0)


STEEL = Material(modulus=210e9, density=7850.0)
MATERIALS = {
    "steel": STEEL,
    "spring steel": Material(modulus=206e9, density=7850.0),
    "aluminium": Material(modulus=70e9, density=2700.0),
    "PLA": Material(modulus=3.5e9, density=1240.0, poisson=0.36),
}
"""Materials by their names in files: steel by EN 1993-1-1, drawn wire by EN 13906-1, aluminium by EN 1999-1-1.

PLA has typical values of solid parts; printed parts with gaps are softer and lighter."""


class MaterialPart(Part):
    """Specification of a material by its name or its properties."""

    def fits(self, raw: object) -> bool:
        """Return True for a material, or a text."""
        return isinstance(raw, str) or super().fits(raw)

    def read(self, name: str, raw: object) -> Any:
        """Return the material of a name or a table."""
        if not isinstance(raw, str):
            return super().read(name, raw)
        if raw not in MATERIALS:
            known = ", ".join(MATERIALS)
            raise ValueError(f"{name} = {show(raw)}: unknown material{did_you_mean(raw, MATERIALS)}; known: {known}")
        return MATERIALS[raw]

    def schema(self) -> Schema:
        """Return the JSON schema of a name or a table."""
        return any_of([{"enum": list(MATERIALS)}, super().schema()])


class SlenderSection:
    """Base of sections: properties of a slender strip of a length [m] between two pins."""

    def euler_load(self: Any, length: float) -> float:
        """Return the critical load of the pinned strip, pi^2 E I / L^2 [N]."""
        return float(pi**2 * self.bending_stiffness / length**2)

    def first_frequency(self: Any, length: float) -> float:
        """Return the first angular frequency of bending of the pinned strip [rad/s]."""
        return float((pi / length) ** 2 * sqrt(self.bending_stiffness / self.mass_per_length))


@declared
class Section(SlenderSection, Declared):
    """Rectangular section of a link.

    >>> round(Section(width=0.03, thickness=3e-4).euler_load(0.31), 4)  # pi^2 E I / L^2, N
    1.4558
    """

    # the bounds are chosen
    width: float = quantity("m", low=1e-9, high=1e6, doc="size normal to the plane of motion")
    thickness: float = quantity("m", low=1e-9, high=1e6, doc="size in the plane of motion, across the link")
    material: Material = field(MaterialPart((Material,)), "a material, or the name of one", default=STEEL)

    @property
    def area(self) -> float:
        """Area A = width thickness [m^2]."""
        return self.width * self.thickness

    @property
    def second_moment(self) -> float:
        """Second moment of area I = width thickness^3 / 12 [m^4]."""
        return self.width * self.thickness**3 / 12

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness E I [N m^2]."""
        return self.material.modulus * self.second_moment

    @property
    def axial_stiffness(self) -> float:
        """Axial stiffness E A [N]."""
        return self.material.modulus * self.area

    @property
    def shear_stiffness(self) -> float:
        """Shear stiffness k G A [N], with Cowper's k = 10 (1 + nu) / (12 + 11 nu) of a rectangle (doi 10.1115/1.3625046)."""
        nu = self.material.poisson
        shear_modulus = self.material.modulus / (2 * (1 + nu))
        return 10 * (1 + nu) / (12 + 11 * nu) * shear_modulus * self.area

    @property
    def mass_per_length(self) -> float:
        """Mass per length rho A [kg/m]."""
        return self.material.density * self.area

    @property
    def inertia_per_length(self) -> float:
        """Rotary inertia per length rho I [kg m]."""
        return self.material.density * self.second_moment

    def damped(self, ratio: float, length: float) -> Section:
        """Return the section with the bending damping that gives mode n of the pinned strip the damping ratio n^2 `ratio`."""
        number("ratio", ratio, 0.0, inf, "1")
        retardation = 2 * ratio / self.first_frequency(length)
        return replace(self, material=replace(self.material, bending_damping=retardation))


@declared
class Profile(SlenderSection, Declared):
    """A section of any shape and material, given by its stiffnesses and masses per length.

    Drawings and stresses assume a square bar with the same bending and axial stiffness.

    >>> strip = Profile(0.1, 1e6, 4e5, mass_per_length=0.07, inertia_per_length=1e-9)
    >>> strip.bending_stiffness  # N m^2
    0.1
    """

    bending_stiffness: float = quantity("N m^2", above=0, doc="E I")
    axial_stiffness: float = quantity("N", above=0, doc="E A")
    shear_stiffness: float = quantity("N", above=0, doc="k G A; not used by a Cable, whose elements do not shear")
    mass_per_length: float = quantity("kg/m", above=0, doc="rho A")
    inertia_per_length: float = quantity("kg m", above=0, doc="rho I; not used by a Cable")
    bending_damping: float = quantity("s", low=0, doc="retardation time of the bending moment", default=0.0)
    axial_damping: float = quantity("s", low=0, doc="retardation time of the normal force", default=0.0)

    @property
    def thickness(self) -> float:
        """Thickness of the equivalent square bar [m]."""
        return sqrt(12 * self.bending_stiffness / self.axial_stiffness)

    width = thickness  # [m], as of a square

    @property
    def material(self) -> Material:
        """Material of the equivalent square bar; nothing reads its Poisson's ratio, as a profile has its shear stiffness."""
        area = self.thickness**2
        return Material(
            self.axial_stiffness / area, self.mass_per_length / area,
            bending_damping=self.bending_damping, axial_damping=self.axial_damping,
        )  # fmt: skip
