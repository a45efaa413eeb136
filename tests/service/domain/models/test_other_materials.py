"""What other materials of a sensor say of one."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import pytest

import estimators
from db.records import NewModel, StoredModel
from db.repositories import friction_models
from service.domain.models.other_materials import prior_from_others


def test_models_of_the_separating_method_count_unless_their_surface_changed(
    new_model: NewModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []

    def of_same_sensors(*given: Any) -> list[StoredModel]:
        asked.append(given)
        changed = replace(new_model, scale=0.2, diagnostics={"surface_change": "friction is lower"})
        models = (new_model, changed, replace(new_model, scale=0.3))
        return [StoredModel(k, "x", 1, True, False, datetime.now(UTC), each) for k, each in enumerate(models)]

    def population_scatter(models: Any) -> Any:
        return [model.scale for model in models]

    monkeypatch.setattr(friction_models, "of_same_sensors", of_same_sensors)
    monkeypatch.setattr(estimators, "population_scatter", population_scatter)
    session: Any = object()
    found: Any = prior_from_others(session, 7)
    assert found == [0.02, 0.3]
    assert asked == [(session, 7, "hierarchical", 100)]
