"""Ingredients of a run of a benchmark (`work.Work`): objects and unknowns of its scene, compiled kernels, loaded modules.

They show that a run has nothing that it does not need. The run is made in a new process, by `python -m
buckler.studies.error_against_run_time.ingredients WORK SOLVER`, so that only this run has loaded modules there.
"""

import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from typing import ClassVar

from buckler import mbs

from .works import WORKS


@dataclass(frozen=True)
class Ingredients:
    """Ingredients of a run and its scene."""

    status: str
    objects: dict[str, int]  # number of objects by kind
    unknowns: int  # number of coordinates and multipliers
    kernels: list[str]  # compiled functions
    # loaded packages and folders of `buckler.mbs`, of those that a run should load only if it needs them
    packages: list[str]
    folders: list[str]

    HEADERS: ClassVar[tuple[str, ...]] = ("objects", "unknowns", "kernels", "packages", "folders of mbs")

    def row(self) -> list[object]:
        """Return the row of a table with the `HEADERS`."""
        objects = ", ".join(f"{count} {kind}" for kind, count in self.objects.items())
        return [objects, self.unknowns, *(", ".join(names) for names in (self.kernels, self.packages, self.folders))]


def ingredients(work: str, solver: str) -> Ingredients:
    """Run a short part of a work by a solver in a new process; a RuntimeError has the last output of a process that fails."""
    command = [sys.executable, "-m", __name__, work, solver]
    run = subprocess.run(command, capture_output=True, text=True, timeout=600.0, check=False)  # [s]; it may compile the solver
    if run.returncode:
        raise RuntimeError(f"{work} by {solver}: {run.stderr.strip()[-400:]}")
    return Ingredients(**json.loads(run.stdout.splitlines()[-1]))


def _find_ingredients(mechanism: mbs.Mechanism, duration: float, solver: str) -> Ingredients:
    """Run a mechanism in this process, and return the ingredients."""
    result = mbs.simulate(mechanism, duration, solver=mbs.Spectral() if solver == "Spectral" else mbs.Exudyn())
    scene = result.provenance["scene"]  # elements of each class, 1 for "gravity" if there is any, totals such as `coordinates`
    objects = {kind: n for kind, n in scene.items() if kind[0].isupper() or kind == "gravity"}  # totals begin with a small letter
    packages = ("exudyn", "numba", "matplotlib", "meshio", "skfem", "tabulate")
    folders = ("engine", "spectral", "modal", "statics", "sensitivity")
    loaded = sys.modules.keys() - {"buckler.mbs.modal.planar"}  # which every description of a mechanism loads
    return Ingredients(
        status=str(result.status), objects=objects, unknowns=scene["coordinates"] + scene["constraints"], kernels=_find_kernels(),
        packages=[package for package in packages if package in loaded],
        folders=[folder for folder in folders if any(name.startswith(f"buckler.mbs.{folder}.") for name in loaded)],
    )  # fmt: skip


def _find_kernels() -> list[str]:
    """Find the functions of Buckler that Numba has compiled, except those that Python cannot call."""
    found = set()
    for module in [each for name, each in sys.modules.items() if name.startswith("buckler.mbs.")]:
        for each in vars(module).values():
            has_compiled = hasattr(each, "py_func") and each.signatures
            if has_compiled and not each.targetoptions.get("no_cpython_wrapper"):  # else only compiled functions call it
                found.add(each.py_func.__name__)
    return sorted(found)


if __name__ == "__main__":
    motion = WORKS[sys.argv[1]]().motion
    assert motion is not None  # the study asks for no ingredients of statics
    duration = 0.01 * motion.duration  # to save time: what only the rest would load or compile is not listed
    print(json.dumps(asdict(_find_ingredients(motion.mechanism, duration, sys.argv[2]))))
