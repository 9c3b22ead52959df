"""Numbers of stored results, docs/evidence/NAME.json, in the pages.

    python docs/tools/evidence.py               write the stored numbers into the pages
    python docs/tools/evidence.py --run NAME    run a study of docs/evidence/items.toml again, store its result, write the pages
    python docs/tools/evidence.py --check NAME  run it again and store nothing; exit 1 with the numbers that differ

A number stands between two comments that name study, metric and format; a table below a line `<!--= NAME table 0 -->`.

    <!--= slider-crank beam.impact_peak .3g -->156<!--/--> N

The format is that of Python, then `%` for per cent or `*1e3` for a factor. `metric@error`, `@exact` and `@published` belong to a
value, `work@wall_s` is the run time. `~` at the end marks what another machine need not repeat, such as a ratio of run times.
"""

import argparse
import json
import re
import shlex
import shutil
import sys
import tomllib
from math import hypot, isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from buckler.studies.kit.cli import main as buckler

DOCS = Path(__file__).resolve().parents[1]
ITEMS: dict[str, dict[str, Any]] = tomllib.loads((DOCS / "evidence" / "items.toml").read_text(encoding="utf-8"))
NUMBER = re.compile(r"<!--= (\S+) (\S+) (\S+) -->(.*?)<!--/-->", re.DOTALL)
FORMAT = re.compile(r"(\.\d+[efg])(%?)(?:\*([\d.e+-]+))?~?")


def pages() -> list[Path]:
    """List README, the pages of docs and the paper."""
    return [DOCS.parent / "README.md", *sorted(DOCS.glob("*.md")), DOCS / "paper" / "paper.md"]


def stored(study: str) -> dict[str, Any]:
    """Read the stored result of a study."""
    return json.loads((DOCS / "evidence" / f"{study}.json").read_text(encoding="utf-8"))


def read_format(form: str) -> tuple[str, float, str]:
    """Return digits, factor and unit of a format."""
    if not (found := FORMAT.fullmatch(form)):
        raise ValueError(f"format '{form}': must be like .3g, .2f% or .1f*1e3")
    return found[1], float(found[3] or 1) * (100 if found[2] else 1), " %" if found[2] else ""


def look_up(result: dict[str, Any], metric: str) -> tuple[float, float]:
    """Return the value of `metric`, `metric@error` or `work@name`, and the standard error that the study estimates."""
    name, _, part = metric.partition("@")
    found = {part: result["work"][part]} if name == "work" else result["metrics"][name]
    value = found[part or "value"]
    if value is None or not isfinite(value):
        raise LookupError(f"{metric} is not finite")
    return value, 0.0 if part or "exact" in found else abs(value) * (found.get("error") or 0.0)


def write_number(metric: str, form: str, result: dict[str, Any]) -> str:
    """Format a number or a table of a result as a page has it."""
    if metric == "table":
        table = result["tables"][int(form)]
        lines = ["| " + " | ".join(map(_cell, row)) + " |" for row in (table["headers"], *table["rows"])]
        return "\n".join(["", lines[0], "|---" * len(table["headers"]) + "|", *lines[1:], ""])
    digits, factor, unit = read_format(form)
    return _plain(f"{factor * look_up(result, metric)[0]:{digits}}") + unit


def _cell(value: object) -> str:
    return _plain(f"{value:.4g}") if isinstance(value, float) else "" if value is None else str(value)


def _plain(text: str) -> str:
    return re.sub(r"e([+-])0*(\d)", lambda found: f"e{found[1].strip('+')}{found[2]}", re.sub("^-", "−", text))


def fill(text: str) -> str:
    """Write the stored numbers into the text of a page; a ValueError names the first that is wrong."""

    def renew(found: re.Match[str]) -> str:
        study, metric, form, _ = found.groups()
        try:
            return f"<!--= {study} {metric} {form} -->{write_number(metric, form, stored(study))}<!--/-->"
        except (LookupError, ValueError, OSError) as error:
            raise ValueError(f"{study} {metric} {form}: {type(error).__name__}: {error}") from None

    if wrong := re.search(r"^<!--= \S+ (?!table )\S+", text, re.MULTILINE):
        raise ValueError(f"{wrong[0]}: a number may not begin a line, as Markdown takes all of that line for a comment")
    return NUMBER.sub(renew, text)


def agree(metric: str, form: str, text: str, old: dict[str, Any], new: dict[str, Any]) -> bool:
    """Compare a number or table in a page with a new result: half a unit of its last digit and two standard errors."""
    if metric == "table":
        cells = [[cell for row in result["tables"][int(form)]["rows"] for cell in row] for result in (old, new)]
        return all(_cells_agree(was, now) for was, now in zip(*cells, strict=True))
    (was, error), (now, new_error) = look_up(old, metric), look_up(new, metric)
    mantissa, _, power = text.removesuffix(" %").partition("e")
    half_unit = 0.5 * 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2])) / read_format(form)[1]
    return abs(now - was) <= half_unit + 2 * hypot(error, new_error)


def _cells_agree(was: object, now: object) -> bool:
    """Compare cells: equal, or within two standard errors of the difference where they are `a ± e`."""
    cells = [re.fullmatch(r"(-?[\d.]+) ± ([\d.]+)\D*", str(cell)) for cell in (was, now)]
    values = [(float(cell[1]), float(cell[2])) for cell in cells if cell]
    return was == now if len(values) < 2 else abs(values[0][0] - values[1][0]) <= 2 * hypot(values[0][1], values[1][1])


def rerun(study: str, store: bool) -> list[str]:
    """Run a study with the options of its item; store result and pictures, or list what differs from the stored ones."""
    run, item, old = ITEMS[study].get("study", study), ITEMS[study], {} if store else stored(study)
    with TemporaryDirectory() as out:
        if buckler(argv=["run", run, *shlex.split(item.get("options", "")), "--quiet", "--out", out]) not in (0, 1):
            return [f"{study}: does not run; see its options in docs/evidence/items.toml"]
        new = json.loads((Path(out) / run / "metrics.json").read_text(encoding="utf-8"))
        if store:
            kept = {key: value for key, value in new.items() if key not in {"files", *item.get("without", ())}}
            text = json.dumps(kept, indent=2, ensure_ascii=False)
            (DOCS / "evidence" / f"{study}.json").write_text(f"{text}\n", encoding="utf-8")
            for figure, picture in item.get("figures", {}).items():
                shutil.copy(Path(out) / run / f"{figure}.png", DOCS / "figures" / f"{picture}.png")
            return []
    wrong = [] if new["status"] == old["status"] else [f"{study}: {new['status']}, was {old['status']}: {new['message']}"]
    for name, metric, form, text in (found for path in pages() for found in NUMBER.findall(path.read_text(encoding="utf-8"))):
        timed = metric.startswith("work@") or form.endswith("~")
        if name == study and not timed and not agree(metric, form, text, old, new):
            wrong.append(f"{study} {metric} {form}: a page has {text}, a new run {write_number(metric, form, new)}")
    return wrong


def main(argv: list[str] | None = None) -> int:
    """Write the pages, or run studies again."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", action="store_true", help="run again and store")
    parser.add_argument("--check", action="store_true", help="run again and compare")
    parser.add_argument("names", metavar="NAME", nargs="*", help="studies to run; default all of docs/evidence/items.toml")
    options = parser.parse_args(argv)
    again = (options.names or ITEMS) if options.run or options.check else ()
    wrong = [line for name in again for line in rerun(name, store=options.run)]
    print("\n".join(wrong), end="\n" if wrong else "")
    for path in () if options.check else pages():
        path.write_text(fill(path.read_text(encoding="utf-8")), encoding="utf-8")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
