"""The compiled second solver: spectral strips in absolute coordinates, a constant mass matrix, joints as constraints.

Without a compiler the module `interpreted` takes the place of `compiling`: kernel functions are run as plain Python.
"""

import sys

from ..process import has_compiler

if not has_compiler():
    from . import interpreted

    sys.modules[f"{__name__}.compiling"] = interpreted
