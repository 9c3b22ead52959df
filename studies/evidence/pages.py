"""Numbers that pages quote: each stands between two comments that name where it comes from, and is written from its file.

    <!--= slider-crank beam.impact_peak .3g -->156<!--/--> N

names the item, its metric and the form: digits, with `%` as per cent, with `*1e3` scaled, with `±` to the digits of its error.
`metric@error`, `@exact` and `@published` name what stands beside a value, `work@name` what a run took. A form that ends with
`~` is of a time, of a ratio of times, or of what hangs on how a processor rounds: no new run need repeat it. A line of its own

    <!--= buffering-world table 0 -->

stands above a table that is written whole, up to the line of the second comment. `python -m buckler.studies.evidence.pages`
writes all of them; a test refuses a page that differs.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from math import floor, isfinite, log10
from pathlib import Path
from typing import Any, NamedTuple

from .items import ROOT, stored

Files = Callable[[str], Mapping[str, Any]]
QUOTED = re.compile(r"<!--= (\S+) (\S+) (\S+) -->(.*?)<!--/-->", re.DOTALL)
FORM = re.compile(r"(\.\d+[efg]|±)(%?)(?:\*([\d.e+-]+))?~?")


def pages() -> list[Path]:
    """README, the pages of docs/, and the paper."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "docs" / "paper" / "paper.md"]


class Quoted(NamedTuple):
    """A number or table of a page.

    Attributes
    ----------
    item, what, form, text : its item, metric and form, and what stands in the page
    """

    item: str
    what: str
    form: str
    text: str

    def __str__(self) -> str:
        return f"{self.item} {self.what}"


def quoted(text: str) -> Iterator[Quoted]:
    """Every number and table that a page quotes."""
    yield from (Quoted(*found.groups()) for found in QUOTED.finditer(text))


def looked_up(content: Mapping[str, Any], what: str) -> float:
    """Value of a metric, or of what stands beside it, in the content of an item's file.

    Raises
    ------
    LookupError
        If the file has none.
    """
    name, _, beside = what.partition("@")
    found = content["work"][beside] if name == "work" else content["metrics"][name].get(beside or "value")
    if found is None or not isfinite(found):
        raise LookupError(what)
    return float(found)


def written(number: Quoted, files: Files = stored) -> str:
    """A number or table as its file has it.

    Raises
    ------
    LookupError
        If the file has no such number.
    """
    content = files(number.item)
    if number.what == "table":
        return _markdown(content["tables"][int(number.form)])
    value = looked_up(content, number.what)
    digits, percent, scale = _form(number.form)
    factor = float(scale or 1) * (100 if percent else 1)
    if digits == "±":
        return _with_error(factor * value, abs(factor * value) * content["metrics"][number.what]["error"])
    return _plain(format(factor * value, digits)) + (" %" if percent else "")


def rounding(number: Quoted) -> float:
    """Half a unit of the last digit that stands in a page, in the unit of the metric."""
    _, percent, scale = _form(number.form)
    mantissa, _, power = number.text.partition(" ±")[0].removesuffix(" %").partition("e")
    places = len(mantissa.partition(".")[2])
    return 0.5 * 10.0 ** (int(power or 0) - places) / (float(scale or 1) * (100 if percent else 1))


def filled(text: str, files: Files = stored) -> str:
    """A page with every number as its file has it."""

    def written_again(found: re.Match[str]) -> str:
        number = Quoted(*found.groups())
        return f"<!--= {number} {number.form} -->{written(number, files)}<!--/-->"

    return QUOTED.sub(written_again, text)


def stale(path: Path, files: Files = stored) -> list[str]:
    """Numbers of a page that its files have otherwise, a line each."""
    text = path.read_text(encoding="utf-8")
    lines = re.findall(r"^<!--= \S+ (?!table )\S+", text, re.MULTILINE)  # Markdown takes the whole line for a comment
    wrong = [f"{path.name}: {line.removeprefix('<!--= ')}: may not begin a line" for line in lines]
    for number in quoted(text):
        try:
            now = written(number, files)
        except (LookupError, ValueError) as error:
            wrong.append(f"{path.name}: {number}: its file has none ({error})")
            continue
        if now != number.text:
            wrong.append(f"{path.name}: {number}: the page has {number.text[:60]!r}, its file {now[:60]!r}")
    return wrong


def fill() -> None:
    """Write all pages."""
    for path in pages():
        text = path.read_text(encoding="utf-8")
        new = filled(text)
        if new != text:
            path.write_text(new, encoding="utf-8")


def _form(form: str) -> tuple[str, str, str]:
    found = FORM.fullmatch(form)
    if not found:
        raise ValueError(f"form = '{form}': must be like .3g, .2f%, .1f*1e3 or ±")
    return found[1], found[2], found[3] or ""


def _plain(text: str) -> str:
    """Digits as pages have them: 2.1e-5 without a zero in front of its power, a true minus."""
    text = re.sub(r"e([+-])0*(\d)", lambda found: f"e{found[1].strip('+')}{found[2]}", text)
    return f"−{text[1:]}" if text.startswith("-") else text


def _with_error(value: float, error: float) -> str:
    """A value and its error, to one digit of the error, two if that is a 1."""
    place = -floor(log10(error)) + (f"{error:e}"[0] == "1")
    return _plain(f"{value:.{max(0, place)}f}") + f" ± {error:.{max(0, place)}f}"


def _markdown(table: Mapping[str, Any]) -> str:
    """A stored table as Markdown, between line breaks."""
    rows = [[_cell(each) for each in row] for row in (table["headers"], *table["rows"])]
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n" + "\n".join([lines[0], "|---" * len(rows[0]) + "|", *lines[1:]]) + "\n"


def _cell(value: object) -> str:
    return _plain(f"{value:.4g}") if isinstance(value, float) else "" if value is None else str(value)


if __name__ == "__main__":
    fill()
