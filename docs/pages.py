"""Pages of the site that come from code: the gallery, from its scripts, and the elements, from their declarations."""

from __future__ import annotations

import runpy
from collections.abc import Iterator
from pathlib import Path

from matplotlib.figure import Figure
from pages_api import PAGES, page_of

from buckler.mbs import laws
from buckler.mbs.declare import Declaration, declarations, known_kinds
from buckler.mbs.elements import KINDS
from buckler.mbs.view.movie import Movie
from buckler.mbs.view.plot import draw

MADE = "made"
"""Folder of these pages; it is not kept."""
ORDER = (
    "buckling_slider_crank", "six_bar_with_strip", "rattling_crank_rocker", "straight_line_linkage", "snapping_truss",
    "toggle_clamp", "gripper", "dwell_six_bar",
    "double_pendulum", "ringing_cantilever", "bouncing_block", "starting_motor", "braking_block", "net_of_strips",
    "uncertain_contact_force", "two_causes_told_apart", "fitted_recording", "bifurcation",
)  # fmt: skip
"""Scripts of the gallery."""


def write_pages(docs: Path) -> None:
    """Write all of them; a picture only where its script has changed."""
    folder = docs / MADE
    folder.mkdir(exist_ok=True)
    scripts = [docs / "gallery" / f"{name}.py" for name in ORDER]
    for script in scripts:
        _write(folder / f"{script.stem}.md", "\n".join(_example(script, folder)))
    _write(folder / "gallery.md", "\n".join(_gallery(scripts)))
    _write(folder / "elements.md", "\n".join(_elements()))
    for page in PAGES:
        _write(folder / f"api-{page.name}.md", "\n".join(page_of(page)) + "\n")


def _write(path: Path, text: str) -> None:
    """Leave a page alone that is as it should be, so that the site is built anew only where it must."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


# --- gallery ----------------------------------------------------------------------------------------------------------


def _head(script: Path) -> tuple[str, str, str]:
    """Title, what it is about, and the code of a script."""
    _, said, code = script.read_text(encoding="utf-8").split('"""', 2)
    title, _, about = said.partition("\n\n")
    return title.rstrip("."), " ".join(about.split()), code.strip()


def _example(script: Path, folder: Path) -> Iterator[str]:
    """Yield the page of a script; draw its animation, the picture of its card and a figure it leaves, if they are older."""
    title, about, code = _head(script)
    picture, card = folder / f"{script.stem}.gif", folder / f"{script.stem}.png"
    if not all(each.exists() and each.stat().st_mtime >= script.stat().st_mtime for each in (picture, card)):
        left = runpy.run_path(str(script))
        left["result"].animate(picture, seconds=5.0, width=560)
        still(left["result"].movie, card)
        if "picture" in left:
            left["picture"].savefig(folder / f"{script.stem}-figure.png", dpi=150)
    figures = [f"![{title}]({name})" for name in (picture.name, f"{script.stem}-figure.png") if (folder / name).exists()]
    yield from (f"# {title}", "", about, "", *figures, "", "```python", code, "```", "")


CARD = (72.0, 48.0)
"""Size of a card's picture, mm: all alike, and about as large as on the screen, so that names can be read."""


def still(movie: Movie, path: Path) -> None:
    """Draw the middle of a motion for a card; it stands still, and the page behind it moves."""
    figure = Figure(figsize=(CARD[0] / 25.4, CARD[1] / 25.4))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    draw(movie, len(movie.time) // 2, axes)
    axes.set_axis_off()
    figure.savefig(path, dpi=220)


def _gallery(scripts: list[Path]) -> Iterator[str]:
    """The page of all, and their order."""
    yield from (
        "# Gallery",
        "",
        "Mechanisms, each a short script that asserts one physical number. The tests run them all.",
        "",
    )
    yield "::::{grid} 1 2 2 3"
    yield ":gutter: 3"
    for script in scripts:
        title, about, _ = _head(script)
        yield from (
            "",
            f":::{{grid-item-card}} {title}",
            f":img-top: {script.stem}.png",
            f":link: {script.stem}",
            ":link-type: doc",
            "",
        )
        yield from (about.partition(". ")[0].rstrip(".") + ".", ":::")
    yield from ("::::", "", "```{toctree}", ":hidden:", "", *(script.stem for script in scripts), "```", "")


# --- elements ---------------------------------------------------------------------------------------------------------


def _elements() -> Iterator[str]:
    """Every kind that a file may name: its fields with unit, range, default and help."""
    yield "# Elements and laws, field by field"
    yield ""
    yield "Made from the declarations that the file reader, the JSON schema and the messages of wrong input are made from."
    kinds = list(known_kinds().values())
    groups = [(name, [kind for kind in kinds if issubclass(kind, base)]) for name, base in KINDS.items()]
    groups.append(("laws", [kind for kind in kinds if kind.__name__ in laws.__all__]))
    done = {kind for _, some in groups for kind in some}
    groups.append(("bodies and parts", [kind for kind in kinds if kind not in done]))
    for title, kinds in groups:
        yield from ("", f"## {title.capitalize()}", "")
        for kind in kinds:
            about = (kind.__doc__ or "").strip().partition("\n\n")[0]
            yield from (f"### {kind.__name__}", "", _plain(" ".join(about.split())), "")
            rows = list(declarations(kind).items())
            if rows:
                yield from ("| field | unit | range | default | |", "|---|---|---|---|---|", *(_row(*row) for row in rows), "")


def _row(name: str, field: Declaration) -> str:
    default = "" if field.required else f"`{field.default!r}`" if len(repr(field.default)) < 40 else "see the class"
    unit = "" if field.spec.unit == "1" else field.spec.unit
    allowed = ", ".join([field.spec.allowed, *(f"{sign} {other}" for sign, other in field.bounds.items())]).strip(", ")
    return f"| `{name}` | {_plain(unit)} | {_plain(allowed)} | {default} | {_plain(field.doc)} |"


def _plain(text: str) -> str:
    """Text in which nothing stands for markup of a table."""
    for sign in "\\|<>*_[]$":
        text = text.replace(sign, f"\\{sign}")
    return text
