"""What the tests of modal links share."""

import pytest


@pytest.fixture(scope="module")
def bar():
    """A solid bar of few elements."""
    from meshed import THIN, WIDE, solid_bar

    return solid_bar(WIDE, THIN, (8, 2, 1))
