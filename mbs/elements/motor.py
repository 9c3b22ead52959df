"""Direct-current motors."""

from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from ..declare import Either, Quantity, declared, field, names, quantity
from ..functions import kinks
from ..functions.fields import Function
from ..geometry import Array
from ..laws.pieces import Reals
from .element import Burden, Parts, Push, Recorded
from .load import Load, sample
from .references import angle_reference, check_turning
from .signal import Energy, Kind, Signal

CREEP = 1e-3
"""Speed of the rotor [rad/s] below which its friction falls linearly to zero, small against speeds of use."""


@declared
class Motor(Load):
    """A DC motor without inductance that drives a link through a gear; its stator is on the ground.

    The rotor has the speed w, `gear` times the link's speed. The current is i = (u - constant w)/resistance, where u is the
    voltage less the dead band. The link's torque is gear (constant i - friction sign(w)). The rotor adds inertia gear^2 to the
    link.

    >>> Motor("crank", voltage=12.0, resistance=1.2, constant=0.05, gear=20.0).key
    'motor.crank'
    """

    title: ClassVar[str] = "motor on '{link}'"
    label: ClassVar[str] = "motor.{link:body}"

    link: str = names(doc="any but a Strut; on a flexible link the motor acts at the start; 'beam:B' names another point")
    voltage: float | Callable[[float], float] = field(Either((Quantity("V"), Function("t", "V"))), "constant, or over t [s]")
    resistance: float = quantity("Ohm", above=0, doc="of the winding")
    constant: float = quantity("N m/A", above=0, doc="torque constant, which is the voltage constant in V s/rad")
    inertia: float = quantity("kg m^2", low=0, doc="of the rotor", default=0.0)
    gear: float = quantity("1", nonzero=True, doc="turns of the rotor per turn of the link; negative if opposite", default=1.0)
    friction: float = quantity("N m", low=0, doc="against the turning rotor; below 1e-3 rad/s linear to zero", default=0.0)
    dead_band: float = quantity("V", low=0, doc="subtracted from the magnitude of the voltage, down to zero", default=0.0)

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) at which the voltage jumps, has a kink or changes quickly [s]."""
        return kinks(self.voltage, duration)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the link has an angle."""
        check_turning(mechanism, self.link, self.where)

    def burdens(self, mechanism: Parts) -> Iterator[Burden]:
        """Yield the inertia of the rotor, reduced to the link: inertia gear^2."""
        if self.inertia:
            yield Burden(angle_reference(mechanism, self.link), 0.0, self.inertia * self.gear**2)

    @property
    def friction_at(self) -> str:
        """Name of the driven link if the rotor has friction, else ''."""
        return self.link if self.friction else ""

    def effective(self, voltage: Reals) -> Reals:
        """Return the voltage [V] less the dead band, down to zero, with its sign."""
        return voltage - np.clip(voltage, -self.dead_band, self.dead_band)

    def current(self, voltage: Reals, speed: Reals) -> Reals:
        """Return the current [A] for a voltage [V] and the link's speed [rad/s]."""
        return (self.effective(voltage) - self.constant * self.gear * speed) / self.resistance

    def rubbing(self, speed: Reals) -> Reals:
        """Return the friction torque against the rotation of the rotor [N m] for the link's speed [rad/s]."""
        return self.friction * np.clip(self.gear * speed / CREEP, -1.0, 1.0)

    def torque(self, voltage: Reals, speed: Reals) -> Reals:
        """Return the torque on the link [N m] for a voltage [V] and the link's speed [rad/s]."""
        return self.gear * (self.constant * self.current(voltage, speed) - self.rubbing(speed))

    def _voltage_and_speed(self, record: Recorded) -> tuple[Array, Array]:
        """Return the voltage [V] and the link's speed [rad/s], each (times,)."""
        voltage = sample(self.voltage, record.time) if callable(self.voltage) else np.full_like(record.time, self.voltage)
        return voltage, record.turn(angle_reference(record.mechanism, self.link))[1]

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the torque; `burdens` add the inertia of the rotor."""
        torque = self.torque(*self._voltage_and_speed(record))
        yield Push(angle_reference(record.mechanism, self.link), np.zeros((len(torque), 2)), torque)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield torque on the link [N m], current [A] and voltage [V]."""
        voltage, speed = self._voltage_and_speed(record)
        yield Signal(f"{name}.torque", self.torque(voltage, speed), "N m", Kind.INTERNAL)
        yield Signal(f"{name}.current", self.current(voltage, speed), "A", Kind.INTERNAL)
        yield Signal(f"{name}.voltage", voltage, "V", Kind.INTERNAL)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield kinetic energy of the rotor, electric work of the effective voltage, losses by resistance and friction."""
        voltage, speed = self._voltage_and_speed(record)
        current = self.current(voltage, speed)
        yield Energy("stored", "kinetic", 0.5 * self.inertia * (self.gear * speed) ** 2)
        yield Energy("supplied", "motor", record.work(self.effective(voltage) * current))
        yield Energy("dissipated", "resistance", record.work(self.resistance * current**2))
        if self.friction:
            yield Energy("dissipated", "friction", record.work(self.rubbing(speed) * self.gear * speed))
