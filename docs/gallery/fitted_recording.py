"""A recording of a swing, fitted.

A camera follows a mass on a string; its file has milliseconds of its own clock, millimetres and decimal commas. The
recording is made up: SciPy integrates the pendulum, and noise is added. `fit` finds the length, the damping, the angle
at the start and the time of the start; each is off by less than the width of its 95 % interval.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp

from buckler.mbs import Link, Mechanism, Revolute, Rigid, TorsionSpring, fit, simulate
from buckler.mbs.sensitivity.data import read_csv

GRAVITY, MASS = 9.81, 0.5
TRUE = {"length": 0.620, "damping": 4e-3, "angle": 0.7, "time_zero": 3.215}


def pendulum(length, damping, angle):
    """Mass [kg] on a string [m], let go at an angle [rad] from the vertical; damping [N m s/rad] at its pin."""
    return Mechanism(
        points={"O": (0, 0), "A": (length * np.sin(angle), -length * np.cos(angle))},
        links=[Link("string", "O", "A", Rigid.of(mass=MASS, inertia=1e-6, centre=(length, 0)))],
        joints=[Revolute("O", "ground", "string")],
        loads=[TorsionSpring("ground", "string", 0.0, damping=damping)],
        gravity=(0, -GRAVITY),
    )


def record(path):
    """Write time [ms] and place [mm] as a camera does."""
    time, inertia = np.arange(181) / 30, MASS * TRUE["length"] ** 2 + 1e-6

    def rates(_, y):
        return y[1], -(MASS * GRAVITY * TRUE["length"] * np.sin(y[0]) + TRUE["damping"] * y[1]) / inertia

    angle = solve_ivp(rates, (0, 6), (TRUE["angle"], 0), t_eval=time, rtol=1e-10, atol=1e-12).y[0]
    place = 1e3 * TRUE["length"] * np.sin(angle) + 0.5 * np.random.default_rng(7).standard_normal(time.size)
    rows = (f"{1e3 * (t + TRUE['time_zero']):.1f};{x:.2f}".replace(".", ",") for t, x in zip(time, place, strict=True))
    path.write_text("\n".join(["Camera 2", "Time (ms);Place (mm)", *rows]), encoding="utf-16")


free = {"length": (0.5, 0.8), "damping": (0.0, 0.02), "angle": (0.5, 0.9), "time_zero": (3.1, 3.3)}
with TemporaryDirectory() as folder:
    record(file := Path(folder) / "swing.txt")
    found = fit(pendulum, read_csv(file, ["Place=A.x"], start=0), free=free, starts=2)
print(found)
widths = {name: high - low for name, (low, high) in found.intervals.items()}
assert all(abs(found.values[name] - true) < widths[name] < 0.2 * true for name, true in TRUE.items())
zero = found.values.pop("time_zero")
result = simulate(pendulum(**found.values), duration=6.0)
(experiment,) = found.experiments
picture = Figure(figsize=(6, 3.5))
axes = picture.subplots()
axes.plot(experiment.time - zero, 1e3 * experiment.signals["A.x"], ".", markersize=3, label="recording")
axes.plot(result.time, 1e3 * result.signals["A.x"], label="fit")
axes.set(xlabel="time [s]", ylabel="place [mm]")
axes.legend()
