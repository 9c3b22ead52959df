"""The one-way street: which package may import which, and where the engine may be named."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from imported import ROOT, imports, sources

from buckler import elastica, mbs

PACKAGES = ("elastica", "mbs", "studies")
ENGINE_ROOMS = ("mbs/engine/", "mbs/statics/")
"""Rooms of `mbs` in which the engine may be imported."""
WITHOUT_ENGINE = "mbs mbs.laws mbs.library mbs.modal mbs.schema mbs.record.result studies.kit.registry studies.kit.statistics"
"""Modules, below `buckler`, with which all that describes mechanisms and results is loaded."""


def loaded_after(statement):
    """Names of all modules in a fresh interpreter after a statement."""
    code = f"{statement}\nimport sys\nprint(*sys.modules)"
    command = [sys.executable, "-W", "error::DeprecationWarning", "-c", code]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_description_of_machine_and_results_load_no_engine():
    names = [f"buckler.{name}" for name in WITHOUT_ENGINE.split()]
    loaded = loaded_after(f"from buckler.mbs import simulate\nimport {', '.join(names)}")
    assert loaded.issuperset(names) and "exudyn" not in loaded
    assert "exudyn" in loaded_after("from buckler.mbs import build")  # what needs it loads it on demand


def test_elastica_loads_neither_mbs_nor_matplotlib():
    loaded = loaded_after("import elastica, buckler.elastica.law, buckler.elastica.pinned, buckler.elastica.rod")
    assert not {name.split(".")[0] for name in loaded} & {"matplotlib", "meshio", "exudyn"}
    assert not [name for name in loaded if name.startswith(("buckler.mbs", "buckler.studies"))]


def test_every_name_on_the_door_is_behind_it():
    for name in mbs.__all__:
        assert getattr(mbs, name).__module__.startswith("buckler.mbs.") or name == "STEEL"
    for name in elastica.__all__:
        assert getattr(elastica, name).__name__ == f"buckler.elastica.{name}"
    with pytest.raises(AttributeError, match="nonsense"):
        mbs.nonsense  # noqa: B018


def tops(path):
    """Packages from which a file imports; of Buckler's own the name below `buckler`."""
    return {name.removeprefix("buckler.").partition(".")[0] for name in imports(path)}


@pytest.mark.parametrize(("package", "banned"), [("elastica", {"mbs", "studies", "exudyn"}), ("mbs", {"studies"})])
def test_no_step_back_up_the_street(package, banned):
    assert sources(package) and not {path for path in sources(package) if tops(path) & banned}


def test_imports_inside_a_package_are_relative():
    """So any tool that reads files can follow them: `buckler.mbs` is the folder `mbs` by a link."""
    for package in PACKAGES:
        absolute = re.compile(rf"^ *from buckler\.{package}\b", re.MULTILINE)
        found = [path for path in sources(package) if absolute.search(path.read_text(encoding="utf-8"))]
        assert [path for path in found if path.name != "__main__.py"] == []


def test_the_engine_is_named_only_in_its_rooms():
    files = [path for package in PACKAGES for path in sources(package) if "exudyn" in tops(path)]
    users = {path.relative_to(ROOT).as_posix() for path in files}
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
