"""A plain script that runs a mechanism in Exudyn without Buckler and gives the same numbers.

It is read off the assembled system, so that it holds what the engine got and nothing else. What calls a Python function at each
step (contact laws, struts, general motions) is refused by name.
"""

from __future__ import annotations

from math import ceil, pi
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np

from ..elements.clearance import clearances
from ..elements.drive import Ramp
from ..elements.element import GROUND
from ..kinematics.exact import TURN
from ..kinematics.linkage import turning_speed
from ..mechanism import Mechanism
from ..solvers import Equal, Exudyn
from ..validate import positive, whole
from .build import build
from .scene import Scene
from .solve import implicit_settings

HEAD = '''"""{title}

Written by Buckler {version} for Exudyn {engine}; it needs exudyn and numpy only. SI units.
Output: {output}, the places of all points over time.
"""

import exudyn as exu
import numpy as np
from exudyn.itemInterface import *

SC = exu.SystemContainer()
mbs = SC.AddSystem()
array = np.array
'''
SETTINGS = (
    "timeIntegration.endTime",
    "timeIntegration.numberOfSteps",
    "timeIntegration.adaptiveStep",
    "timeIntegration.generalizedAlpha.spectralRadius",
    "timeIntegration.newton.useModifiedNewton",
    "timeIntegration.newton.modifiedNewtonJacUpdatePerStep",
    "timeIntegration.newton.relativeTolerance",
    "timeIntegration.newton.absoluteTolerance",
)
"""What the script sets; everything else keeps the engine's default."""
ROOMS = ("Node", "Object", "Marker", "Load")


def exudyn_script(mechanism: Mechanism, duration: float, steps: int | None = None, output: str = "points.csv") -> str:
    """Return the text of the script; see `Mechanism.write_exudyn_script`."""
    from importlib import metadata

    positive("duration", duration, "s")
    turns = turning_speed(mechanism, duration) * duration / (2 * pi) if mechanism.drives else 0.0
    count = max(200, ceil(TURN * turns)) if steps is None else whole("steps", steps, 1, 10**9)
    scene = build(mechanism)
    speeds = {name: getattr(element, "speed", None) for name, element in mechanism.elements().items()}
    ramps = {scene.constraints[name]: speed for name, speed in speeds.items() if isinstance(speed, Ramp)}
    _refuse(scene, ramps)
    title = f"Planar mechanism with {len(mechanism.links)} links: {', '.join(link.name for link in mechanism.links)}."
    versions = {"version": metadata.version("buckler"), "engine": metadata.version("exudyn")}
    lines = [HEAD.format(title=title, output=output, **versions)]
    for room in ROOMS:
        lines.append(f"\n# {room.lower()}s")
        for number in range(getattr(scene.system.systemData, f"NumberOf{room}s")()):
            lines += _item(scene, room, number, ramps)
    lines += ["", *_sensors(scene), "", "mbs.Assemble()", "settings = exu.SimulationSettings()"]
    settings = implicit_settings(scene, Exudyn(Equal(count)), duration)
    for name in SETTINGS:
        lines.append(f"settings.{name} = {_value(_inner(settings, name))}")
    lines.append("settings.timeIntegration.adaptiveStepRecoverySteps = 2**31 - 1")
    lines.append("settings.timeIntegration.discontinuous.useRecommendedStepSize = True")
    lines.append(f"settings.linearSolver.solverType = exu.{_inner(settings, 'linearSolver.solverType')!s}")
    lines.append("settings.solution.file.write = False")
    lines.append(f"settings.solution.sensors.writePeriod = {duration!r} / {count}")
    lines += ["mbs.SolveDynamic(settings)", "", *_output(scene, output)]
    return "\n".join(lines) + "\n"


def _refuse(scene: Scene, ramps: dict[int, Ramp]) -> None:
    """Raise a ValueError, by name, if the scene needs functions of Python, or parts the script cannot write down."""
    loose = clearances(scene.mechanism)
    needs = [f"link '{link.name}' (Modal)" for link in scene.mechanism.links if link.body.linear]
    needs += [f"link '{name}' (Strut)" for name in scene.strut_links]
    needs += [f"joint '{name}' (Clearance)" for name, joint in scene.mechanism.elements().items() if joint in loose]
    needs += [f"stop '{name}'" for name, stop in scene.mechanism.elements().items() if stop in scene.mechanism.stops]
    if not needs:
        owners = {number: name for name, number in scene.constraints.items()}
        for number in range(scene.system.systemData.NumberOfObjects()):
            item = scene.system.GetObject(number)
            if number not in ramps and any(isinstance(value, dict) and "function" in value for value in item.values()):
                needs.append(f"'{owners[number]}'" if number in owners else f"a {item['objectType']} of the engine")
    if needs:
        raise ValueError(f"write_exudyn_script: not possible for what needs functions or solids of Buckler: {', '.join(needs)}")


def _item(scene: Scene, room: str, number: int, ramps: dict[int, Ramp]) -> list[str]:
    """One line that adds an item, by the arguments that differ from their defaults; before it the functions it needs."""
    found = getattr(scene.system, f"Get{room}")(number)
    kind = room + found[f"{room.lower()}Type"]
    default = dict(getattr(eii, kind)())
    before: list[str] = []
    arguments = []
    for name, value in found.items():
        if name.startswith("V") or name in ("name", f"{room.lower()}Type") or _same(value, default.get(name)):
            continue
        if isinstance(value, dict) and "function" in value:
            function = f"{'speed' if name.endswith('_t') else 'position'}{number}"
            before += _ramp_function(function, ramps[number])
            arguments.append(f"{name}={function}")
        else:
            arguments.append(f"{name}={_value(value)}")
    return [*before, f"mbs.Add{room}({kind}({', '.join(arguments)}))  # {number}"]


def _ramp_function(name: str, ramp: Ramp) -> list[str]:
    """The text of a ramp's position or speed over time."""
    start, change, span = _value(ramp.start), _value(ramp.end - ramp.start), _value(ramp.duration)
    if name.startswith("speed"):
        body = f"{start} + {change} * min(t, {span}) / {span}"
    else:
        end = _value(ramp.end)
        body = f"{start} * min(t, {span}) + {change} * min(t, {span})**2 / (2 * {span}) + {end} * (t - min(t, {span}))"
    return [f"def {name}(mbs, t, number, offset):", f"    return {body}", ""]


def _sensors(scene: Scene) -> list[str]:
    """A sensor for each point that moves."""
    lines = ["# places of the points", "sensors = {"]
    for point, marker in _markers(scene).items():
        position = "exu.OutputVariableType.Position"
        item = f"SensorMarker(markerNumber={marker}, outputVariableType={position}, storeInternal=True, writeToFile=False)"
        lines.append(f"    {point!r}: mbs.AddSensor({item}),")
    return [*lines, "}"]


def _markers(scene: Scene) -> dict[str, int]:
    """Position marker of each point that a body of the engine carries."""
    found: dict[str, int] = {}
    for placed in scene.placed.values():
        for point, marker in placed.ends.items():
            found.setdefault(point, marker)
    return {point: found[point] for point in scene.mechanism.points if point in found and point != GROUND}


def _output(scene: Scene, output: str) -> list[str]:
    return [
        "rows = [mbs.GetSensorStoredData(sensor) for sensor in sensors.values()]  # t, x, y, z",
        "table = np.column_stack([rows[0][:, 0], *(row[:, 1:3] for row in rows)])",
        'header = ",".join(["t", *(f"{point}.{axis}" for point in sensors for axis in "xy")])',
        f'np.savetxt({output!r}, table, fmt="%.17g", delimiter=",", header=header, comments="")',
        'print(f"{len(table)} rows; last place of each point:")',
        "for point, row in zip(sensors, rows):",
        '    print(f"{point}: {row[-1, 1]:.9g} {row[-1, 2]:.9g}")',
    ]


def _inner(settings: exu.SimulationSettings, name: str) -> Any:
    for part in name.split("."):
        settings = getattr(settings, part)
    return settings


def _same(value: object, default: object) -> bool:
    if isinstance(value, dict):
        return False
    try:
        return bool(np.array_equal(np.asarray(value), np.asarray(default)))
    except ValueError:  # ragged
        return False


def _value(value: Any) -> str:
    """Text that gives the same value back."""
    if isinstance(value, np.ndarray):
        text = repr(value.tolist())
        return f"array({text})" if value.ndim > 1 else text
    if isinstance(value, np.generic):
        return repr(value.item())
    return repr(value) if not hasattr(type(value), "__members__") else f"exu.{value!s}"
