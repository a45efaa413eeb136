"""What is taken where a planner does not say it, wherever it is asked."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import pytest

import estimators
from db.records import NewModel, StoredModel
from estimators import NextGrasp, Probing, WorkingPoint
from estimators.defaults import DESIGN
from service.domain.errors import InvalidValue
from service.domain.planning.record_next import record_next
from service.http.schemas.models import NextGraspQuery


@pytest.mark.parametrize("name", ["quantile", "elements", "drop_probability"])
def test_the_web_asks_for_the_same_grasp_as_the_package(name: str) -> None:
    assert getattr(NextGraspQuery(), name) == getattr(DESIGN, name)


def test_the_grasps_behind_a_model_count_where_it_tells_them_apart(
    new_model: NewModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[object, object, int]] = []

    def next_grasp(_: object, point: object, probing: object, recorded: int) -> NextGrasp:
        asked.append((point, probing, recorded))
        return NextGrasp(0.05, 5e-4, 4e-3, 0.0, 1.0, 0.03, 0.02, 0.4)

    monkeypatch.setattr(estimators, "next_grasp", next_grasp)
    cases: list[tuple[dict[str, float | str | None], int]] = [
        ({"clusters": 7.0, "cluster_kind": "grasp"}, 7),
        ({"clusters": 7.0, "cluster_kind": "element"}, 1),
        ({"cluster_kind": "grasp"}, 1),
        ({}, 1),
    ]
    for told, count in cases:
        model = StoredModel(1, "paper", 3, True, False, datetime.now(UTC), replace(new_model, diagnostics=told))
        answer = record_next(model, 0.05, 1e-3, 0.05, 30, 1.5, 1e-4)
        assert (answer.material, answer.method, answer.version, answer.normal_force) == ("paper", "ols", 3, 0.05)
        assert asked.pop() == (WorkingPoint(0.05, 1e-3, 0.05, 30), Probing(load=1.5, drop_probability=1e-4), count)


def test_a_model_that_is_outdated_supports_less(new_model: NewModel) -> None:
    model = StoredModel(1, "paper", 3, True, False, datetime.now(UTC), new_model)
    assert record_next(model, 0.05, 0.0).support != "stale"
    told = record_next(replace(model, outdated=True), 0.05, 0.0)
    assert (told.support, told.advice != record_next(model, 0.05, 0.0).advice) == ("stale", True)


def test_notes_of_the_model_and_the_sensor_that_grasps_are_told_beside_the_grasp(new_model: NewModel) -> None:
    known = replace(new_model, diagnostics={"sensor": "left", "weakening": "a log lowers it"})
    model = StoredModel(1, "paper", 3, True, False, datetime.now(UTC), known)
    assert record_next(model, 0.05, 0.0, sensor="left").notes == ("a log lowers it",)
    assert "none by 'right'" in record_next(model, 0.05, 0.0, sensor="right").notes[1]
    middle = 0.5 * sum(known.normal_force)
    assert record_next(model, None, 0.0) == record_next(model, middle, 0.0)


@pytest.mark.parametrize("name", ["quantile", "elements", "load"])
def test_what_cannot_be_asked_is_told_by_its_name(new_model: NewModel, name: str) -> None:
    model = StoredModel(1, "paper", 3, True, False, datetime.now(UTC), new_model)
    wrong: Any = {name: -1 if name != "load" else 1e6}
    with pytest.raises(InvalidValue) as refusal:
        record_next(model, 0.05, 0.0, **wrong)
    assert refusal.value.name == name
