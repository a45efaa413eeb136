"""Whether grasps slip as often as was asked, over a population of materials of which no two scatter alike."""

from datetime import UTC, datetime

import numpy as np
import pytest

import estimators
from benchmarks.estimators.scatter import AREA, CONTACT, Kind, achieved, grasp
from db.records import StoredModel
from service.domain.models.stored_results import to_new_model
from service.http.schemas.models import FrictionModelOut
from stiction_client import FrictionModel, required_normal_force

LOAD, ASKED, VELOCITY = 2.5, 0.1, 1e-3
GRASPS, MATERIALS = 8, 40


def as_a_planner_gets_it(fitted: estimators.FrictionModel) -> FrictionModel:
    stored = StoredModel(1, "paper", 1, True, False, datetime.now(UTC), to_new_model(fitted))
    return FrictionModel.from_json(FrictionModelOut.of(stored).model_dump(mode="json"))


@pytest.fixture(scope="module")
def population() -> list[tuple[Kind, FrictionModel]]:
    """Materials whose scatter between grasps is drawn from the prior, and what eight grasps of each tell."""
    made = []
    for seed in range(MATERIALS):
        rng = np.random.default_rng([seed, GRASPS])
        kind = Kind(between_grasps=0.07 * abs(rng.standard_t(7)), between_places=0.02, within=0.03)
        fitted = estimators.fit([grasp(kind, rng) for _ in range(GRASPS)], method="auto")
        made.append((kind, as_a_planner_gets_it(fitted)))
    return made


def slip(population: list[tuple[Kind, FrictionModel]], of: str | None) -> np.ndarray:
    """Probability that a new grasp of each material slips under the force that is told."""
    found = []
    for kind, model in population:
        told = required_normal_force(
            model, LOAD, ASKED, contact_area=CONTACT * AREA, tangential_velocity=VELOCITY, of=of
        )
        assert told.elements == (1.0 if of == "element" else pytest.approx(CONTACT))
        found.append(achieved(kind, LOAD / told.normal_force, (VELOCITY, told.element_force)))
    return np.array(found)


@pytest.mark.long
def test_a_planned_contact_slips_as_often_as_was_asked(population: list[tuple[Kind, FrictionModel]]) -> None:
    """Within three standard errors of the mean over materials: a grasp of each would err by √(p (1 − p)/n) more."""
    found = slip(population, None)
    error = found.std(ddof=1) / np.sqrt(MATERIALS)
    assert error < 0.2 * ASKED
    assert abs(found.mean() - ASKED) < 3.0 * error


def test_an_elements_quantile_is_far_on_the_safe_side_of_a_contacts(
    population: list[tuple[Kind, FrictionModel]],
) -> None:
    assert slip(population, "element").mean() < 0.4 * ASKED
