"""The crank-rocker with clearance, rigid or with a flexible rocker, without the engine: a second opinion, compiled.

It shares the contact laws with the rest of `mbs` and nothing else. `FourBar`, `ModalData` and `beam_modes` need numpy and
scipy only; `simulate` and `ensemble` need Numba (the extra `fast`), which is imported when they are asked for.
"""

from typing import TYPE_CHECKING, Any

from buckler.mbs.reference.fourbar import BODIES, CLOSED, JOINTS, RATTLING, FourBar
from buckler.mbs.reference.modes import ModalData, beam_modes

if TYPE_CHECKING:
    from buckler.mbs.reference.ensembles import Ensemble, ensemble
    from buckler.mbs.reference.run import Outcome, Run, ideal_state, simulate

__all__ = [
    "BODIES", "CLOSED", "Ensemble", "FourBar", "JOINTS", "ModalData", "Outcome", "RATTLING", "Run", "beam_modes", "ensemble",
    "ideal_state", "simulate",
]  # fmt: skip

_COMPILED = {
    "Ensemble": "ensembles", "ensemble": "ensembles", "Outcome": "run", "Run": "run", "ideal_state": "run", "simulate": "run",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Load what needs Numba only when it is asked for."""
    if name in _COMPILED:
        from importlib import import_module

        try:
            return getattr(import_module(f"buckler.mbs.reference.{_COMPILED[name]}"), name)
        except ModuleNotFoundError as error:
            message = f"buckler.mbs.reference.{name} needs {error.name}: pip install '.[fast]'"
            raise ModuleNotFoundError(message, name=error.name) from error
    raise AttributeError(f"module 'buckler.mbs.reference' has no attribute '{name}'")
