"""Pages of the Python interface, from the numpydoc docstrings, which are plain text: nothing in them is taken for markup."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from numpydoc.docscrape import ClassDoc, FunctionDoc, NumpyDocString

SECTIONS = ("Parameters", "Attributes", "Returns", "Yields", "Raises")
TEXTS = ("Notes", "References", "Examples")
WIDTH = 88
"""Of a signature; a longer one has a line for each parameter."""


class Page(NamedTuple):
    """One page: its name and title, the module its names come from, and the names."""

    name: str
    title: str
    module: str
    names: tuple[str, ...]


def _names(text: str) -> tuple[str, ...]:
    return tuple(text.split())


PAGES = (
    Page(
        "run",
        "Run and look",
        "buckler.mbs",
        (
            *_names("simulate Result Status Mechanism Exudyn Spectral Controlled Equal"),
            *_names("equilibrium path frequencies"),
            *_names("slider_crank crank_rocker"),
        ),
    ),
    Page("links", "Links", "buckler.mbs", _names("Link Rigid Strut Beam Cable Modal Section Profile Material AdamsDamping")),
    Page(
        "joints",
        "Joints, guides, stops, drives",
        "buckler.mbs",
        _names("Revolute Clearance Weld Slider Slot Guide GuideFriction Stop Drive Ramp Motion"),
    ),
    Page("loads", "Loads and masses", "buckler.mbs", _names("Force LineLoad Torque Motor Spring TorsionSpring Mass")),
    Page("couplings", "Couplings", "buckler.mbs", _names("Gear Rack Belt Rope")),
    Page("laws", "Contact and friction laws", "buckler.mbs.laws", ()),
    *(
        Page(f"elastica-{name}", f"The exact strip: {name}", f"buckler.elastica.{name}", ())
        for name in _names("pinned law rod strip")
    ),
    Page("sweeps", "Sweeps of studies", "buckler.studies.sweeping.sweep", ("sweep", "read", "Part", "Row")),
)


def page_of(page: Page) -> Iterator[str]:
    """The lines of a page."""
    module = importlib.import_module(page.module)
    yield from (f"# {page.title}", "", f"`{page.module}`", "")
    if not page.names:
        yield from _text((module.__doc__ or "").strip().splitlines())
    for name in page.names or _public(module):
        yield from _entry(name, getattr(module, name))


def _public(module: Any) -> list[str]:
    """What a module defines, or lists, for others."""
    names = getattr(module, "__all__", None) or [name for name in vars(module) if not name.startswith("_")]
    ours = [name for name in names if callable(getattr(module, name)) and inspect.getdoc(getattr(module, name))]
    return [name for name in ours if hasattr(module, "__all__") or getattr(module, name).__module__ == module.__name__]


def _entry(name: str, thing: Any) -> Iterator[str]:
    """A class or function."""
    yield from (f"## {name}", "", "```python", _signature(name, thing), "```", "")
    doc = ClassDoc(thing, config={"show_class_members": False}) if inspect.isclass(thing) else FunctionDoc(thing)
    yield from _document(doc)
    if inspect.isclass(thing):
        for key, member in vars(thing).items():
            plain = member.__func__ if isinstance(member, classmethod | staticmethod) else member
            if not key.startswith("_") and inspect.isfunction(plain) and inspect.getdoc(plain):
                yield from (f"### {name}.{key}", "", "```python", _signature(key, plain), "```", "")
                yield from _document(FunctionDoc(plain))


def _signature(name: str, thing: Any) -> str:
    try:
        found = str(inspect.signature(thing))
    except (TypeError, ValueError):
        return name
    found = re.sub(r"(?:buckler\.|collections\.abc\.)[\w.]*?(\w+)(?=[\s,\])|=]|$)", r"\1", found.replace("'", ""))
    if len(name) + len(found) <= WIDTH:
        return f"{name}{found}"
    inside, _, back = found[1:].rpartition(")")
    parts = re.split(r", (?![^\[(]*[\])])", inside)
    return f"{name}(\n" + "".join(f"    {part},\n" for part in parts) + f"){back}"


def _document(doc: NumpyDocString) -> Iterator[str]:
    yield from _text(doc["Summary"])
    yield from _text(doc["Extended Summary"])
    for section in SECTIONS:
        if doc[section]:
            yield from (f"**{section}**", "")
            for each in doc[section]:
                head = f"`{each.name}` *({_plain(each.type)})*" if each.name and each.type else f"`{each.name or each.type}`"
                yield from (f"- {head}", *(f"  {_plain(line)}" for line in each.desc), "")
    for section in TEXTS:
        if doc[section]:
            yield from (f"**{section}**", "")
            yield from _text(doc[section] if isinstance(doc[section], list) else [doc[section]])


def _text(lines: list[str]) -> Iterator[str]:
    """Paragraphs; what is indented, and an example from >>> to an empty line, is shown as it stands."""
    block: list[str] = []
    for line in [*lines, ""]:
        in_example = block and block[0].startswith(">>> ") and block[-1].strip()
        if line.startswith(("    ", ">>> ")) or in_example or (block and not line.strip()):
            block.append(line)
            continue
        if block:
            yield from ("", "```text", *_dedented(block), "```", "")
            block = []
        yield _plain(line)
    if block and any(part.strip() for part in block):
        yield from ("", "```text", *_dedented(block), "```", "")


def _dedented(block: list[str]) -> list[str]:
    while block and not block[-1].strip():
        block.pop()
    return inspect.cleandoc("\n".join(["", *block])).splitlines()


def _plain(text: str) -> str:
    """A line in which nothing but code in backticks stands for markup."""
    parts = re.split(r"(``?[^`]+``?)", text)
    parts[::2] = [re.sub(r"([\\*_<>$\[\]|#~^{}])", r"\\\1", part) for part in parts[::2]]
    return re.sub(r"^(\s*)([-+]|\d+\.)(?=\s)", r"\1\\\2", "".join(parts))
