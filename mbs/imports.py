"""Late imports: of functions from higher layers, of a package's names at first use, and of other packages' entry points.

Other installed packages extend Buckler through entry points, which docs/how-to-add-an-element.md describes. The group
`buckler.kinds` is read when a file is read or a schema is written, any other group when a kind is not one of Buckler's own.
"""

import warnings
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Any


def import_late(path: str) -> Any:
    """Import 'module:name' of `buckler.mbs` at the time of the call: methods use functions of higher layers in this way."""
    module, _, name = path.partition(":")
    return getattr(import_module(f"buckler.mbs.{module}"), name)


def lazy_attributes(package: str, modules: Mapping[str, str]) -> Callable[[str], Any]:
    """Make a package's `__getattr__` (PEP 562) that imports a name from its module at the first use."""

    def load(name: str) -> Any:
        """Import a name."""
        if name not in modules:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(f"{package}.{modules[name]}"), name)

    return load


@cache
def extensions(group: str) -> dict[str, Any]:
    """Return the objects of a group of entry points, by name; warn of any that does not load and leave it out."""
    from importlib import metadata  # loading takes a tenth of the time of this package; scripts without files do without

    found: dict[str, Any] = {}
    for point in metadata.entry_points(group=group):
        try:
            found[point.name] = point.load()
        except Exception as error:
            package = f" of {point.dist.name}" if point.dist else ""
            text = f"{group}: '{point.name}'{package} does not load: {type(error).__name__}: {error}"
            warnings.warn(text, RuntimeWarning, stacklevel=2)
    return found
