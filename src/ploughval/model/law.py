"""What the kernels of the march must know of soil, blade and rules, and of a band."""

from typing import NamedTuple


class Law(NamedTuple):
    """Angles in radians, lengths in mm; ``rides``, ``softened`` are 0 or 1."""

    peak: float
    residual: float
    mobilization: float
    wall: float
    repose: float
    rides: float
    softened: float = 0.0  # 1: a fresh band leaves in the direction that is cheapest once it has softened
    load: float = 0.0  # surcharge / unit weight
    face: float = 0.0  # tangent of the face's inclination, which ``wall`` includes
    bends: float | None = None  # a number: bands of two blocks too; None: the compiler leaves their code out


class Band(NamedTuple):
    """A band from the tip over a joint to its outcrop; of one block the joint is the tip, exactly."""

    outcrop: float
    slip: float
    joint_ahead: float  # of the tip
    joint_up: float
