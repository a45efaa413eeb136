"""A sensor's own forces beside those by its gel: an independent solver's, by the right gel and by wrong ones."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipcore import GraspLog, InvalidInput, NoForces
from slipcore.forces import Gel, Reconstruction, compare_forces, reconstruct

GEL = {"young_modulus": 1e6, "poisson_ratio": 0.49, "thickness": 5e-3}
Pressed = Callable[..., GraspLog]


@pytest.fixture(scope="module")
def log(pressed: Pressed) -> GraspLog:
    return pressed([3, 6], noise=1e-6)


@pytest.fixture(scope="module")
def found(log: GraspLog) -> Reconstruction:
    return reconstruct(log, Gel.from_json(GEL), noise=1e-6)


def test_by_the_right_gel_both_are_one_field(log: GraspLog, found: Reconstruction) -> None:
    compared = compare_forces(log, found)
    for each in (compared.total_normal, compared.total_tangential):
        assert each.ratio == pytest.approx(1.0, abs=0.005)  # as far as the forces themselves are met
        assert each.correlation > 0.9999
    assert compared.normal.ratio == pytest.approx(1.0, abs=0.01)
    assert compared.normal.correlation > 0.999
    assert compared.tangential.correlation > 0.99


def test_a_wrong_modulus_shows_in_all_ratios_alike_and_a_wrong_thickness_does_not(
    log: GraspLog, found: Reconstruction
) -> None:
    right, soft = compare_forces(log, found), replace(found, force=found.force / 2.0)
    halved = compare_forces(log, soft)
    for name in ("normal", "tangential", "total_normal", "total_tangential"):
        assert getattr(halved, name).ratio == pytest.approx(2.0 * getattr(right, name).ratio, rel=1e-12)
        assert getattr(halved, name).correlation == pytest.approx(getattr(right, name).correlation, rel=1e-12)
    thin = compare_forces(log, reconstruct(log, Gel.from_json(GEL | {"thickness": 3e-3}), noise=1e-6))
    assert thin.total_normal.ratio < 0.8 * thin.total_tangential.ratio


def test_nothing_is_told_where_one_is_zero_throughout(log: GraspLog, found: Reconstruction) -> None:
    compared = compare_forces(log, replace(found, force=np.zeros_like(found.force)))
    assert np.isnan([compared.normal.ratio, compared.total_tangential.correlation]).all()


def test_a_log_needs_forces_of_its_own_and_the_reconstruction_is_its_own(
    log: GraspLog, found: Reconstruction, pressed: Pressed
) -> None:
    with pytest.raises(NoForces, match="the log has none"):
        compare_forces(replace(log, force=None), found)
    with pytest.raises(InvalidInput, match="reconstruction is of shape"):
        compare_forces(pressed([1, 3, 6]), found)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"young_modulus": 1e6}, "gel is without poisson_ratio; allowed: numbers named young_modulus, poisson_ratio, "),
        ({**GEL, "hardness": 3.0}, "gel is with the unknown 'hardness'; allowed: numbers named"),
        ({**GEL, "poisson_ratio": "0.4"}, "poisson_ratio is '0.4'; allowed: a number"),
        ({**GEL, "thickness": True}, "thickness is True; allowed: a number"),
        ({**GEL, "marker_depth": None}, "marker_depth is None; allowed: a number"),
        ([1e6, 0.49], "gel is .*; allowed: numbers named young_modulus"),
        ({**GEL, "poisson_ratio": 0.6}, "poisson_ratio is 0.6"),
    ],
)
def test_a_gel_that_is_none_is_refused_by_name(told: Any, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        Gel.from_json(told)


def test_a_gel_without_thickness_is_a_half_space() -> None:
    assert Gel.from_json({**GEL, "thickness": None}) == Gel(1e6, 0.49)
