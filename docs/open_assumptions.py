"""Assumptions that the two papers leave open, and the default of each study: a table of each page evidence-*.md.

`python docs/open_assumptions.py` prints both; a test holds the pages to them.
"""

from __future__ import annotations

from collections.abc import Mapping

from buckler.mbs.declare import Declaration, declarations
from buckler.studies.kit import registry

STRIKING = ("gravity", "gravity_angle", "motor", "motor_inertia", "imperfection", "mass", "friction")
"""Assumptions of the striking slider-crank."""
RATTLING = (
    "gravity", "gravity_angle", "pin_on", "pin", "friction_thresholds", "modal_damping", "rocker_damping", "modes_of",
    "bending", "axial", "frequency_factor",
    "damping_unit", "in_plane_depth", "clearance",
)  # fmt: skip
"""Assumptions of the crank-rocker with clearance."""
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
"""Cells of studies that have no parameter of that name."""
PAGES = {"striking": STRIKING, "rattling": RATTLING}
"""Assumptions of each package of studies."""


def studies(package: str) -> list[str]:
    """Names of the studies of a package that the registry holds."""
    return [name for name, entry in registry.STUDIES.items() if f".{package}." in entry.module]


def missing(package: str) -> list[tuple[str, str]]:
    """Studies and assumptions of a package that have neither a parameter nor something in its place."""
    found = {name: declarations(registry.load(name).Parameters) for name in studies(package)}
    return [
        (name, what) for name, own in found.items() for what in PAGES[package] if what not in own and (name, what) not in INSTEAD
    ]


def _cell(name: str, what: str, own: Mapping[str, Declaration], default: object) -> str:
    if what in own:
        return own[what].show(default)
    return INSTEAD.get((name, what), "–")


def tables(package: str) -> str:
    """Markdown: a row for each assumption: meaning, range, default of each study."""
    kinds = {name: registry.load(name).Parameters for name in studies(package)}
    own = {name: declarations(kind) for name, kind in kinds.items()}
    heads = ["assumption", "meaning", "allowed", *(f"`{name}`" for name in kinds)]
    rows = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for what in PAGES[package]:
        first = next(found[what] for found in own.values() if what in found)
        cells = [_cell(name, what, own[name], getattr(kind(), what, None)) for name, kind in kinds.items()]
        rows.append(f"| `{what}` | {first.doc} | {first.allowed} | " + " | ".join(cells) + " |")
    return "\n".join(rows)


def main() -> None:
    """Print the tables."""
    for package in PAGES:
        print(f"{tables(package)}\n")


if __name__ == "__main__":
    main()
