"""The campaign's own figures: a wrong oracle would make any prior look good."""

import numpy as np
import pytest
from scipy import special

from benchmarks.estimators import population
from benchmarks.estimators.population import Cell, least, new_material, row, scatters, slips
from benchmarks.estimators.scatter import CONTACT, TRUTH, WORKING_POINT
from estimators import ScatterPrior


def test_who_knows_all_slips_as_often_as_asked() -> None:
    for tau in (0.01, 0.05, 0.24):
        assert slips(scatters(tau), least(scatters(tau), 1e-3)) == pytest.approx(1e-3, rel=1e-6)


def test_without_scatter_between_grasps_slips_are_those_of_a_normal() -> None:
    mean = TRUTH @ [1.0, *WORKING_POINT]
    deviation = np.sqrt((0.02**2 + 0.03**2) / CONTACT)
    assert slips(scatters(0.0), mean + special.ndtri(0.01) * deviation) == pytest.approx(0.01, rel=1e-9)


def test_a_sharper_prior_asks_for_less_force(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(population, "GRASPS", (1,))
    priors = [ScatterPrior(), ScatterPrior(0.05, 12.0, 10)]
    ((weak, sharp),) = new_material(scatters(0.05), priors, np.random.default_rng(0))
    assert (sharp[1] < weak[1]).all()
    assert (sharp[0] > weak[0]).all()


def test_a_quantile_of_none_is_told_as_such() -> None:
    force = np.array([[1.5, np.inf], [1.7, np.inf], [1.6, 3.0]])
    cell = Cell(0.05, "drawn", 1, 3, np.full((3, 2), 0.25), force)
    assert cell.figures() == ["0.25", "0.25", "1.60", "none"]
    assert row((cell, cell)) == ("0.05", "drawn", 1, "0.25 0.25", "0.25 0.25", "1.60 1.60", "none none")
    assert cell.record()["none"] == [0.0, pytest.approx(2 / 3)]
