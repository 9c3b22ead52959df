"""Do the tests see a fault? `python tests/mutations callers FOLDERS`, then `python tests/mutations draw` or `signs`.

Faults are planted in a throw-away copy of the tree, one at a time. The tests that call what was changed are run, the quickest
first, until one fails. A fault that none of them sees is printed.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import time
from collections.abc import Callable, Iterable
from functools import lru_cache
from pathlib import Path

from faults import Fault, faults
from planting import OUT_OF_TIME, ROOT, Tree, copied
from signs import COMPILED, MIRRORS, PLAIN, SPECTRAL

CALLERS = ROOT / "build" / "callers.json"
ROOMS = ("checks", "accuracy", "laws", "elements")
LIMIT = 20.0
"""Time of the tests that a fault is shown, s, as measured when the callers were; quicker ones first."""


def callers(folders: list[str]) -> None:
    """Run tests, and keep which of them calls what."""
    CALLERS.parent.mkdir(exist_ok=True)
    with copied() as tree:
        os.environ["CALLERS"] = str(CALLERS)
        for folder in folders:
            print(folder, tree.seen([folder], 1200.0, "-p", "mutations.callers"), flush=True)


@lru_cache
def users(name: str) -> frozenset[str]:
    """Functions of `mbs` that use a name, as 'file function'."""
    found = set()
    for path in sorted((ROOT / "mbs").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if name not in text:
            continue
        scopes = [("", ast.parse(text))]
        while scopes:
            prefix, scope = scopes.pop()
            for node in scope.body:  # type: ignore[attr-defined]
                if isinstance(node, ast.ClassDef):
                    scopes.append((f"{prefix}{node.name}.", node))  # type: ignore[arg-type]
                elif isinstance(node, ast.FunctionDef):
                    said = {n.id if isinstance(n, ast.Name) else getattr(n, "attr", "") for n in ast.walk(node)}
                    if name in said:
                        found.add(f"{path.relative_to(ROOT)} {prefix}{node.name}")
    return frozenset(found)


def tests_for(known: dict[str, dict[str, object]], file: str, owner: str, names: Iterable[str] = ()) -> list[str]:
    """Tests that call a function, or functions that use a name; those of the whole file if there is none; quick ones first."""
    wanted = {f"{file} {owner}"} if owner else {user for name in names for user in users(name)}
    found = [test for test, row in known.items() if wanted & set(row["calls"])]  # type: ignore[call-overload]
    if not found:
        found = [test for test, row in known.items() if any(c.startswith(f"{file} ") for c in row["calls"])]  # type: ignore[attr-defined]
    room = f"tests/{Path(file).parent.name}/"
    if not any(test.startswith(room) for test in known):
        return mirrored(file)
    found.sort(key=lambda test: (float(known[test]["time"]) > 2.0, not test.startswith(room), known[test]["time"]))  # type: ignore[arg-type]
    chosen, total = [], 0.0
    for test in found:
        total += 0.02 + float(known[test]["time"])  # type: ignore[arg-type]
        if total > LIMIT:
            break
        chosen.append(test)
    return chosen


def mirrored(file: str) -> list[str]:
    """Tests that mirror a file of a solver by their names."""
    room, name = Path(file).parent.name, Path(file).stem
    if room == "engine":
        return [f"tests/engine/test_{each}.py" for each in MIRRORS.get(name, "").split()]
    quick = ("virtual_work", "particles", "spectral_kernel", "spectral_runs", "energy", "two_solvers")
    found = [f"tests/spectral/test_{each}.py" for each in quick] if room == "spectral" else []
    return [*found, "tests/statics/test_statics_truths.py"] if found else []


def seen(tree: Tree, fault: Fault, tests: list[str]) -> str:
    """The first test that fails with a fault planted; '' if none does."""
    with tree.planted(fault.file, fault.plant((tree.root / fault.file).read_bytes())):
        return tree.seen(tests, 60 + 5 * LIMIT) if tests else ""


def drawn(rooms: Iterable[str], count: int, seed: int) -> list[Fault]:
    """Faults drawn by a seed: as many in each room, of any kind of fault alike."""
    chosen = []
    for i, room in enumerate(rooms):
        dice = random.Random(f"{seed} {room}")
        files = sorted((ROOT / "mbs" / room).glob("*.py"))
        kinds: dict[str, list[Fault]] = {}
        for fault in (fault for path in files for fault in faults(ROOT, path)):
            kinds.setdefault(fault.kind, []).append(fault)
        for each in kinds.values():
            dice.shuffle(each)
        turns = sorted(kinds)
        share = count // len(ROOMS) + (i < count % len(ROOMS))
        while share > 0 and any(kinds.values()):
            for kind in turns:
                if kinds[kind] and share > 0:
                    chosen.append(kinds[kind].pop())
                    share -= 1
    return chosen


def told(fault: str, found: str, tests: int, begin: float) -> str:
    """A line about a fault: the test that fails, or how many do not; OPEN if time ran out."""
    verdict = "OPEN  " if found == OUT_OF_TIME else "seen  " if found else "MISSED"
    return f"{verdict} {fault}   [{found or f'{tests} tests'}, {time.monotonic() - begin:.0f} s]"


def show(faulty: list[Fault], log: Callable[[str], None]) -> None:
    """Plant each and print whether it is seen; the share at the end."""
    known = json.loads(CALLERS.read_text())
    missed = 0
    with copied() as tree:
        for fault in faulty:
            begin = time.monotonic()
            tests = tests_for(known, fault.file, fault.owner, fault.names)
            found = seen(tree, fault, tests)
            missed += found in ("", OUT_OF_TIME)
            log(told(str(fault), found, len(tests), begin))
    log(f"{len(faulty) - missed} of {len(faulty)} seen")


def turned(kind: str, file: str, before: str, after: str) -> Fault:
    """A row of the table of signs as a fault."""
    text = (ROOT / file).read_bytes()
    if text.count(before.encode()) != 1:
        raise ValueError(f"{kind}: {before!r} stands {text.count(before.encode())} times in {file}")
    start = text.index(before.encode())
    line, owner = text.count(b"\n", 0, start) + 1, ""
    for top in ast.parse(text).body:
        for node in top.body if isinstance(top, ast.ClassDef) else [top]:
            if isinstance(node, ast.FunctionDef) and node.lineno <= line <= (node.end_lineno or 0):
                owner = f"{top.name}.{node.name}" if isinstance(top, ast.ClassDef) else node.name
    return Fault(file, line, owner, (), kind, before, after, start, start + len(before.encode()))


IMPORT = "from buckler.mbs.spectral.compiling import flip"
FLIP = '''

def sign(s, number):
    """-1 if the number is that of the fault that is awake, else 1."""
    return -1.0 if s.data[s.data.size - 1] == number else 1.0


@__import__("numba").extending.overload(sign)
def _sign(s, number):
    if "data" in s.fields:
        return lambda s, number: -1.0 if s.data[s.data.size - 1] == number else 1.0
    return lambda s, number: 1.0  # laws as Exudyn's joints have them


@__import__("numba").njit
def flip(s, number):
    """-1 if the number is that of the fault that is awake, else 1."""
    return sign(s, number)
'''
ASLEEP = [f"tests/spectral/test_{name}.py" for name in ("spectral_runs", "particles", "two_solvers", "energy", "virtual_work")]


def plant_compiled(tree: Tree) -> None:
    """Plant all signs of compiled functions; the last number of the solver's data says which one is awake."""
    folder = tree.root / SPECTRAL
    texts = {name: (folder / name).read_text() for name in ("compiling.py", "builder.py", *{row[2] for row in COMPILED})}
    for number, (_, _, name, planted) in enumerate(COMPILED, 1):
        texts[name] = texts[name].replace(planted.replace("FLIP * ", ""), planted.replace("FLIP", f"flip(s, {number})"))
    for name in texts.keys() - {"compiling.py", "builder.py"}:
        texts[name] = texts[name].replace(
            "import numpy as np\n", "import numpy as np\nfrom buckler.mbs.spectral.compiling import flip\n", 1
        )
    texts["compiling.py"] += FLIP
    awake = 'data=np.array([*self.data, float(__import__("os").environ.get("AWAKE", "0"))]'
    texts["builder.py"] = texts["builder.py"].replace("data=np.array(self.data", awake)
    for name, text in texts.items():
        (folder / name).write_text(text)


def show_signs(kinds: list[str], rooms: list[str], solvers: bool, log: Callable[[str], None]) -> None:
    """Turn each sign and print whether a test sees it, or with `solvers` whether the comparison of two solvers does."""
    known = json.loads(CALLERS.read_text())
    rows = [(kind, turned(kind, *row), "") for kind, *row in PLAIN]
    rows += [(row[0], None, f"{row[2]}: {row[3]}") for row in COMPILED]  # type: ignore[list-item]
    missed = total = 0
    with copied() as tree:
        if "compiled" in rooms:
            plant_compiled(tree)
            os.environ["AWAKE"] = "0"
            log(f"compiled: {tree.seen(ASLEEP, 1800.0) or 'well'}")
        for number, (kind, fault, words) in enumerate(rows, 1 - len(PLAIN)):
            room = "compiled" if fault is None else Path(fault.file).parent.name
            if room not in rooms or (kinds and kind not in kinds):
                continue
            os.environ["AWAKE"] = str(max(number, 0))
            begin = time.monotonic()
            if solvers:
                tests = ["tests/mutations/verdict.py"]
                os.environ["KIND"] = kind
            elif fault is not None:
                tests = tests_for(known, fault.file, fault.owner)
            else:
                file, _, owner = COMPILED[number - 1][1].partition(" ")
                tests = tests_for(known, f"{SPECTRAL}/{file}", owner)
            found = seen(tree, fault, tests) if fault is not None else tree.seen(tests, 60 + 5 * LIMIT) if tests else ""
            total, missed = total + 1, missed + (found in ("", OUT_OF_TIME))
            log(told(f"{kind}: {fault or words}", found, len(tests), begin))
    log(f"{total - missed} of {total} seen")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python tests/mutations", description=__doc__)
    commands = parser.add_subparsers(required=True, dest="command")
    commands.add_parser("callers", help="run tests and keep which calls what").add_argument("folders", nargs="+")
    draw = commands.add_parser("draw", help="faults drawn from checks, accuracy, laws and elements")
    draw.add_argument("--count", type=int, default=200)
    draw.add_argument("--seed", type=int, default=0)
    draw.add_argument("--rooms", nargs="+", default=ROOMS)
    draw.add_argument("--skip", type=int, default=0, help="faults to leave out at the start")
    signs = commands.add_parser("signs", help="one sign of each kind, in each room that knows it")
    signs.add_argument("--kinds", nargs="+", default=[])
    signs.add_argument("--rooms", nargs="+", default=["elements", "engine", "spectral", "compiled"])
    signs.add_argument("--solvers", action="store_true", help="ask the comparison of two solvers instead of the tests")
    given = parser.parse_args()
    if given.command == "callers":
        callers(given.folders)
    elif given.command == "signs":
        show_signs(given.kinds, given.rooms, given.solvers, lambda line: print(line, flush=True))
    else:
        show(drawn(given.rooms, given.count, given.seed)[given.skip :], lambda line: print(line, flush=True))


if __name__ == "__main__":
    main()
