"""Whether a material's surface has changed, by the logs that its models are fitted to."""

from collections.abc import Sequence
from dataclasses import replace

from estimators import FrictionModel, Moments, ScatterPrior
from estimators.change_alarm import ChangeAlarm, noticeable, watched
from estimators.defaults import ALARM
from estimators.linear.priors import WEAK
from stiction_client.support import UNNOTICED

MARK = "surface_change"
"""Diagnostic of a model in whose data the surface has changed."""
NOTICEABLE = "noticeable_change"
"""Diagnostic of any other, of enough grasps: the fall of friction, as a part of it, that five more would show."""


def with_change(
    models: Sequence[FrictionModel], logs: Sequence[Moments], prior: ScatterPrior = WEAK
) -> list[FrictionModel]:
    """The models, marked where friction of the newest ``logs``, oldest first, is another than of those before; else
    with the fall of friction that would be noticed soon, and a sentence where that is more than matters to a grip.

    The first of the models that separates scatter between grasps is the law; without such a model nothing is marked.
    ``prior``: what is expected of that scatter.
    """
    law = next((model for model in models if model.scales is not None), None)
    if law is None:
        return list(models)
    grasps = [grasp for log in logs for grasp in log.at_element_area(law.element_area).grasps]
    alarm = watched(law, grasps, scatter_prior=prior)
    marks: dict[str, float | str] = {MARK: _sentence(alarm)} if alarm.changed else _limits(alarm)
    return [replace(model, diagnostics={**model.diagnostics, **marks}) for model in models] if marks else list(models)


def _limits(alarm: ChangeAlarm) -> dict[str, float | str]:
    """What the alarm would notice within a few grasps; nothing of fewer grasps than it needs before a change."""
    grasps = len(alarm.levels)
    if grasps < alarm.reference:
        return {}
    fall = noticeable(alarm)
    if grasps < ALARM.settled or fall <= alarm.shift:
        return {NOTICEABLE: fall}
    note = (
        f"grasps of this material differ so much that a fall of its friction by less than {fall:.0%} is likely to go "
        f"unnoticed for {ALARM.soon} grasps: look at the surface yourself, and record in one way"
    )
    return {NOTICEABLE: fall, UNNOTICED: note}


def _sentence(alarm: ChangeAlarm) -> str:
    before = alarm.since or 0
    after = len(alarm.levels) - before
    way = "lower" if alarm.change < 0.0 else "higher"
    newest = "the newest grasp" if after == 1 else f"the newest {after} grasps"
    return f"friction of {newest} is {abs(alarm.change):.0%} {way} than of the {before} before"
