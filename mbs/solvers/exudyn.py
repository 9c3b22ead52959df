"""The solver Exudyn as a value: its settings, each with the kind of steps it makes sense for. It imports no engine."""

from __future__ import annotations

from buckler.mbs.declare import Declared, Quantity, declared, field, flag, part, quantity
from buckler.mbs.solvers.steps import Controlled, Equal


@declared
class Exudyn(Declared):
    """The solver Exudyn: generalized-alpha, or an explicit method where rigid links hang together by clearance joints only."""

    in_files = False

    steps: Controlled | Equal = part(Controlled, Equal, doc="how long steps are", default_factory=Controlled)
    spectral_radius: float = field(
        Quantity("1", 0.0, 1.0, open_high=True),
        "of generalized-alpha at infinite frequency: a smaller one damps unresolved axial waves faster; at 1 nothing is damped "
        "and most runs diverge",
        default=0.7,
    )
    newton_relative: float = quantity(
        "1", above=0, doc="Newton's tolerance on the residual against its first value; either of the two suffices", default=1e-10
    )
    newton_absolute: float | None = quantity(
        "N", above=0, default=None,
        doc="Newton's tolerance on the residual; by default 5e-12 of the largest axial stiffness, ten times what round-off "
        "leaves; a relative one stops too early, as a large step's first residual is large",
    )  # fmt: skip
    reuse_jacobian: bool = flag(
        doc="keep Newton's Jacobian from step to step as long as it serves and the step size stays; with clearance in joints, "
        "controlled steps always do",
        default=False,
    )
