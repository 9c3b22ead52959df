"""Contact and friction laws: small, frozen, pure objects, one concept each, equation and source in the docstring."""

from .bristle import LuGre, Stiction
from .friction import AdamsFriction, Ambrosio, BristleLaw, Coulomb, FrictionLaw, NoFriction, Stribeck, Threlfall
from .hysteresis import (
    CarvalhoMartins,
    ExactRestitution,
    Flores,
    Gonthier,
    HerbertMcWhannell,
    HuGuo,
    HuntCrossley,
    HysteresisLaw,
    LankaraniNikravesh,
    LeeWang,
    ZhiyingQishao,
)
from .normal import Hertz, Impact, KelvinVoigt, PowerLaw, effective_modulus, hertz_external, hertz_internal
from .pieces import NormalLaw, step
from .rebound import (
    chi_exact,
    contact_time,
    damping_ratio,
    delivered,
    elastic_depth,
    restitution,
    restitution_integrated,
    restitution_linear,
)

__all__ = [
    "AdamsFriction", "Ambrosio", "BristleLaw", "CarvalhoMartins", "Coulomb", "ExactRestitution", "Flores", "FrictionLaw",
    "Gonthier", "HerbertMcWhannell", "Hertz", "HuGuo", "HuntCrossley", "HysteresisLaw", "Impact", "KelvinVoigt",
    "LankaraniNikravesh", "LeeWang", "LuGre", "NoFriction", "NormalLaw", "PowerLaw", "Stiction", "Stribeck", "Threlfall",
    "ZhiyingQishao", "chi_exact", "contact_time", "damping_ratio", "delivered", "effective_modulus", "elastic_depth",
    "hertz_external", "hertz_internal", "restitution", "restitution_integrated", "restitution_linear", "step",
]  # fmt: skip
