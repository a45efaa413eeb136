"""Which model answers who names no method."""

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from db.database import Database
from db.records import NewModel, StoredModel
from db.repositories import friction_models, jobs, materials
from service.domain.errors import NoModel
from service.domain.models.model_cache import ModelCache
from service.domain.models.recommended import recommended


def stored(model: NewModel, method: str, **diagnostics: str) -> StoredModel:
    told = replace(model, method=method, diagnostics=diagnostics)
    return StoredModel(1, "paper", 1, True, False, datetime.now(UTC), told)


@pytest.mark.parametrize(
    ("methods", "best"),
    [
        (("ols", "hierarchical", "bayes"), "hierarchical"),
        (("robust", "ols", "bayes"), "bayes"),
        (("robust", "ols", "conjugate"), "ols"),
        (("robust",), "robust"),
    ],
)
def test_the_model_that_tells_grasps_apart_is_recommended_first(
    new_model: NewModel, methods: tuple[str, ...], best: str
) -> None:
    found = recommended([stored(new_model, method) for method in methods])
    assert found is not None
    assert found.stored.model.method == best
    assert found.because.startswith(f"{best}: ")
    assert (best == "hierarchical") != ("ask for a fit by auto" in found.because)


def test_a_posterior_that_takes_samples_for_independent_is_never_recommended(new_model: NewModel) -> None:
    assert recommended([stored(new_model, "conjugate")]) is None
    assert recommended([]) is None


def test_the_reason_is_the_fits_own(new_model: NewModel) -> None:
    found = recommended([stored(new_model, "hierarchical", chosen_because="a sample lies off", check="ols agrees")])
    assert found is not None
    assert found.because == "hierarchical: a sample lies off; ols agrees"


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_a_model_in_memory_gives_way_to_one_that_is_recommended_more(database: Database, new_model: NewModel) -> None:
    cache = ModelCache(60.0)

    def store(method: str) -> None:
        with database.write() as session:
            job = jobs.add(session, "fit", method, material_id=material)
            friction_models.add(session, material, job, replace(new_model, method=method))
        cache.seen()

    with database.write() as session:
        material = materials.create(session, "paper", "").id
    with pytest.raises(NoModel, match="no model fitted by 'auto'"):
        cache.read(database, "paper", "auto")
    for method in ("ols", "hierarchical"):
        store(method)
        assert cache.fresh("paper", "auto") is None
        known = cache.read(database, "paper", "auto")
        assert (known.stored.model.method, known.because is not None) == (method, True)
    assert cache.read(database, "paper", "ols").because is None
