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
    return method_with_displacement(log.grid, log.force is not None and not log.has_reconstructed_force)


def method_with_displacement(grid: tuple[int, int], measures_force: bool) -> str:
    """The same of arrays whose displacement is known, as of a live stream's frames, by their ``grid`` and whether they
    have forces that are measured.
    """
    return FEW_METHOD if measures_force and prod(grid) <= FEW_ELEMENTS else DEFAULT_METHOD
