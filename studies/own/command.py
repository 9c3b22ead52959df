"""`buckler run FILE` and `buckler sweep FILE`: a mechanism of a file from the command line."""

from __future__ import annotations

import argparse
import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from buckler.mbs.documents.document import change
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.sensitivity.reading import check
from buckler.mbs.simulation import simulate

from ..kit.cli import Parser, add_repeated
from ..kit.parameters import Cases
from ..kit.running import Study, add_options
from . import study
from .study import Parameters, digest, solver_options, target_signals
from .verbs import OPTIONS, name_errors, read_changes, read_file, spec

PROBED = 1e-6
"""Duration of the run that shows which signals there are [s]: a step or two of any solver."""


class File(Study):
    """Mechanism of a file."""

    module, about = study, "Simulate the mechanism of a file. Options that are not given are those of its table [run]."

    def __init__(self, path: Path) -> None:
        self.path, self.title = path, path.stem

    def declare(self, parser: Parser, taken: Collection[str] = ()) -> None:
        """Declare the options of the run, of the solver, and the changes of the file."""
        repeats = {"of", "measure"}
        add_options(
            parser, OPTIONS, {key: f"{each.doc}{'; may be repeated' * (key in repeats)}" for key, each in OPTIONS.items()}
        )
        about = "another value at a place of the file, as links.coupler.body.section.thickness=0.2mm"
        add_repeated(parser, "--set", "PATH=VALUE", about, dest="changes")
        add_options(parser, solver_options(), {name: each.doc for name, each in solver_options().items()})

    def parameters(self, options: argparse.Namespace) -> Parameters:
        """Make the parameters of one run, and try its first microsecond."""
        with name_errors(self.path):
            base, changes = self._settings(options)
            found = Parameters(**base, changes=tuple(changes.items()), report=True)
            self.probe(found)
        return found

    def cases(self, options: argparse.Namespace, taken: Collection[str]) -> tuple[Cases, dict[str, Any]]:
        """Make cases from values at places of the file."""
        with name_errors(self.path):
            base, changes = self._settings(options)
            document, places = change(json.loads(base["document"]), changes), {}
            for name in (text.partition("=")[0].strip() for text in options.vary):
                try:
                    places[name] = spec(document, name)
                except ValueError as error:
                    raise ValueError(f"--vary {name}: {error}") from None
        return Cases(lambda values: Parameters(**base, changes=tuple((changes | values).items())), places), {}

    def probe(self, parameters: Any) -> str:
        """Run a first microsecond: refuse a mechanism that cannot start, and names of signals that it has not."""
        with name_errors(self.path):
            result = simulate(parameters.mechanism(), min(parameters.duration, PROBED))
            for name in target_signals(parameters) if result.signals else ():
                _ = result[name]
            for text in parameters.measure if result.signals else ():
                check(text, result.signals)
        return f"{self.title} {digest(parameters.document)}"

    def _settings(self, options: argparse.Namespace) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the settings of a run without its changes, and the changes; options override the file."""
        document, run = read_file(self.path)
        Mechanism.from_dict(document)
        changes = read_changes(document, options.changes)
        given = {name: value for name in solver_options() if (value := getattr(options, name)) is not None}
        if options.accuracy is not None:  # accuracy and solver on the command line replace each other in the file
            run.pop("solver", None)
        if given:
            run = {name: value for name, value in run.items() if name not in ("accuracy", "of")}
        given = {name: solver_options()[name].spec.read(f"--{name.replace('_', '-')}", text) for name, text in given.items()}
        solver, kind = dict(run.pop("solver", ())), given.pop("solver", None)
        if kind is not None:
            solver = {} if kind != solver.get("kind", kind) else solver
            solver["kind"] = kind
        solver |= given
        ours = {name: value for name in OPTIONS if (value := getattr(options, name)) is not None}
        run |= {name: OPTIONS[name].spec.read(f"--{name}", value) for name, value in ours.items()}
        return {
            **run,
            "name": self.title,
            "document": json.dumps(document, ensure_ascii=False),
            "solver": tuple(solver.items()),
        }, changes
