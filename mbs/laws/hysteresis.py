"""Contact laws F = K d^n (1 + chi d'/v0), with ten published formulas for the hysteresis factor chi(e).

Here d is the penetration depth, d' its rate, v0 the approach speed at contact onset and e the required restitution.
The restitution that a law delivers differs from e: ``buckler.mbs.laws.delivered`` computes it, see docs/theory-contact.md.
"""

import math
from abc import ABC, abstractmethod
from functools import cached_property
from typing import ClassVar

from ..declare import Declared, declared, quantity
from ..validate import number
from .normal import PowerLaw
from .pieces import Reals, ramp
from .rebound import chi_exact, restitution


@declared  # makes a dataclass; its base `Declared` checks the fields and calls `agree`
class HysteresisLaw(PowerLaw, Declared, ABC):
    """F = K d^n (1 + chi(e) d'/v0), never below zero. A subclass defines chi(e) only."""

    stiffness: float = quantity("N/m^n", above=0, doc="K")
    restitution: float = quantity("1", low=0, high=1, doc="e asked for; above 0 where chi(e) has a pole at 0")
    exponent: float = quantity("1", low=1, high=3, doc="n; 1.5 for a Hertzian contact, 1 for a linear stop", default=1.5)

    pole_at_zero: ClassVar[bool] = False

    def agree(self) -> None:
        """Raise a ValueError at a pole of the hysteresis factor, or if a user's law has a negative one, which creates energy."""
        super().agree()
        if self.pole_at_zero:
            number("restitution", self.restitution, 0.0, 1.0, "1", open_low=True)
        number("chi", self.chi, 0.0, math.inf, "1")

    @staticmethod
    @abstractmethod
    def hysteresis(e: float) -> float:
        """Return the hysteresis factor chi [1] for the required restitution e."""

    @cached_property
    def chi(self) -> float:
        """Hysteresis factor of this law [1]."""
        return self.hysteresis(self.restitution)

    def force(self, depth: Reals, rate: Reals, onset: Reals) -> Reals:
        """Return the contact force [N] at depth [m], rate [m/s], positive when penetrating, and onset speed > 0 [m/s]."""
        return self.stiffness * ramp(depth) ** self.exponent * ramp(1.0 + self.chi * rate / onset)  # ramp(x) is max(0, x)

    def delivered(self, mass: float | None = None, speed: float | None = None) -> float:
        """Return the restitution delivered [1], here the same for every mass and speed; other laws depend on them."""
        return restitution(self.chi)


class HuntCrossley(HysteresisLaw):
    """chi = 3 (1 - e) / 2. First order in 1 - e, for light damping; Hunt and Crossley 1975, doi 10.1115/1.3423596.

    >>> round(HuntCrossley(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.768
    """

    hysteresis = staticmethod(lambda e: 1.5 * (1.0 - e))


class LankaraniNikravesh(HysteresisLaw):
    """chi = 3 (1 - e^2) / 4. From the energy lost in a nearly elastic impact; 1990, doi 10.1115/1.2912617.

    >>> round(LankaraniNikravesh(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.796
    """

    hysteresis = staticmethod(lambda e: 0.75 * (1.0 - e**2))


class HerbertMcWhannell(HysteresisLaw):
    """chi = 6 (1 - e) / [(2 e - 1)^2 + 3]. Herbert and McWhannell 1977, doi 10.1115/1.3439270.

    >>> round(HerbertMcWhannell(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.723
    """

    hysteresis = staticmethod(lambda e: 6.0 * (1.0 - e) / ((2.0 * e - 1.0) ** 2 + 3.0))


class LeeWang(HysteresisLaw):
    """chi = 3 (1 - e) / 4. Half of `HuntCrossley`, so that rebounds are too fast; Lee and Wang 1983, doi 10.1115/1.3267392.

    >>> round(LeeWang(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.869
    """

    hysteresis = staticmethod(lambda e: 0.75 * (1.0 - e))


class Gonthier(HysteresisLaw):
    """chi = (1 - e^2) / e. Gonthier et al. 2004, doi 10.1023/B:MUBO.0000029392.21648.bc.

    It tends to 1/e as e -> 0, like that of `ExactRestitution`, and is a third too large as e -> 1.

    >>> round(Gonthier(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.67
    """

    pole_at_zero = True
    hysteresis = staticmethod(lambda e: (1.0 - e**2) / e)


class ZhiyingQishao(HysteresisLaw):
    """chi = 3 (1 - e^2) exp[2 (1 - e)] / 4. `LankaraniNikravesh`, corrected for heavier damping.

    Qin Zhiying, Lu Qishao, J. Dynamics and Control 4 (2006) 294-298; quoted by Hu and Guo, doi 10.1007/s11044-015-9453-z.

    >>> round(ZhiyingQishao(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.68
    """

    hysteresis = staticmethod(lambda e: 0.75 * (1.0 - e**2) * math.exp(2.0 * (1.0 - e)))


class Flores(HysteresisLaw):
    """chi = 8 (1 - e) / (5 e). For soft as well as hard contacts; Flores et al. 2011, doi 10.1007/s11044-010-9237-4.

    >>> round(Flores(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.683
    """

    pole_at_zero = True
    hysteresis = staticmethod(lambda e: 8.0 * (1.0 - e) / (5.0 * e))


class HuGuo(HysteresisLaw):
    """chi = 3 (1 - e) / (2 e). Hu and Guo 2015, doi 10.1007/s11044-015-9453-z.

    >>> round(HuGuo(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.697
    """

    pole_at_zero = True
    hysteresis = staticmethod(lambda e: 3.0 * (1.0 - e) / (2.0 * e))


class CarvalhoMartins(HysteresisLaw):
    """chi = 1.5 (1 - e) (11 - e) / (1 + 9 e). Delivers e to 2e-4 for e >= 0.5; doi 10.1016/j.mechmachtheory.2019.03.028.

    >>> round(CarvalhoMartins(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.7
    """

    hysteresis = staticmethod(lambda e: 1.5 * (1.0 - e) * (11.0 - e) / (1.0 + 9.0 * e))


class ExactRestitution(HysteresisLaw):
    """chi from chi (1 + e) = ln[(1 + chi) / (1 - chi e)]: delivers e itself, 0 < e <= 1.

    ``buckler.mbs.laws.chi_exact`` solves it as the law is made; Carvalho, Martins, doi 10.1016/j.mechmachtheory.2019.03.028.

    >>> round(ExactRestitution(1e8, restitution=0.7).delivered(), 3)  # asked: 0.7
    0.7
    """

    pole_at_zero = True
    hysteresis = staticmethod(chi_exact)
