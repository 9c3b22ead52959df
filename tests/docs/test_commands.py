"""Commands in pages: each is one that there is, with options that it has; files in pages are mechanisms."""

import contextlib
import io
import re
import shlex
import tomllib
from functools import cache
from pathlib import Path

import pytest

from buckler.mbs import Mechanism
from buckler.studies.kit import registry
from buckler.studies.kit.cli import BY_NAME, COMMANDS, EXAMPLES, OPTIONS, main

ROOT = Path(__file__).resolve().parents[2]
DOCS = sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md") if "upgrade" not in path.name)  # it names what is gone
PAGES = ("README.md", "CONTRIBUTING.md", *DOCS)
CALL = re.compile(r"(?:^|&& |[\w/.-]*python3? -m )(?:buckler|studies) (.*?)(?= && |$)")


def commands(page):
    """Yield the words behind `buckler` of a page's shell blocks and of its text."""
    text = (ROOT / page).read_text(encoding="utf-8")
    for block in re.findall(r"^```sh\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        for line in block.replace("\\\n", " ").splitlines():
            yield from (shlex.split(call) for call in CALL.findall(line))
    for call in re.findall(r"`buckler ([^`|]+?)`", text):
        yield shlex.split(call.replace("'", ""))


@cache
def options(command, subject):
    """Read the options of a command from its help."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), pytest.raises(SystemExit):
        main(argv=[command, *subject, "--help"])
    return set(re.findall(r"--[a-z][\w-]*", said.getvalue()))


@pytest.mark.parametrize("page", PAGES)
def test_commands_and_their_options_are_there(page):
    for name, *words in commands(page):
        if name in OPTIONS:
            continue
        assert name in COMMANDS, f"buckler {name}"
        study = bool(words) and words[0] in registry.STUDIES
        subject = (words[0] if study else str(EXAMPLES / "six-bar.toml"),) if name in BY_NAME else ()
        if given := {word.partition("=")[0] for word in words if word.startswith("--")} - {"--help"}:
            assert given <= options(name, subject), f"buckler {name} {' '.join(words)}"


@pytest.mark.parametrize("page", PAGES)
def test_files_are_mechanisms(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for block in re.findall(r"^```toml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        content = tomllib.loads(block)
        if {"points", "links"} <= set(content) and "strip" not in content["links"]:  # the one of a strip is a part of a file
            assert Mechanism.from_dict(content).links
