"""Which method of detection suits a log."""

from math import prod

from slipcore.defaults import DEFAULT_METHOD, FEW_ELEMENTS, FEW_METHOD, FORCES_METHOD
from slipcore.frames import GraspLog


def recommended_method(log: GraspLog) -> str:
    """The method that finds slip best in logs of this kind, by the scores of docs/sensors.md.

    "forces_only" without displacement; "coarse" for arrays of few elements that measure displacement and forces, too;
    "filter" for all others, those with reconstructed forces among them.
    """
    if not log.has_displacement:
        return FORCES_METHOD
    measured = log.force is not None and not log.has_reconstructed_force
    return FEW_METHOD if measured and prod(log.grid) <= FEW_ELEMENTS else DEFAULT_METHOD
