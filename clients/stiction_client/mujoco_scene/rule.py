"""Which of MuJoCo's rules gave a contact its friction (mujoco.readthedocs.io, "Contact parameters")."""

from typing import Any, Literal

import mujoco

Rule = Literal["override", "pair", "priority", "max"]
"""Options of the scene that stand above all; a ``<pair>``; the geom of higher priority; the larger of both."""


def rule_of(model: Any, first: int, second: int) -> Rule:
    """The rule for a contact of the geoms ``first`` and ``second``, by their numbers."""
    if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
        return "override"
    if pair_of(model, first, second) is not None:
        return "pair"
    return "max" if model.geom_priority[first] == model.geom_priority[second] else "priority"


def pair_of(model: Any, first: int, second: int) -> int | None:
    """The number of the ``<pair>`` of two geoms; None without one."""
    named = zip(model.pair_geom1, model.pair_geom2, strict=True)
    return next((index for index, pair in enumerate(named) if set(map(int, pair)) == {first, second}), None)


def explanation(model: Any, first: int, second: int) -> str:
    """Where the sliding friction of the two geoms comes from, in words."""
    rule, names = rule_of(model, first, second), [geom_name(model, geom) for geom in (first, second)]
    values = [float(model.geom_friction[geom, 0]) for geom in (first, second)]
    if rule == "override":
        return "o_friction of the option element overrides every geom and pair"
    if rule == "pair":
        return f"the pair element of {names[0]} and {names[1]} decides alone"
    if rule == "priority":
        high = int(model.geom_priority[second] > model.geom_priority[first])
        ranks = [int(model.geom_priority[geom]) for geom in (first, second)]
        return (
            f"{names[high]} ({values[high]:g}) has priority {ranks[high]}, {names[1 - high]} ({values[1 - high]:g}) "
            f"only {ranks[1 - high]}"
        )
    return f"the larger of {names[0]} ({values[0]:g}) and {names[1]} ({values[1]:g})"


def geom_name(model: Any, geom: int) -> str:
    """Its name, or its number and its body's name."""
    return model.geom(geom).name or f"geom {geom} of body {model.body(int(model.geom_bodyid[geom])).name!r}"
