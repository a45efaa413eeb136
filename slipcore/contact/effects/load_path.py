"""Loads that rise, fall, turn and repeat."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Channel, History, Plan
from slipcore.errors import InvalidInput

PATHS: tuple[Channel, ...] = ("normal_force", "force_x", "force_y", "moment")


@dataclass(frozen=True, slots=True)
class LoadPath:
    """Loads added to the scene's: piecewise linear between ``time`` s, empty for what does not change.

    ``normal_force``, ``force_x``, ``force_y`` N and ``moment`` N·m, each of the length of ``time`` or empty; the part
    after the first time is gone through ``cycles`` times.
    """

    time: tuple[float, ...]
    normal_force: tuple[float, ...] = ()
    force_x: tuple[float, ...] = ()
    force_y: tuple[float, ...] = ()
    moment: tuple[float, ...] = ()
    cycles: int = 1

    why: ClassVar[str] = "traction keeps a memory of the path: unloading and reversal do not retrace it"
    cost: ClassVar[str] = "steps that end where the path bends"

    def __post_init__(self) -> None:
        check_path(self, PATHS)
        if not any(len(getattr(self, load)) for load in PATHS):
            raise InvalidInput("loads of LoadPath", "none", f"one or more of {', '.join(PATHS)}, a value for each time")

    @property
    def absent(self) -> bool:
        """Whether all loads stay zero."""
        return not any((*self.normal_force, *self.force_x, *self.force_y, *self.moment))

    def extend(self, plan: Plan) -> Plan:
        """Add a history of each load that the path has."""
        return with_paths(plan, self, PATHS, PATHS)


def with_paths(plan: Plan, path: Any, channels: Sequence[Channel], names: Sequence[str]) -> Plan:
    """The plan with a history in each channel for which an effect with ``time`` and ``cycles`` has values by a name."""
    added = [
        History(channel, *repeated(path.time, values, path.cycles))
        for channel, name in zip(channels, names, strict=True)
        if len(values := getattr(path, name))
    ]
    return replace(plan, histories=(*plan.histories, *added))


def check_path(path: Any, names: Sequence[str]) -> None:
    """Raises ``InvalidInput`` for an effect with ``time`` and ``cycles`` whose values by these names, where it has any,
    are not as many as its times, and for less than one cycle.
    """
    check_own_types(path)
    kind, count = type(path).__name__, len(path.time)
    for name in names:
        given = len(getattr(path, name))
        if given not in (0, count):
            raise InvalidInput(f"{name} of {kind}", f"{given} values", f"one for each time, {count}, or none")
    if path.cycles < 1:
        raise InvalidInput(f"cycles of {kind}", path.cycles, "a whole number, 1 or more")


def repeated(
    time: tuple[float, ...], value: tuple[float, ...], cycles: int
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """A path gone through several times; it goes on from where it ended."""
    times, values = list(time), list(value)
    period = time[-1] - time[0] if len(time) else 0.0
    for cycle in range(1, cycles):
        times += [t + cycle * period for t in time[1:]]
        values += list(value[1:])
    return tuple(times), tuple(values)
