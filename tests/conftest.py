"""What all tests share: a quiet engine and figures without a display, both settled before anything is imported."""

import ctypes
import gc
import os
import signal

import pytest

# A user's own Exudyn settings must not reach the tests; the engine reads this when it is imported.
os.environ["EXUDYN_NO_USER_SETTINGS"] = "1"
os.environ["MPLBACKEND"] = "Agg"
# Two workers whose linear algebra has a thread for each core wait for each other; matrices here are small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# A shell that starts the tests in the background has Ctrl-C ignored, and their processes inherit that; tests send it.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config):
    """Compile the solver once, in two processes, before each worker would compile all of it."""
    if getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput"):
        from buckler.mbs.process import has_compiler
        from buckler.mbs.spectral.beforehand import compile_all

        if has_compiler():
            compile_all()


@pytest.fixture(scope="module", autouse=True)
def trimmed_heap():
    """Give memory back to the system after each module, where the C library can: long records leave holes that none fills."""
    yield
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


@pytest.fixture
def plain(monkeypatch):
    """No compiler: many laws used once each would take longer to compile than to run."""
    monkeypatch.setattr("buckler.mbs.laws.contact.has_compiler", lambda: False)
