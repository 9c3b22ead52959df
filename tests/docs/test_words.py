"""Docstrings begin with a verb or a noun and functions are verbs, in the folders named here; see CONTRIBUTING, "How to write"."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CLEAN = ["elastica", "mbs", "studies"]
"""Folders whose files keep to it."""
PUBLIC = set(
    "allowed damped declared delivered failed finished known measured reduced settled stored undetermined unresolved".split()
)
"""Public names, which stay."""
FIRST = r"What|Of|How|Whether|Whose|That|Those|Where|Which|As|By|From|To|In|At|With|So"
NOUN_OR_VERB = {"embed", "exceed", "feed", "need", "proceed", "seed", "speed"}
PARTICIPLE = (
    r"_?([a-z]+ed|told|held|left|lent|met|taken|made|drawn|known|shown|seen|given|found|built|kept|sought|laid|spoken|bent|spent|"
    r"meant|said|chosen|written|fallen|grown|broken|driven|hidden|struck|felt|begun|put)"
)


def faults(source):
    """List the docstrings and names in a source that a reader would stumble over."""
    tree = ast.parse(source)
    texts = [node.value.value for node in ast.walk(tree) if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)]
    found = [text.splitlines()[0] for text in texts if isinstance(text, str) and re.match(rf"\s*({FIRST})\b", text)]
    names = [node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return found + [name for name in names if re.fullmatch(PARTICIPLE, name) and name.strip("_") not in PUBLIC | NOUN_OR_VERB]


@pytest.mark.parametrize("folder", CLEAN)
def test_a_reader_understands_first_lines_and_names(folder):
    files = sorted((ROOT / folder).rglob("*.py"))
    assert files and not {str(file): wrong for file in files if (wrong := faults(file.read_text(encoding="utf-8")))}


def test_the_faults_are_seen():
    assert (
        len(faults('"""What it does."""\ndef told():\n    """Of it."""\ndef speed():\n    """Speed."""\nA = 1\n"""As said."""'))
        == 4
    )
