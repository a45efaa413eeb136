"""Loads that rise, fall, turn and repeat."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.plan.plan import Channel, History, Plan


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

    @property
    def absent(self) -> bool:
        """Whether all loads stay zero."""
        return not any((*self.normal_force, *self.force_x, *self.force_y, *self.moment))

    def extend(self, plan: Plan) -> Plan:
        """Add a history of each load that the path has."""
        channels: tuple[Channel, ...] = ("normal_force", "force_x", "force_y", "moment")
        paths = (self.normal_force, self.force_x, self.force_y, self.moment)
        added = [
            History(channel, *repeated(self.time, path, self.cycles))
            for channel, path in zip(channels, paths, strict=True)
            if path
        ]
        return replace(plan, histories=(*plan.histories, *added))


def repeated(
    time: tuple[float, ...], value: tuple[float, ...], cycles: int
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """A path gone through several times; it goes on from where it ended."""
    times, values = list(time), list(value)
    period = time[-1] - time[0] if time else 0.0
    for cycle in range(1, cycles):
        times += [t + cycle * period for t in time[1:]]
        values += list(value[1:])
    return tuple(times), tuple(values)
