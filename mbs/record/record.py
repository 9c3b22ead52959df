"""Record of a run: plain arrays over time, made by a solver. Signals, energies, checks and files read nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..elements.element import Recorded
from ..functions import Called
from ..geometry import Array
from ..mechanism import Mechanism
from ..scene.scene import Scene
from .lookup import trapezoidal
from .motion import between


@dataclass(frozen=True, eq=False)
class Record(Recorded):
    """A run as arrays, made of what `Recorded` lists; of links the motions are `RigidMotion`, `StripMotion`, `ModalHistory`.

    Attributes
    ----------
    rule : callable
        Integral over time that suits how the motion was found, as in `buckler.mbs.record.lookup`.
    undetermined : sequence of str
        Elements whose forces no equation determines, as redundant ones share them.
    """

    mechanism: Mechanism
    channels: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    rule: Callable[[Array, Array], Array] = trapezoidal
    undetermined: Sequence[str] = ()

    def work(self, power: Array, sides: tuple[Array, Array] | None = None) -> Array:
        """Work, J, of a power, W, since t = 0, each (times,); `sides` are what it is just before and just after each sample."""
        if sides is None:
            return self.rule(self.time, power)
        before, after = sides
        jumped = np.diff(self.time) / 2 * (after[:-1] - power[:-1] + before[1:] - power[1:])
        return self.rule(self.time, power) + np.concatenate([[0.0], np.cumsum(jumped)])

    def user_functions(self) -> Iterator[Called]:
        """Yield the user's functions of states, with their arguments."""
        for name, element in Scene.of(self.mechanism).elements.items():
            yield from element.user_functions(name, self)

    def at(self, times: Array) -> Record:
        """Return places and velocities at other times [s] within the run, no channels; ValueError of fewer than two times."""
        if len(self.time) < 2:
            raise ValueError(f"a record of {len(self.time)} times has nothing between them")
        links = {name: between(motion, self.time, times) for name, motion in self.links.items()}
        blocks = {name: between(motion, self.time, times) for name, motion in self.blocks.items()}
        return Record(self.mechanism, times, links, blocks)
