"""Slopes of one record of one place, by every method: not known, and what to record."""

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pytest

import estimators
from benchmarks.estimators import lasting_errors
from estimators.method_names import METHODS
from estimators.methods.identifiability import FEW_PLACES_ADVICE, INDEPENDENT_ADVICE, ONE_RECORD_ADVICE
from slipcore.samples import FrictionSamples
from stiction_client import FrictionModel, InvalidArgument, conservative_friction
from stiction_client.support import ONE_RECORD

Make = Callable[..., FrictionSamples]
OF_MOMENTS = ("ols", "conjugate", "hierarchical", "bayes", "auto")


def record(samples: Make, seed: int = 0, places: int = 1) -> FrictionSamples:
    """What would determine both slopes, were no error shared: errors are independent."""
    data = samples(400, scale=0.004, seed=seed)
    return replace(data, element=np.arange(400) % places, time=np.arange(400) / 60.0)


@pytest.mark.parametrize("method", METHODS)
def test_slopes_of_one_record_of_one_place_are_not_known(samples: Make, method: str) -> None:
    data = [record(samples)] + [estimators.Moments.from_samples(record(samples))] * (method in OF_MOMENTS)
    for each in data:
        model = estimators.fit(each, method=method)
        assert not model.identifiable[1:].any()
        assert ONE_RECORD_ADVICE in model.notes


@pytest.mark.parametrize("method", METHODS)
def test_several_grasps_or_places_may_determine_slopes(samples: Make, method: str) -> None:
    for data in ([record(samples, seed) for seed in range(6)], record(samples, places=20))[
        : 1 + (method != "conjugate")
    ]:
        model = estimators.fit(data, method=method)
        assert model.identifiable[1:].all()
        assert ONE_RECORD not in model.diagnostics


def test_moments_that_know_of_no_places_do_not_count_as_of_one(samples: Make) -> None:
    unknown = estimators.Moments.from_samples(record(samples), places=False)
    assert ONE_RECORD not in estimators.fit(unknown, method="hierarchical").diagnostics


def test_its_weight_in_merged_moments_is_no_longer_alone(samples: Make) -> None:
    both = [estimators.Moments.from_samples(record(samples, seed)) for seed in (0, 1)]
    for data in (both, both[0].merge(both[1])):
        assert ONE_RECORD not in estimators.fit(data, method="hierarchical").diagnostics
    nothing = estimators.Moments.empty(both[0].element_area)
    assert ONE_RECORD in estimators.fit([both[0], nothing], method="hierarchical").diagnostics


@pytest.mark.parametrize("method", METHODS)
def test_what_a_planner_exports_is_refused_unless_allowed(samples: Make, method: str) -> None:
    found = estimators.fit(record(samples), method=method)
    told = {entry.name: getattr(found, entry.name) for entry in fields(found) if entry.name != "draws"}
    model = FrictionModel(**told, material="paper", version=1)
    force = 0.5 * sum(model.domain.normal_force)
    with pytest.raises(InvalidArgument, match="not identified"):
        conservative_friction(model, force)
    assert 0.0 < conservative_friction(model, force, allow_unidentified=True) < 0.6


@pytest.mark.parametrize("places", [2, 3, 10])
def test_slopes_of_places_whose_errors_last_are_held_where_they_count_as_known(places: int) -> None:
    """By intervals of 95 %; in half of the grasps, were stretches of time independent."""
    held = []
    for seed in range(40):
        data = lasting_errors.grasp(np.random.default_rng([seed, places]), places)
        low, high = estimators.fit(estimators.Moments.from_samples(data), method="hierarchical").interval().T
        held.append((low <= lasting_errors.LAW) & (high >= lasting_errors.LAW))
    assert (np.mean(held, axis=0) >= 0.9).all()


@pytest.mark.parametrize("method", ["hierarchical", "bayes", "auto"])
def test_two_places_whose_errors_last_say_to_record_more(method: str) -> None:
    data = lasting_errors.grasp(np.random.default_rng(0), 2, error=0.05)
    model = estimators.fit(estimators.Moments.from_samples(data), method=method)
    assert not model.identifiable[1:].all()
    assert FEW_PLACES_ADVICE in model.notes


def test_two_places_whose_errors_are_independent_determine_slopes(samples: Make) -> None:
    for seed in range(5):
        model = estimators.fit(estimators.Moments.from_samples(record(samples, seed, places=2)), method="auto")
        assert model.identifiable[1:].all()
        assert ONE_RECORD not in model.diagnostics


def test_what_few_places_leave_open_shrinks_with_the_number_of_grasps() -> None:
    moments = estimators.Moments.from_samples(lasting_errors.grasp(np.random.default_rng(1), 2))
    told = [np.linalg.norm(moments.grasps[0].among(grasps).within[:2, :2]) for grasps in (1, 2, 5, 1000)]
    assert told == sorted(told)
    assert told[0] < 0.9 * told[-1]
    assert told[-1] == pytest.approx(np.linalg.norm(moments.grasps[0].within[:2, :2]), rel=1e-2)


@pytest.mark.parametrize(("method", "of_samples"), [("ols", False), ("conjugate", False), ("conjugate", True)])
def test_slopes_of_one_grasp_are_not_known_where_its_errors_are_taken_as_independent(
    samples: Make, method: str, of_samples: bool
) -> None:
    grasp = record(samples, places=20)
    model = estimators.fit(grasp if of_samples else estimators.Moments.from_samples(grasp), method=method)
    assert model.identifiable.tolist() == [method == "conjugate", False, False]  # how much others differ is in ols
    assert INDEPENDENT_ADVICE in model.notes


def test_who_sees_the_places_of_one_grasp_is_not_told_that_its_errors_are_taken_as_independent(samples: Make) -> None:
    grasp = record(samples, places=20)
    for method, data in (("ols", grasp), ("hierarchical", estimators.Moments.from_samples(grasp))):
        assert ONE_RECORD not in estimators.fit(data, method=method).diagnostics
