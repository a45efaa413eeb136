"""A reduced contact for closed loops: ``init`` and ``step`` a world, ``observe`` what its sensors see."""

from slipcore.contact.reduced.world import GRAVITY, Load, World, WorldState, init, observe, step, stick_ratio

__all__ = ["GRAVITY", "Load", "World", "WorldState", "init", "observe", "step", "stick_ratio"]
