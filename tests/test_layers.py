"""The one-way street: which package may import which, and where the engine may be named."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from buckler import elastica

ROOT = Path(__file__).parents[1]
ENGINE_ROOMS = ("mbs/engine/", "mbs/statics/")
"""Rooms of `mbs` in which the engine may be imported."""
WITHOUT_ENGINE = [
    "buckler.mbs",
    "buckler.mbs.mechanism",
    "buckler.mbs.elements",
    "buckler.mbs.laws",
    "buckler.mbs.scene.linkage",
    "buckler.mbs.record.result",
    "buckler.mbs.library",
    "buckler.mbs.documents.document",
    "buckler.mbs.schema",
    "buckler.studies.kit.statistics",
    "buckler.mbs.modal",
    "buckler.elastica",
    "buckler.elastica.law",
    "buckler.elastica.pinned",
    "buckler.elastica.rod",
    "buckler.studies.kit.registry",
]


def sources(package):
    return sorted((ROOT / package).rglob("*.py"))


def imported(path):
    """Top-level names of everything a file imports, wherever in the file; of Buckler's own, those below `buckler`."""

    def top(name):
        parts = name.split(".")
        return parts[1] if parts[0] == "buckler" and len(parts) > 1 else parts[0]

    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {top(alias.name) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            below = ["buckler", *path.relative_to(ROOT).parent.parts]
            base = below[: len(below) - node.level + 1] if node.level else []
            module = ".".join([*base, *filter(None, [node.module])])
            found |= {top(f"{module}.{alias.name}") for alias in node.names}
        elif isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "import_module":
            found |= {top(arg.value) for arg in node.args if isinstance(arg, ast.Constant)}
    return found


def loaded_after(statement):
    """Names of all modules in a fresh interpreter after a statement."""
    code = f"{statement}\nimport sys\nprint(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning", "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return set(run.stdout.split())


def test_description_of_machine_and_results_load_no_engine():
    loaded = loaded_after("import " + ", ".join(WITHOUT_ENGINE))
    assert set(WITHOUT_ENGINE) <= loaded
    assert not {name for name in loaded if name.split(".")[0] == "exudyn"}


@pytest.mark.parametrize("module", ["buckler.mbs", "buckler.elastica", "buckler.studies.kit.registry"])
def test_each_door_opens_alone(module):
    loaded = loaded_after(f"import {module}")
    assert module in loaded and "exudyn" not in loaded


def test_elastica_loads_neither_mbs_nor_matplotlib():
    loaded = loaded_after("import elastica, buckler.elastica.law, buckler.elastica.pinned, buckler.elastica.rod")
    assert not {name.split(".")[0] for name in loaded} & {"matplotlib", "meshio", "exudyn"}
    assert not [name for name in loaded if name.startswith(("buckler.mbs", "buckler.studies"))]


def test_what_needs_the_engine_loads_it_on_demand():
    assert "exudyn" not in loaded_after("from buckler.mbs import simulate")
    assert "exudyn" in loaded_after("from buckler.mbs import build")


def test_every_name_on_the_door_is_behind_it():
    from buckler import elastica, mbs

    for name in mbs.__all__:
        assert getattr(mbs, name).__module__.startswith("buckler.mbs.") or name == "STEEL"
    for name in elastica.__all__:
        assert getattr(elastica, name).__name__ == f"buckler.elastica.{name}"
    with pytest.raises(AttributeError, match="nonsense"):
        mbs.nonsense  # noqa: B018


@pytest.mark.parametrize(
    ("package", "banned"), [("elastica", {"mbs", "studies", "exudyn"}), ("mbs", {"studies"})], ids=["elastica", "mbs"]
)
def test_no_step_back_up_the_street(package, banned):
    files = sources(package)
    assert files
    offenders = {str(path.relative_to(ROOT)): imported(path) & banned for path in files}
    assert not {path: names for path, names in offenders.items() if names}


def test_imports_inside_a_package_are_relative():
    """So any tool that reads files can follow them: `buckler.mbs` is the folder `mbs` by a link."""
    for package in ("elastica", "mbs", "studies"):
        for path in sources(package):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                absolute = isinstance(node, ast.ImportFrom) and not node.level
                absolute = absolute and str(node.module).startswith(f"buckler.{package}")
                assert not absolute or path.name == "__main__.py", f"{path}:{node.lineno}"


def test_the_engine_is_named_only_in_its_rooms():
    users = {
        path.relative_to(ROOT).as_posix()
        for package in ("elastica", "mbs", "studies")
        for path in sources(package)
        if "exudyn" in imported(path)
    }
    plain = "studies/error_against_run_time/plain.py"  # what run times are held against, no part of Buckler
    assert not {path for path in users if not path.startswith(ENGINE_ROOMS)} - {plain}
    assert {"mbs/engine/scene.py", "mbs/engine/build.py"} <= users  # or the above checks nothing


def test_elastica_is_ours():
    """PyElastica installs a package of the same name."""
    assert Path(elastica.__file__).resolve().is_relative_to(ROOT.resolve())


def test_deprecation_is_fatal(pytestconfig):
    filters = pytestconfig.getini("filterwarnings")
    assert "error::DeprecationWarning" in filters

    import exudyn

    with pytest.raises(DeprecationWarning):
        exudyn.SimulationSettings().linearSolverType  # noqa: B018 - the old name of linearSolver.solverType
