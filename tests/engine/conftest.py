"""Tests of the engine: runs that name no solver are Exudyn's, as they are where there is no compiler."""

import pytest

from buckler.mbs import simulation


@pytest.fixture(autouse=True, scope="module")
def no_compiler():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulation, "has_compiler", lambda: False)
        yield
