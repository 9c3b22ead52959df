"""Solve every problem with a known answer, and write the tables of docs/validation.md.

    python tests/validation

`--only QUESTION` solves the problems of one question; `--quick` leaves out the slow ones and prints the tables only.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from pathlib import Path
from time import process_time

HERE = Path(__file__).resolve().parent
sys.path[0] = str(HERE.parent)

from buckler.studies.kit.versions import versions  # noqa: E402
from validation.known import Solved, solve, tabulate  # noqa: E402
from validation.questions import QUESTIONS, list_known  # noqa: E402

PAGE = HERE.parents[1] / "docs" / "validation.md"


def write(page: str, question: str, lines: list[str]) -> str:
    """Write lines between the two comments of a question in the page."""
    begin, end = f"<!-- answers: {question} -->", "<!-- /answers -->"
    found = re.sub(f"{re.escape(begin)}.*?{re.escape(end)}", lambda _: "\n".join([begin, *lines, end]), page, flags=re.S)
    if begin not in page:
        raise ValueError(f"{PAGE.name}: has no '{begin}'")
    return found


def main() -> int:
    """Solve, print and write; return 1 if a verdict is neither accepted nor expected, else 0."""
    parser = argparse.ArgumentParser(prog="python tests/validation", description=__doc__)
    parser.add_argument("--only", choices=tuple(QUESTIONS), help="question whose problems are solved")
    parser.add_argument("--quick", action="store_true", help="leave out slow problems; print only")
    options, begin, wrong, tables = parser.parse_args(), process_time(), list[str](), dict[str, list[str]]()
    for question, title in QUESTIONS.items():
        if options.only in (None, question):
            print(f"\n{title}", flush=True)
            solved = list[Solved]()
            for known in list_known(question):
                if known.slow and options.quick:
                    continue
                solved.append(solve(known))
                verdict = solved[-1].answer.verdict
                if verdict not in known.accepted and verdict != known.still:
                    wrong.append(f"{question}: {known.group}: {known.name}: {verdict} {solved[-1].answer.message}")
            tables[question] = tabulate(solved)
            print("\n".join(tables[question]), flush=True)
    spent = process_time() - begin
    print(*wrong, f"\n{spent:.0f} s; not accepted: {len(wrong)}", sep="\n")
    if not options.quick:
        used = ", ".join(f"{name} {version}" for name, version in versions().items())
        if options.only is None:
            tables["machine"] = [f"{spent / 60:.0f} minutes of processor time, {os.cpu_count()} processors; {used}."]
        page = PAGE.read_text(encoding="utf-8")
        for question, lines in tables.items():
            page = write(page, question, lines)
        PAGE.write_text(page, encoding="utf-8")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
