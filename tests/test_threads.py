"""Linear algebra uses one thread while any of several ask for it, and as many as before after the last."""

from contextlib import ExitStack

import pytest

from buckler.mbs import process

pytestmark = pytest.mark.skipif(not process._thread_functions(), reason="the linear algebra library is another one")


def counts():
    return [read() for read, _ in process._thread_functions()]


@pytest.mark.parametrize("first", [0, 1])
def test_the_last_to_leave_takes_back_what_the_first_found(first):
    before = counts()
    try:
        for _, write in process._thread_functions():
            write(2)
        two = counts()
        asking = [ExitStack(), ExitStack()]
        for each in asking:
            each.enter_context(process.one_thread())
        asking[first].close()
        assert set(counts()) == {1}
        asking[1 - first].close()
        assert counts() == two
    finally:
        for (_, write), count in zip(process._thread_functions(), before, strict=True):
            write(count)
