"""What a model answers, against the distributions that it is made of."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from slipcore.frames import UNNAMED
from stiction_client.errors import InvalidArgument
from stiction_client.linear_friction import Scale, Scales, SensorFriction, SensorScale
from stiction_client.support import UNNAMED_SENSOR
from tests.service.report.test_material import MODEL

COVARIANCE = np.array([[4e-4, 1e-3, -2e-3], [1e-3, 1.0, 0.1], [-2e-3, 0.1, 4.0]])
PLAIN = replace(MODEL, covariance=COVARIANCE)
SCALES = Scales(Scale(0.1, 8.0), Scale(0.03, 20.0), Scale(0.04, math.inf))
SCALED = replace(PLAIN, scales=SCALES)
SENSOR = SensorFriction(
    0.2, 0.05, (0.6, 0.2, -0.1), ((1e-4, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)), 5.0, 0.03, math.inf, 1.12e-6
)
SENSED = replace(PLAIN, scales=replace(SCALES, between_sensors=SensorScale(Scale(0.15, 4.0), {"left": SENSOR})))
INSIDE = (5e-4, 0.07)
"""m/s and N, within the data."""


@pytest.mark.parametrize("level", [0.5, 0.95])
def test_intervals_are_those_of_student_and_of_chi_square(level: float) -> None:
    half = stats.t.ppf(0.5 + 0.5 * level, 9.0) * np.sqrt(np.diag(COVARIANCE))
    np.testing.assert_allclose(
        PLAIN.interval(level), np.stack([PLAIN.coefficients - half, PLAIN.coefficients + half], 1)
    )
    low, high = PLAIN.scale_interval(level)
    assert low == pytest.approx(0.02 * math.sqrt(30.0 / stats.chi2.ppf(0.5 + 0.5 * level, 30.0)))
    assert high == pytest.approx(0.02 * math.sqrt(30.0 / stats.chi2.ppf(0.5 - 0.5 * level, 30.0)))
    assert replace(PLAIN, scatter_degrees_of_freedom=math.inf).scale_interval(level) == (0.02, 0.02)
    np.testing.assert_allclose(PLAIN.standard_errors, [0.02, 1.0, 2.0])


@pytest.mark.parametrize("level", [0.0, 1.0, -0.1, math.nan])
def test_a_probability_is_between_0_and_1(level: float) -> None:
    for asked in (PLAIN.interval, PLAIN.scale_interval):
        with pytest.raises(InvalidArgument, match=f"level is {level}; allowed: above 0 and below 1"):
            asked(level)
    with pytest.raises(InvalidArgument, match=f"quantile is {level}; allowed: above 0 and below 1"):
        PLAIN.predict(*INSIDE, quantile=level)


@pytest.mark.parametrize("level", [0.05, 0.3, 0.9])
def test_a_quantile_within_the_data_is_the_root_of_squares_of_its_parts(level: float) -> None:
    x = np.array([1.0, *INSIDE])
    mean, error = x @ PLAIN.coefficients, math.sqrt(x @ COVARIANCE @ x)
    assert PLAIN.predict(*INSIDE) == pytest.approx(mean)
    uncertain = stats.t.ppf(level, 9.0) * error
    distance = math.hypot(stats.t.ppf(level, 30.0) * 0.02, uncertain)
    assert PLAIN.predict(*INSIDE, level) == pytest.approx(mean + math.copysign(distance, level - 0.5))
    grasps, places, within = (
        value * stats.t.ppf(level, freedom) for value, freedom in ((0.1, 8.0), (0.03, 20.0), (0.04, 1e12))
    )
    for of, count in (("element", 1.0), ("contact", 25.0)):
        own = math.hypot(places, within) / math.sqrt(count)
        distance = math.hypot(mean * grasps, own, uncertain)
        found = SCALED.predict(*INSIDE, level, of, None if of == "element" else count)
        assert found == pytest.approx(mean + math.copysign(distance, level - 0.5))
    gain = 0.15 * stats.t.ppf(level, 4.0)
    distance = math.hypot(mean * grasps, mean * gain, math.hypot(places, within), uncertain)
    assert SENSED.predict(*INSIDE, level) == pytest.approx(mean + math.copysign(distance, level - 0.5))


def test_no_quantile_is_below_0_and_the_median_is_the_mean() -> None:
    assert PLAIN.predict(*INSIDE, 1e-9) == 0.0
    assert PLAIN.predict(*INSIDE, 0.5) == pytest.approx(PLAIN.predict(*INSIDE))
    assert replace(PLAIN, coefficients=np.array([-0.1, 0.0, 0.0])).predict(*INSIDE) == pytest.approx(-0.1)


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, "1", None, True, [True], [[1.0], [1.0, 2.0]], 1j])
def test_what_is_no_velocity_or_force_is_named_by_all_that_is_asked_there(value: Any) -> None:
    for point, name in (((value, 0.07), "tangential_velocity"), ((5e-4, value), "normal_force")):
        for ask in (PLAIN.predict, PLAIN.extrapolation, PLAIN.support_at):
            with pytest.raises(InvalidArgument, match=f"^{name} is .*; allowed: "):
                ask(*point)


def test_what_rests_on_data_is_asked_of_one_point() -> None:
    with pytest.raises(InvalidArgument, match=r"^normal_force is .*; allowed: one number"):
        PLAIN.support_at(0.0, np.ones(2))  # type: ignore[arg-type]


def test_a_sensor_is_asked_for_by_its_name() -> None:
    with pytest.raises(InvalidArgument, match=r"^name is 3; allowed: the name of a sensor$"):
        PLAIN.of_sensor(3)  # type: ignore[arg-type]


def test_shapes_broadcast() -> None:
    v, force = np.array([0.0, 5e-4])[:, None], np.array([0.03, 0.07, 0.1])
    found = SCALED.predict(v, force, 0.1)
    each = [[float(SCALED.predict(one, other, 0.1)) for other in force] for one in v.ravel()]
    np.testing.assert_allclose(found, each)


@pytest.mark.parametrize(
    ("of", "elements", "told"),
    [
        ("finger", 9.0, "of is finger; allowed: element or contact"),
        ("contact", None, "elements is None; allowed: the number of elements of the contact, at least 1"),
        ("contact", 0.99, "elements is 0.99; allowed"),
        ("contact", math.inf, "elements is inf; allowed"),
    ],
)
def test_a_contact_has_at_least_one_element(of: str, elements: float | None, told: str) -> None:
    with pytest.raises(InvalidArgument, match=told):
        SCALED.predict(*INSIDE, 0.05, of, elements)
    assert SCALED.predict(*INSIDE, 0.05, "contact", 1.0) == SCALED.predict(*INSIDE, 0.05)


def test_an_element_twice_as_large_bears_twice_the_force_and_averages_over_two_places() -> None:
    twice = SENSED.at_element_area(2.0 * SENSED.element_area)
    np.testing.assert_allclose(twice.coefficients, [0.45, 0.1, -0.01])
    np.testing.assert_allclose(twice.covariance, COVARIANCE * [[1.0, 1.0, 0.5], [1.0, 1.0, 0.5], [0.5, 0.5, 0.25]])
    assert (twice.domain.normal_force, twice.domain.tangential_velocity) == (
        (0.04, 0.24),
        SENSED.domain.tangential_velocity,
    )
    assert (twice.scale, twice.element_area) == (pytest.approx(0.02 / math.sqrt(2.0)), 2.0 * SENSED.element_area)
    scales = twice.scales
    assert scales is not None
    assert scales.between_sensors is not None
    assert scales.between_grasps == SCALES.between_grasps
    assert (scales.between_places.value, scales.within.value) == pytest.approx((0.03 / 2**0.5, 0.04 / 2**0.5))
    left = scales.between_sensors.sensors["left"]
    assert left.coefficients == pytest.approx((0.6, 0.2, -0.05))
    assert left.covariance[2] == pytest.approx((0.0, 0.0, 0.75))
    assert left.scale == pytest.approx(0.03 / 2**0.5)
    assert scales.between_sensors.scale == Scale(0.15, 4.0)


@pytest.mark.parametrize("area", [0.0, -1.0, math.inf, math.nan, True, None])
def test_an_area_is_finite_and_above_0(area: Any) -> None:
    with pytest.raises(InvalidArgument, match=f"area is {area}; allowed: above 0 m²"):
        PLAIN.at_element_area(area)


def test_a_known_sensor_answers_by_itself_and_by_its_own_elements_where_these_are_known() -> None:
    left = SENSED.of_sensor("left")
    np.testing.assert_array_equal(left.coefficients, SENSOR.coefficients)
    np.testing.assert_array_equal(left.covariance, SENSOR.covariance)
    assert (left.degrees_of_freedom, left.scale, left.scatter_degrees_of_freedom) == (5.0, 0.03, math.inf)
    assert left.scales == SCALES
    assert SENSED.on_sensor("left").element_area == 1.12e-6
    assert SENSED.on_sensor("left").coefficients[2] == pytest.approx(-0.1 / (1.12e-6 / SENSED.element_area))
    for model in (PLAIN, SCALED):
        same = replace(model, diagnostics={"sensor": "left"})
        assert same.of_sensor("left") is same
        assert same.on_sensor("left") is same
    unknown = SENSED.on_sensor("lefft")
    np.testing.assert_array_equal(unknown.coefficients, SENSED.coefficients)
    assert unknown.notes == (
        "no grasp of it is by a sensor 'lefft' (did you mean 'left'?): the answer allows for the gain of any sensor",
    )
    assert "did you mean" not in SENSED.of_sensor("xyz").notes[0]


def test_a_log_that_names_no_sensor_is_called_so_on_both_sides() -> None:
    assert UNNAMED_SENSOR == UNNAMED


def test_a_model_that_separates_no_sensors_says_so_where_another_than_its_own_is_asked_for() -> None:
    alone = replace(SCALED, diagnostics={"sensor": "left"})
    other = alone.on_sensor("lefft")
    assert other.notes == (
        "all grasps of it are by a sensor 'left', none by 'lefft' (did you mean 'left'?): "
        "the answer does not allow for the gain of another sensor",
    )
    assert other.predict(*INSIDE, 0.05) == alone.predict(*INSIDE, 0.05)
    assert replace(PLAIN, diagnostics={"sensor": "unknown"}).of_sensor("left").notes == (
        "no grasp of it names its sensor, so that none is known to be by 'left': "
        "the answer does not allow for the gain of another sensor",
    )
    assert PLAIN.of_sensor("left").notes == (
        "this fit does not separate the sensors of its grasps: "
        "the answer does not allow for the gain of another sensor",
    )


def test_scales_and_sensors_come_back_from_json_and_infinity_is_null() -> None:
    assert SENSED.scales is not None
    told = SENSED.scales.to_json()
    assert Scales.from_json(told) == SENSED.scales
    assert told["within"] == {"value": 0.04, "degrees_of_freedom": None}
    assert told["between_sensors"]["sensors"]["left"]["scatter_degrees_of_freedom"] is None
    assert "between_sensors" not in SCALES.to_json()
    assert Scales.from_json(SCALES.to_json()) == SCALES
    old = replace(SENSOR, element_area=None)
    assert "element_area" not in old.to_json()
    assert SensorFriction.from_json(old.to_json()) == old


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"value": -1e-9}, "value, which is -1e-09; allowed: finite, 0 or more"),
        ({"degrees_of_freedom": 0.0}, "above 0"),
    ],
)
def test_a_scale_is_a_size_with_degrees_of_freedom(changes: dict[str, float], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        Scale.from_json({"value": 0.0, "degrees_of_freedom": 3.0, **changes})
    assert Scale.from_json({"value": 0.0, "degrees_of_freedom": 3.0}) == Scale(0.0, 3.0)
    with pytest.raises(ValueError, match="element_area, which is 0; allowed: finite, above 0"):
        SensorFriction.from_json({**SENSOR.to_json(), "element_area": 0.0})


def test_the_rows_of_a_table_are_of_coefficients_and_of_the_scatter() -> None:
    *coefficients, scatter = PLAIN._rows()
    for row, value, error, bounds, known in zip(
        coefficients, PLAIN.coefficients, PLAIN.standard_errors, PLAIN.interval(), PLAIN.identifiable, strict=True
    ):
        assert row == (value, error, *bounds, known)
    assert scatter == (0.02, pytest.approx(0.02 / math.sqrt(60.0)), *PLAIN.scale_interval(), True)
