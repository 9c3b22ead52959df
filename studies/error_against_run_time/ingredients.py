"""Contents of the scene of a work: objects, unknowns, kernels compiled, modules loaded; nothing that it does not need.

It runs once in a process of its own, `python -m buckler.studies.error_against_run_time.ingredients WORK SOLVER`, so that only
what it asks for itself is loaded.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from typing import ClassVar

from buckler import mbs

from .works import WORKS

PACKAGES = ("exudyn", "numba", "matplotlib", "meshio", "skfem", "tabulate")
"""Packages that a scene should load only if it needs them."""
ROOMS = ("engine", "spectral", "modal", "statics", "sensitivity")
"""Folders of `buckler.mbs` that a scene should load only if it needs them."""
DESCRIBING = {"buckler.mbs.modal.planar"}
"""Modules of these that a description of any mechanism loads."""
SHARE = 0.01
"""Part of a work's duration that is run."""
COUNTED = ("coordinates", "constraints", "objects", "nodes", "loads", "sensors", "forces")
"""Entries of a scene's summary that are sums, not kinds of objects."""
LIMIT = 600.0
"""Longest time of a scene's process [s]: its first run compiles."""


@dataclass(frozen=True)
class Ingredients:
    """Counts of one scene and its run.

    Attributes
    ----------
    status : of the run
    objects : kinds of objects and how many of each
    unknowns : coordinates and multipliers of constraints
    kernels : compiled functions that were called from Python
    packages : of other authors, of `PACKAGES`
    rooms : folders of `buckler.mbs`, of `ROOMS`
    """

    status: str
    objects: dict[str, int]
    unknowns: int
    kernels: list[str]
    packages: list[str]
    rooms: list[str]

    HEADERS: ClassVar[tuple[str, ...]] = ("objects", "unknowns", "kernels", "packages", "folders of mbs")

    def row(self) -> list[object]:
        """List them in the order of `HEADERS`."""
        objects = ", ".join(f"{count} {kind}" for kind, count in self.objects.items())
        return [objects, self.unknowns, *(", ".join(names) for names in (self.kernels, self.packages, self.rooms))]


def ingredients(work: str, solver: str) -> Ingredients:
    """Run a short part of a work by a solver in a new process, and list what its scene contains.

    Raises
    ------
    RuntimeError
        If that process fails; the end of what it wrote.
    """
    command = [sys.executable, "-m", __name__, work, solver]
    run = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False)
    if run.returncode:
        raise RuntimeError(f"{work} by {solver}: {run.stderr.strip()[-400:]}")
    return Ingredients(**json.loads(run.stdout.splitlines()[-1]))


def _here(mechanism: mbs.Mechanism, duration: float, solver: str) -> Ingredients:
    if solver == "Spectral":
        from buckler.mbs.spectral.scene import CompiledScene  # a run of the engine does not load it

        summary = CompiledScene.of(mechanism).summary()
    else:
        summary = mbs.build(mechanism).summary()
    result = mbs.simulate(mechanism, duration, solver=mbs.Spectral() if solver == "Spectral" else mbs.Exudyn())
    return Ingredients(
        str(result.status),
        {kind: count for kind, count in summary.items() if kind not in COUNTED},
        summary["coordinates"] + summary["constraints"],
        _kernels(),
        [package for package in PACKAGES if package in sys.modules],
        [room for room in ROOMS if any(name.startswith(f"buckler.mbs.{room}.") for name in sys.modules.keys() - DESCRIBING)],
    )


def _kernels() -> list[str]:
    found = set()
    for module in [each for name, each in sys.modules.items() if name.startswith("buckler.mbs.")]:
        for each in vars(module).values():
            own = getattr(each, "py_func", None)
            if own is not None and each.signatures and not each.targetoptions.get("no_cpython_wrapper"):
                found.add(own.__name__)
    return sorted(found)


if __name__ == "__main__":
    motion = WORKS[sys.argv[1]]().motion
    assert motion is not None
    print(json.dumps(asdict(_here(motion.mechanism, SHARE * motion.duration, sys.argv[2]))))
