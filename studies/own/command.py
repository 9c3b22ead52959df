"""`buckler run FILE` and `buckler sweep FILE`: a mechanism of a file from the command line."""

from __future__ import annotations

import argparse
import json
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from buckler.mbs.documents.document import changed
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.sensitivity.reading import check
from buckler.mbs.simulation import simulate

from ..kit.options import add_options, add_output
from ..kit.parameters import Cases
from ..kit.words import Parser, add_repeated
from . import study
from .places import OPTIONS, opened, set_all, spec, to_json
from .solver import CHOICE, KIND, Setting, settings
from .study import Parameters, asked, digest

PROBED = 1e-6
"""Duration of the run that shows which signals there are, s."""


class File:
    """The mechanism of a file as what a command line runs or sweeps; see `buckler.studies.kit.options.Subject`."""

    module, about = study, "Simulate the mechanism of a file. What is not given is as its table [run] says."

    def __init__(self, path: Path) -> None:
        self.path, self.title = path, path.stem

    def declare(self, parser: Parser, taken: Collection[str] = ()) -> None:
        """Options of the run, of the solver, and of what is changed in the file."""
        repeats = {"of", "measure"}
        texts = {key: f"{each.doc}{'; may be repeated' if key in repeats else ''}" for key, each in OPTIONS.items()}
        add_options(parser, OPTIONS, texts)
        about = "another value at a place of the file, as links.coupler.body.section.thickness=0.2mm"
        add_repeated(parser, "--set", "PATH=VALUE", about, dest="changes")
        fields = {"solver": CHOICE} | {name: each.about for name, each in settings().items()}
        add_options(parser, fields, {"solver": CHOICE.doc} | {name: _text(each) for name, each in settings().items()})
        add_output(parser)

    def parameters(self, options: argparse.Namespace) -> Parameters:
        """Of one run, after its first microsecond was tried."""
        with named(self.path):
            base, changes = self._settings(options)
            found = Parameters(**base, changes=tuple(changes.items()), report=True)
            self.probe(found)
        return found

    def cases(self, options: argparse.Namespace, _taken: Collection[str]) -> tuple[Cases, dict[str, Any]]:
        """Places of the file vary."""
        with named(self.path):
            base, changes = self._settings(options)
            document = changed(json.loads(base["document"]), changes)
            places = {}
            for name in (text.partition("=")[0].strip() for text in options.vary):
                try:
                    places[name] = spec(document, name)
                except ValueError as error:
                    raise ValueError(f"--vary {name}: {error}") from None
        return Cases(lambda values: Parameters(**base, changes=tuple((changes | values).items())), places), {}

    def probe(self, parameters: Any) -> str:
        """Run a first microsecond: what cannot start, and names of signals that there are not, are refused."""
        with named(self.path):
            result = simulate(parameters.mechanism(), min(parameters.duration, PROBED))
            for name in asked(parameters) if result.signals else ():
                _ = result[name]
            for text in parameters.measure if result.signals else ():
                check(text, result.signals)
        return f"{self.title} {digest(parameters.document)}"

    def _settings(self, options: argparse.Namespace) -> tuple[dict[str, Any], dict[str, Any]]:
        """Everything a run is made with but its changes, and these; what the command line says goes before the file."""
        document, run = opened(self.path)
        Mechanism.from_dict(document)
        changes = set_all(document, options.changes)
        given = {name: getattr(options, name) for name in ("solver", *settings()) if getattr(options, name) is not None}
        if options.accuracy is not None:  # either of the two on the command line takes the place of the other in the file
            run.pop("solver", None)
        if given:
            run = {name: value for name, value in run.items() if name not in ("accuracy", "of")}
        found = dict(run.pop("solver", ()))
        kind = given.pop("solver", None)
        if kind is not None:
            kind = CHOICE.spec.read("--solver", kind)
            found = {KIND: kind} if kind != found.get(KIND, kind) else found | {KIND: kind}
        found |= {name: settings()[name].about.spec.read(f"--{name.replace('_', '-')}", text) for name, text in given.items()}
        said = {name: getattr(options, name) for name in OPTIONS if getattr(options, name) is not None}
        run |= {name: OPTIONS[name].spec.read(f"--{name}", value) for name, value in said.items()}
        return {**run, "name": self.title, "document": to_json(document), "solver": tuple(found.items())}, changes


def _text(setting: Setting) -> str:
    return setting.about.doc + (f"; of {setting.kinds[0]}" if len(setting.kinds) == 1 else "")


@contextmanager
def named(path: Path) -> Iterator[None]:
    """Whatever is wrong is a ValueError with the file's name in front, unless it names an option."""
    try:
        yield
    except (ValueError, OSError, ImportError) as error:
        said = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ValueError(said if said.startswith((str(path), "--")) else f"{path}: {said}") from None
