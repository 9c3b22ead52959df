"""What kinematics complains of."""


class KinematicsError(ValueError):
    """The linkage cannot be assembled, or is singular (a dead centre) where it must not be."""
