"""The campaign of one speed: its oracle, its population and how slip is made to be of one speed."""

import numpy as np
import pytest
from scipy import special

import estimators
from benchmarks.estimators.next_grasp import Material
from benchmarks.estimators.one_speed import COLUMNS, KIND, REST, SLIP, figures, least, outcome, outcomes, row
from benchmarks.estimators.scatter import ASKED, CONTACT, TRUTH, Kind, achieved, grasp


def test_slip_is_at_the_speeds_that_its_name_says() -> None:
    seen = {
        name: grasp(KIND, np.random.default_rng(0), TRUTH, speeds).tangential_velocity for name, speeds in SLIP.items()
    }
    assert seen["5 mm/s"].mean() == pytest.approx(5e-3, rel=1e-3)
    assert seen["5 mm/s"].std() == pytest.approx(5e-6, rel=0.1)
    assert {*np.unique(seen["4.95 and 5.05 mm/s"]).tolist()} == {4.95e-3, 5.05e-3}
    as_ever = grasp(KIND, np.random.default_rng(0)).tangential_velocity
    np.testing.assert_array_equal(seen["as the rim slips"], as_ever)


def test_friction_of_a_grasp_is_that_of_its_law_at_its_speeds() -> None:
    law = np.array([0.6, -20.0, 0.3])
    data = grasp(Kind(within=0.0), np.random.default_rng(0), law, SLIP["5 mm/s"])
    expected = law @ [np.ones(len(data)), data.tangential_velocity, data.normal_force]
    np.testing.assert_allclose(data.friction_coefficient, expected, rtol=1e-12)


def test_who_knows_all_slips_nearly_as_often_as_asked() -> None:
    law = np.array([0.6, -20.0, 0.3])
    told = least(float(law @ [1.0, *REST]))
    assert achieved(KIND, told, REST, law) == pytest.approx(ASKED[0], rel=0.2)


def test_an_outcome_is_the_models_at_rest() -> None:
    law = Material.drawn(np.random.default_rng(3)).law
    data = [grasp(KIND, np.random.default_rng(k), law, SLIP["5 mm/s"]) for k in range(2)]
    model = estimators.fit(data, method="hierarchical")
    found = outcome(model, law)
    at = np.array([1.0, *REST])
    half = special.stdtrit(model.degrees_of_freedom, 0.975) * np.sqrt(at @ model.covariance @ at)
    assert found.width == pytest.approx(half / (law @ at))
    told = float(model.predict(*REST, 0.01, "contact", CONTACT))
    assert found.counted_on == pytest.approx(told / least(float(law @ at)))
    assert found.held == (abs(model.predict(*REST) - law @ at) <= half)


def test_the_prior_makes_no_difference_where_velocity_is_seen_and_all_where_it_is_not() -> None:
    names = dict(enumerate(COLUMNS))
    for name, same in (("as the rim slips", True), ("5 mm/s", False)):
        cells = dict(zip(names.values(), row(name, 2, range(2)), strict=True))
        with_prior, without = str(cells["half-width, %"]).split()
        assert (with_prior == without) is same


def test_figures_are_means_and_medians_of_the_materials() -> None:
    found = list(outcomes(SLIP["5 mm/s"], 2, range(3)))
    told = figures(found)
    assert told[0] == f"{100.0 * np.mean([each.held for each in found]):.0f}"
    assert told[-1] == "100"
