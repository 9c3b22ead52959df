"""Links that stay parallel: a coupling is its rows, and no solver needs a line for it."""

from buckler.mbs.declare import declared, names
from buckler.mbs.elements.coupling import Coupling
from buckler.mbs.elements.element import place
from buckler.mbs.elements.rows import Turn, row
from buckler.mbs.elements.signal import Kind, Signal


@declared
class Parallel(Coupling):
    """Two links that turn alike, wherever they are."""

    first: str = names(doc="link and point, such as 'one:A'")
    second: str = names(doc="the other link, given likewise")

    def rows(self, mechanism):
        yield row(Turn(place(self.first), place(self.second)))

    def signals(self, name, record):
        yield Signal(f"{name}.moment", record.channel(name, "effort")[:, 0], "N m", Kind.REACTION)
