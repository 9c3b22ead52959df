"""What the two papers leave open, and which study has it as a parameter: tables of the pages evidence-*.md.

`python docs/open_assumptions.py` prints them; a test holds the pages to them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from buckler.mbs.declare import Declaration
from buckler.studies.kit import registry
from buckler.studies.kit.parameters import specs

STRIKING = ("gravity", "gravity_angle", "motor", "motor_inertia", "imperfection", "mass", "friction")
"""Of the striking slider-crank."""
RATTLING = (
    "gravity", "gravity_angle", "pin_on", "pin", "friction_thresholds", "modal_damping", "rocker_damping", "modes_of",
    "bending", "axial", "frequency_factor",
    "damping_unit", "in_plane_depth", "clearance",
)  # fmt: skip
"""Of the crank-rocker with clearance."""
INSTEAD: Mapping[tuple[str, str], str] = {
    ("design", "friction"): "`friction_force`",
    ("impact-map", "imperfection"): "`bows`",
    ("impact-map", "mass"): "`masses`",
    ("crank-rocker", "bending"): "2",
    ("crank-rocker", "axial"): "1",
    ("crank-rocker", "frequency_factor"): "1",
    ("modes", "bending"): "`sets`",
    ("modes", "axial"): "`sets`",
    ("modes", "frequency_factor"): "1",
}
"""What a study has in place of a parameter of that name."""
OTHERS = ("nonsmooth",)
"""Studies of other published mechanisms, whose sources leave none of this open."""
PAGES = {"striking": STRIKING, "rattling": RATTLING}
"""Assumptions of each package of studies."""


def studies(package: str) -> list[str]:
    """Names of the studies of a package that the registry holds."""
    return [name for name, entry in registry.STUDIES.items() if f".{package}." in entry.module and name not in OTHERS]


def missing(package: str) -> list[tuple[str, str]]:
    """Studies and assumptions of a package that have neither a parameter nor something in its place."""
    found = {name: specs(registry.load(name).Parameters) for name in studies(package)}
    return [
        (name, what) for name, own in found.items() for what in PAGES[package] if what not in own and (name, what) not in INSTEAD
    ]


def _cell(name: str, what: str, own: Mapping[str, Declaration], default: object) -> str:
    if what in own:
        return own[what].show(default)
    return INSTEAD.get((name, what), "–")


def _ranges(names: Sequence[str], assumptions: Sequence[str]) -> list[str]:
    """One row an assumption: what it is, and what it may be in the first study that has it."""
    rows = ["| assumption | what | allowed |", "|---|---|---|"]
    for what in assumptions:
        own = next(found[what] for found in (specs(registry.load(name).Parameters) for name in names) if what in found)
        rows.append(f"| `{what}` | {own.doc} | {own.allowed} |")
    return rows


def tables(package: str) -> str:
    """Markdown: what each assumption may be; the default of each study."""
    names, assumptions = studies(package), PAGES[package]
    rows = ["| study | " + " | ".join(f"`{what}`" for what in assumptions) + " |", "|---" * (len(assumptions) + 1) + "|"]
    for name in names:
        kind = registry.load(name).Parameters
        own, made = specs(kind), kind()
        cells = [_cell(name, what, own, getattr(made, what, None)) for what in assumptions]
        rows.append(f"| `{name}` | " + " | ".join(cells) + " |")
    return "\n".join([*_ranges(names, assumptions), "", *rows])


def main() -> None:
    """Print both tables."""
    for package in PAGES:
        print(f"{tables(package)}\n")


if __name__ == "__main__":
    main()
