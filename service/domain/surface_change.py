"""Whether a material's surface has changed, by the logs that its models are fitted to."""

from collections.abc import Sequence
from dataclasses import replace

from estimators import FrictionModel, Moments, ScatterPrior
from estimators.change_alarm import ChangeAlarm, watched
from estimators.linear.priors import WEAK

MARK = "surface_change"
"""Diagnostic of a model in whose data the surface has changed."""


def with_change(
    models: Sequence[FrictionModel], logs: Sequence[Moments], prior: ScatterPrior = WEAK
) -> list[FrictionModel]:
    """The models, marked where friction of the newest ``logs``, oldest first, is another than of those before.

    The first of the models that separates scatter between grasps is the law; without such a model nothing is marked.
    ``prior``: what is expected of that scatter.
    """
    law = next((model for model in models if model.scales is not None), None)
    if law is None:
        return list(models)
    grasps = [grasp for log in logs for grasp in log.at_element_area(law.element_area).grasps]
    alarm = watched(law, grasps, scatter_prior=prior)
    if not alarm.changed:
        return list(models)
    told = _sentence(alarm)
    return [replace(model, diagnostics={**model.diagnostics, MARK: told}) for model in models]


def _sentence(alarm: ChangeAlarm) -> str:
    before = alarm.since or 0
    after = len(alarm.levels) - before
    way = "lower" if alarm.change < 0.0 else "higher"
    newest = "the newest grasp" if after == 1 else f"the newest {after} grasps"
    return f"friction of {newest} is {abs(alarm.change):.0%} {way} than of the {before} before"
