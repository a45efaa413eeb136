"""What to record next: closed forms of the design, and what it chooses."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimators import (
    Cost,
    Domain,
    FrictionModel,
    InvalidSamples,
    Probing,
    Scale,
    Scales,
    SensorScale,
    WorkingPoint,
    next_grasp,
)
from estimators.grasp_design import GOLDEN_ANGLE, SPEEDS, Designs, _forces, scatter, updated

POINT = WorkingPoint(0.1)


def model(covariance: np.ndarray | None = None, scales: Scales | None = None) -> FrictionModel:
    return FrictionModel(
        method="hierarchical",
        coefficients=np.array([0.45, 8.0, -0.8]),
        covariance=np.diag([4e-4, 4.0, 0.04]) if covariance is None else covariance,
        scale=0.05,
        n=1000,
        degrees_of_freedom=8.0,
        scatter_degrees_of_freedom=100.0,
        domain=Domain((2e-4, 4e-3), (0.05, 0.2)),
        identifiable=np.ones(3, dtype=bool),
        element_area=1e-6,
        cost=Cost(0.0),
        scales=scales or Scales(Scale(0.05, 8.0), Scale(0.02, 50.0), Scale(0.03, 900.0)),
    )


def test_information_is_that_of_the_grasps_covariance() -> None:
    """XᵀV⁻¹X with V written out: one row a place, its variance on the diagonal and τ² (Xβ)(Xβ)ᵀ in common."""
    known, probing = model(), Probing(slipping=1.0)
    designs = Designs.of(np.array([0.1, 0.3]), 16, replace(probing, speed=(2e-3, 5e-2), length=(1e-3, 2e-3)))
    x, count = designs.places()
    assert (len(designs.seconds), count.sum()) == (8, 16)
    for k, root in enumerate(designs.roots(known)):
        rows = np.repeat(x[k], count.astype(int), axis=0)
        law = rows @ known.coefficients
        frames = max(30.0 * designs.length[k] / designs.speed[k], 1.0)  # a quick slip is seen once
        covariance = (0.02**2 + 0.03**2 / frames) * np.eye(16) + 0.05**2 * np.outer(law, law)
        np.testing.assert_allclose(root.T @ root, rows.T @ np.linalg.solve(covariance, rows), rtol=1e-10)


def test_an_update_is_bayes_rule_also_where_nothing_is_uncertain() -> None:
    covariance, roots = model().covariance, np.sqrt(np.diag([1e3, 1e-2, 10.0]))
    np.testing.assert_allclose(
        updated(covariance, roots), np.linalg.inv(np.linalg.inv(covariance) + roots**2), rtol=1e-12, atol=1e-18
    )
    assert (updated(np.zeros((3, 3)), roots) == 0.0).all()


def test_the_grasp_is_the_best_of_all_that_can_be_made_worked_out_one_by_one() -> None:
    known, probing = model(), Probing(normal_force=(0.05, 0.4), length=(1e-3,))
    point, found = np.array([1.0, 0.0, 0.1]), next_grasp(known, POINT, probing)
    now, gain = math.sqrt(point @ known.covariance @ point), {}
    for force in np.append(np.geomspace(0.05, 0.4, 25), 0.1):
        for speed in SPEEDS:
            one = Designs(np.array([force]), np.array([speed]), np.array([1e-3]), POINT.elements, probing)
            (root,) = one.roots(known)
            after = np.linalg.inv(np.linalg.inv(known.covariance) + root.T @ root)
            gain[float(force), float(speed)] = (now - math.sqrt(point @ after @ point)) / (4.0 + 1e-3 / speed)
    best = max(gain, key=gain.__getitem__)
    assert (found.normal_force, found.speed) == pytest.approx(best)
    assert (found.uncertainty - found.after) / found.uncertainty * now / found.seconds == pytest.approx(gain[best])


def test_a_slope_is_asked_for_far_out_and_a_level_where_it_is_needed() -> None:
    """Elfving: a line through a known point is told best far out; where nothing is known, at the point itself."""
    slope, level = np.diag([1e-8, 1e-8, 0.25]), np.diag([1.0, 1e-8, 4.0])
    for force in (0.03, 0.35):
        assert next_grasp(model(slope), WorkingPoint(force)).normal_force >= 0.35
        assert next_grasp(model(level), WorkingPoint(force)).normal_force == pytest.approx(force, rel=0.3)


def test_a_grasp_that_presses_harder_than_any_before_says_so() -> None:
    told = next_grasp(model(np.diag([1e-8, 1e-8, 0.25])), WorkingPoint(500.0))
    assert told.normal_force > 0.2
    assert told.beyond == (
        f"{told.normal_force:.4g} N an element is more than any grasp had so far (0.2): "
        "make sure that sensor and object bear it"
    )
    assert next_grasp(model(np.diag([1.0, 1e-8, 4.0])), WorkingPoint(0.1)).beyond is None


def test_what_sensors_differ_by_is_not_expected_to_be_told_by_one_grasp() -> None:
    scales = model().scales
    assert scales is not None
    several = model(scales=replace(scales, between_sensors=SensorScale(Scale(0.12, 4.0), {})))
    assert scatter(several)[0] == pytest.approx(0.13)
    assert next_grasp(several, POINT).after > next_grasp(model(), POINT).after


def test_a_quick_grasp_is_worth_more_where_slip_tells_nothing_of_it() -> None:
    """Without scatter within and between places all slips tell the same: the shortest is taken."""
    scales = Scales(Scale(0.05, 8.0), Scale(0.0, 50.0), Scale(1e-6, 900.0))
    found = next_grasp(model(np.diag([1e-3, 0.0, 0.0]), scales), POINT)
    assert (found.slip_length, found.speed) == (5e-4, 4e-3)
    assert found.seconds == pytest.approx(4.0 + 0.125)


def test_a_load_asks_for_forces_that_hold_it_and_one_too_great_is_refused() -> None:
    known = model()
    probing = Probing(load=1.0)
    found = next_grasp(known, WorkingPoint(0.05), probing)
    held = float(known.predict(0.0, found.normal_force, 1e-3, "contact", 60)) * found.normal_force * 60
    assert held >= 1.0
    with pytest.raises(InvalidSamples, match="load is 1000000"):
        next_grasp(known, POINT, replace(probing, load=1e6))


def test_directions_are_spread_over_the_circle() -> None:
    found = np.sort([next_grasp(model(), POINT, grasps=count).direction for count in range(8)])
    gaps = np.diff([*found, found[0] + 2.0 * math.pi])
    assert gaps.max() < 2.7 * gaps.min()
    assert next_grasp(model(), POINT, grasps=1).direction == pytest.approx(GOLDEN_ANGLE)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_the_choice_does_not_depend_on_the_unit_of_force(unit: float) -> None:
    known, scaling = model(), np.array([1.0, 1.0, 1.0 / unit])
    same = replace(
        known,
        coefficients=known.coefficients * scaling,
        covariance=known.covariance * np.outer(scaling, scaling),
        domain=Domain((2e-4, 4e-3), (0.05 * unit, 0.2 * unit)),
    )
    found, expected = next_grasp(same, WorkingPoint(0.1 * unit)), next_grasp(known, POINT)
    assert found.normal_force == pytest.approx(expected.normal_force * unit)
    assert (found.speed, found.slip_length) == (expected.speed, expected.slip_length)
    assert found.after == pytest.approx(expected.after)


@pytest.mark.parametrize(
    "known",
    [
        model(np.zeros((3, 3))),
        model(scales=Scales(Scale(0.0, 8.0), Scale(0.0, 8.0), Scale(0.0, 8.0))),
        replace(model(), coefficients=np.zeros(3)),
        replace(model(), scales=None),
        replace(model(), domain=Domain((1e-3, 1e-3), (0.1, 0.1))),
        replace(model(), domain=Domain((0.0, 4e-3), (0.0, 0.2))),
    ],
    ids=["all known", "no scatter", "no friction", "no scales", "one point", "from no force on"],
)
def test_hard_cases_have_an_answer(known: FrictionModel) -> None:
    found = next_grasp(known, POINT)
    assert 0.0 <= found.after <= found.uncertainty * (1.0 + 1e-12)
    assert found.normal_force > 0.0


@pytest.mark.parametrize("seed", range(20))
def test_no_model_is_too_exact_or_too_vague(seed: int) -> None:
    """Variances over forty decades, in directions of their own: an inverse of 1 + ΣM fails in every third."""
    generator = np.random.default_rng(seed)
    root = generator.standard_normal((3, 3)) * 10.0 ** generator.uniform(-17.0, 4.0, 3)
    scales = Scales(*(Scale(10.0**power, 8.0) for power in generator.uniform(-20.0, 0.0, 3)))
    found = next_grasp(model(root @ root.T * np.outer([1.0, 30.0, 3.0], [1.0, 30.0, 3.0]), scales), POINT)
    assert 0.0 <= found.after <= found.uncertainty * (1.0 + 1e-9)


@pytest.mark.parametrize(
    "changes", [{"normal_force": 0.0}, {"tangential_velocity": -1.0}, {"quantile": 0.5}, {"elements": 0}]
)
def test_a_working_point_that_cannot_be_is_refused(changes: dict[str, float]) -> None:
    with pytest.raises(InvalidSamples, match=next(iter(changes))):
        replace(POINT, **changes)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("speed", ()),
        ("speed", (1e-3, 0.0)),
        ("length", (-1e-3,)),
        ("length", (math.inf,)),
        ("seconds", -1.0),
        ("frame_rate", 0.0),
        ("load", -1.0),
        ("load", math.nan),
        ("slipping", 0.0),
        ("force_spread", -0.1),
        ("velocity_spread", math.nan),
    ],
)
def test_what_no_robot_can_do_is_refused_by_name(name: str, wrong: object) -> None:
    with pytest.raises(InvalidSamples, match=rf"^{name} is .*; allowed: "):
        replace(Probing(), **{name: wrong})


@pytest.mark.parametrize("forces", [(0.2, 0.1), (0.0, 0.1), (-0.1, 0.1), (0.1, math.inf), (math.nan, 0.1)])
def test_forces_that_cannot_be_are_refused(forces: tuple[float, float]) -> None:
    with pytest.raises(InvalidSamples, match="normal_force"):
        next_grasp(model(), POINT, Probing(normal_force=forces))


def test_places_are_spread_by_speed_and_force_about_their_means() -> None:
    """Half of the speed in the mean; 3 × 3 nodes for half of 60 elements."""
    probing = replace(Probing(), velocity_spread=0.2, force_spread=0.3, slipping=0.5)
    designs = Designs.of(np.array([0.1]), 60, replace(probing, speed=(4e-3,), length=(1e-3,)))
    x, count = designs.places()
    assert x.shape == (1, 9, 3)
    share = count / count.sum()
    assert count.sum() == pytest.approx(30.0)
    np.testing.assert_allclose(share @ x[0], [1.0, 2e-3, 0.1], rtol=1e-12)
    np.testing.assert_allclose(np.sqrt(share @ (x[0] - share @ x[0]) ** 2), [0.0, 0.2 * 2e-3, 0.03], rtol=1e-9)
    assert designs.seconds[0] == pytest.approx(probing.seconds + 0.25)
    assert Designs.of(np.array([0.1]), 1, probing).places()[1].sum() == pytest.approx(1.0)  # one at least


def test_scatter_that_a_method_does_not_separate_counts_as_that_of_whole_grasps() -> None:
    """0.05 of the friction in the middle of the domain, 0.45 + 8 · 2.1e-3 − 0.8 · 0.125."""
    separate = model()
    assert scatter(separate) == (0.05, 0.02, 0.03)
    friction = 0.45 + 8.0 * 2.1e-3 - 0.8 * 0.125
    assert scatter(replace(separate, scales=None)) == pytest.approx((0.05 / friction, 0.0, 0.05))


def test_forces_go_from_half_of_the_least_to_twice_the_largest_seen_with_the_working_point_among_them() -> None:
    known, probing = model(np.zeros((3, 3))), replace(Probing(), load=0.0)
    forces = _forces(known, POINT, probing)
    assert (forces.min(), forces.max(), forces[-1]) == (pytest.approx(0.025), pytest.approx(0.4), 0.1)
    beyond = _forces(known, WorkingPoint(0.7), probing)
    assert beyond.max() == pytest.approx(0.7)
    chosen = _forces(known, POINT, replace(probing, normal_force=(0.2, 0.3)))
    assert (chosen.min(), chosen.max(), chosen[-1]) == (pytest.approx(0.2), pytest.approx(0.3), 0.2)


@pytest.mark.parametrize("probability", [0.0, -0.1, 0.6, 1.0, math.nan])
def test_a_probability_of_dropping_the_load_is_refused_by_its_own_name(probability: float) -> None:
    """It was by that of the quantile at which the model is asked."""
    with pytest.raises(InvalidSamples, match="drop_probability is"):
        next_grasp(model(), POINT, Probing(load=1.0, drop_probability=probability))
