"""The compiled solver: strips as polynomials, links in absolute coordinates, joints as constraints (docs/theory-spectral.md).

Without a compiler `interpreted` stands in for the module `compiling`, and the kernel runs as plain Python.
"""

import sys

from ..process import has_compiler

if not has_compiler():
    from . import interpreted

    sys.modules[f"{__name__}.compiling"] = interpreted
