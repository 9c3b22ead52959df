"""A pendulum in a file of its own."""

PENDULUM = {
    "points": {"O": [0, 0], "A": ["1 m", 0]},
    "links": {"arm": {"start": "O", "end": "A", "body": {"kind": "Rigid", "mass": 1.0, "inertia": "0.1 kg m^2"}}},
    "joints": [{"kind": "Revolute", "point": "O", "first": "ground", "second": "arm"}],
    "gravity": [0, -9.81],
    "run": {"duration": "0.5 s", "measure": ["min(A.y)", "max(abs(arm.vx))"]},
}
