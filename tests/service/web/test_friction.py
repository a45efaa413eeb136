"""Friction that pages show of a stored model, where no normal force is asked for, and far outside of the data."""

from dataclasses import replace
from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any

import pytest

import estimators
from db.records import StoredModel
from service.domain.models.stored_results import to_friction_model, to_new_model
from service.web.comparison import compare
from service.web.friction import friction_at, middle_force, sections
from tests.service.web.test_samples import grasp


def test_friction_is_shown_in_the_middle_of_the_forces_of_the_samples() -> None:
    stored: Any = SimpleNamespace(model=SimpleNamespace(normal_force=(0.02, 0.12)))
    assert middle_force(stored) == pytest.approx(0.07, rel=1e-12, abs=0.0)


def test_no_friction_below_0_is_shown_where_the_law_falls_so_far() -> None:
    """The law of these samples, 0.5 − 0.6 f_n, is below 0 from 0.83 N on."""
    model = to_new_model(estimators.fit([grasp(k) for k in range(4)], "hierarchical"))
    stored = StoredModel(
        1, "paper", 1, current=True, outdated=False, created_at=datetime(2026, 1, 2, tzinfo=UTC), model=model
    )
    assert float(to_friction_model(model).predict(0.0, 2.0)) < -0.5
    shown = friction_at(stored, 2.0)
    assert (shown.mean, shown.interval) == (None, None)
    assert shown.support.kind == "implausible"
    assert [each.friction.mean for each in compare([stored, replace(stored, id=2)], 2.0)] == [None, None]
    over_force, over_velocity = sections(stored, shown)
    assert (over_force.title, over_velocity.title) == ("At velocity 0 m/s", "At a normal force of 2.00 N")
    zero = next(tick.place for tick in over_force.y_ticks if tick.text == "0")
    heights = [float(point.split(",")[1]) for point in over_force.line.split()]
    assert heights[0] < zero == pytest.approx(max(heights), abs=0.1)  # downwards, as an SVG counts
