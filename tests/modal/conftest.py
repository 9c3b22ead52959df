"""What the tests of modal links share."""

import pytest


@pytest.fixture(scope="module")
def bar():
    """A solid bar of few elements."""
    from meshed import LENGTH, STEEL, THIN, WIDE

    from buckler.mbs.modal.solid import assemble, box_mesh

    return assemble(box_mesh(LENGTH, WIDE, THIN, (8, 2, 1)), STEEL)
