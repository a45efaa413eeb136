"""What bodies and addresses may ask for: each number to the ends of its range, and no further."""

from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from service.http.schemas.materials import NewMaterial
from service.http.schemas.models import LookUpQuery, NewFit, NextGraspQuery
from service.http.schemas.planning import NewGraspForce, NewRecognition, SamplesIn
from service.http.schemas.sensors import GelIn, NewCalibrationIn, PressIn

GRIP = {"material": "paper", "tangential_load": 1.0, "contact_area": 1e-4}
GEL = {"young_modulus": 1e5, "poisson_ratio": 0.4}
SAMPLES = {
    "friction_coefficient": [0.4], "tangential_velocity": [0.0], "normal_force": [0.1], "tangential_force": [0.04],
    "time": [0.0], "element": [3], "weight": [1.0], "element_area": 1e-6,
}  # fmt: skip
TINY = 1e-12

RANGES: list[tuple[type[BaseModel], dict[str, Any], str, tuple[Any, Any], tuple[Any, Any]]] = [
    (NewGraspForce, GRIP, "tangential_load", (0.0, 1e6), (-TINY, 1.1e6)),
    (NewGraspForce, GRIP, "torque", (0.0, 1e6), (-TINY, 1.1e6)),
    (NewGraspForce, GRIP, "contact_area", (TINY, 1.0), (0.9e-12, 1.01)),
    (NewGraspForce, GRIP, "round_at", (1e-9, 1e6), (0.9e-9, 1.1e6)),
    (NewGraspForce, GRIP, "fingers", (1, 100), (0, 101)),
    (NewGraspForce, GRIP, "object_radius", (1e-6, 1e3), (0.9e-6, 1001.0)),
    (NewGraspForce, GRIP, "safety_factor", (1.0, 100.0), (0.99, 100.1)),
    (NewGraspForce, GRIP, "slip_probability", (TINY, 0.5), (0.9e-12, 0.51)),
    (NewGraspForce, GRIP, "tangential_velocity", (0.0, 1e3), (-TINY, 1001.0)),
    (NewGraspForce, GRIP, "normal_force_limit", (TINY, 1e6), (0.0, 1.1e6)),
    (NewGraspForce, GRIP, "elements", (1.0, 1e12), (0.9, 1.1e12)),
    (LookUpQuery, {"fn": 0.1}, "fn", (0.0, 1e4), (-TINY, 10001.0)),
    (LookUpQuery, {"fn": 0.1}, "v", (0.0, 1e3), (-TINY, 1001.0)),
    (LookUpQuery, {"fn": 0.1}, "quantile", (TINY, 1.0 - TINY), (0.9e-12, 1.0)),
    (LookUpQuery, {"fn": 0.1}, "elements", (1, 10**9), (0, 10**9 + 1)),
    (LookUpQuery, {"fn": 0.1}, "element_area", (1.1e-12, 1.0), (TINY, 1.01)),
    (NextGraspQuery, {}, "fn", (TINY, 1e4), (0.0, 10001.0)),
    (NextGraspQuery, {}, "quantile", (TINY, 0.499), (0.9e-12, 0.5)),
    (NextGraspQuery, {}, "elements", (1, 10**9), (0, 10**9 + 1)),
    (NextGraspQuery, {}, "load", (0.0, 1e6), (-TINY, 1.1e6)),
    (NextGraspQuery, {}, "drop_probability", (TINY, 0.5), (0.9e-12, 0.51)),
    (NewFit, {}, "seed", (0, 2**32 - 1), (-1, 2**32)),
    (NewRecognition, {"grasp_log": "a"}, "unknown", (0.0, 0.999), (-TINY, 1.0)),
    (GelIn, GEL, "young_modulus", (1e2, 1e12), (99.0, 1.1e12)),
    (GelIn, GEL, "poisson_ratio", (0.0, 0.5), (-TINY, 0.51)),
    (GelIn, GEL, "thickness", (1e-6, 1.0), (0.9e-6, 1.01)),
    (GelIn, GEL, "marker_depth", (0.0, 0.999), (-TINY, 1.0)),
    (SamplesIn, SAMPLES, "element_area", (1.1e-12, 1.0), (TINY, 1.01)),
    (SamplesIn, SAMPLES, "friction_coefficient", ([0.0], [1e3]), ([-TINY], [1001.0])),
    (SamplesIn, SAMPLES, "tangential_velocity", ([0.0], [1e3]), ([-TINY], [1001.0])),
    (SamplesIn, SAMPLES, "normal_force", ([0.0], [1e4]), ([-TINY], [10001.0])),
    (SamplesIn, SAMPLES, "time", ([-1e9], [1e9]), ([-1.1e9], [1.1e9])),
    (SamplesIn, SAMPLES, "element", ([0], [2**31 - 1]), ([-1], [2**31])),
    (SamplesIn, SAMPLES, "weight", ([0.0], [1.0]), ([-TINY], [1.01])),
]


@pytest.mark.parametrize(("kind", "others", "name", "ends", "beyond"), RANGES)
def test_a_number_may_be_as_small_and_as_large_as_it_may_be(
    kind: type[BaseModel], others: dict[str, Any], name: str, ends: tuple[Any, Any], beyond: tuple[Any, Any]
) -> None:
    for value in ends:
        assert getattr(kind.model_validate(others | {name: value}), name) == value
    for value in (*beyond, float("nan")):
        with pytest.raises(ValidationError) as refusal:
            kind.model_validate(others | {name: value})
        assert {error["loc"][0] for error in refusal.value.errors()} == {name}


def test_what_is_not_said_is_what_a_planner_goes_by() -> None:
    grip = NewGraspForce.model_validate(GRIP)
    assert (grip.method, grip.torque, grip.fingers, grip.safety_factor) == ("auto", 0.0, 1, 1.0)
    assert (grip.slip_probability, grip.tangential_velocity) == (1e-3, 0.0)
    nothing = (grip.round_at, grip.object_radius, grip.normal_force_limit, grip.of, grip.elements, grip.sensor)
    assert nothing == (None,) * 6
    assert grip.task().contact_area == 1e-4
    assert (NewFit().method, NewFit().seed) == ("auto", 0)
    assert NewRecognition(grasp_log="a").unknown == 0.05
    assert (NextGraspQuery().v, NextGraspQuery().load, NextGraspQuery().method) == (0.0, 0.0, "auto")


@pytest.mark.parametrize(
    ("asked", "averaged"),
    [
        ({}, ("element", 1)),
        ({"elements": 30}, ("contact", 30)),
        ({"elements": 30, "of": "element"}, ("element", 1)),
        ({"elements": 30, "of": "contact"}, ("contact", 30)),
        ({"of": "element"}, ("element", 1)),
    ],
)
def test_a_quantile_is_of_a_contact_where_its_elements_are_told(asked: Any, averaged: tuple[str, int]) -> None:
    question = LookUpQuery(fn=0.1, v=0.2, quantile=0.05, sensor="left", element_area=1e-6, **asked)
    assert question.averaged() == averaged
    told = question.question()
    assert (told.tangential_velocity, told.normal_force, told.quantile) == (0.2, 0.1, 0.05)
    assert (told.of, told.elements, told.sensor, told.element_area) == (*averaged, "left", 1e-6)


def test_a_contact_without_the_number_of_its_elements_is_no_question() -> None:
    with pytest.raises(ValidationError, match="of=contact with the number of its elements"):
        LookUpQuery(fn=0.1, of="contact")


@pytest.mark.parametrize(("depth", "is_within"), [(9.9e-4, True), (1e-3, False)])
def test_markers_lie_in_their_gel(depth: float, is_within: bool) -> None:
    told = GEL | {"thickness": 1e-3, "marker_depth": depth}
    if is_within:
        assert GelIn.model_validate(told).record().marker_depth == depth
    else:
        with pytest.raises(ValidationError, match="marker_depth below the thickness"):
            GelIn.model_validate(told)
    assert GelIn.model_validate(told | {"thickness": None}).thickness is None


@pytest.mark.parametrize("told", [{}, {"grasp_log": "a", "samples": SAMPLES}])
def test_a_grasp_is_a_log_or_samples(told: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match="either grasp_log or samples"):
        NewRecognition.model_validate(told)


def test_lists_of_samples_are_of_one_length() -> None:
    with pytest.raises(ValidationError, match="lists of one length, not"):
        SamplesIn.model_validate(SAMPLES | {"weight": [1.0, 1.0]})
    with pytest.raises(ValidationError, match="lists of one length, not"):
        SamplesIn.model_validate(SAMPLES | {"kind": ["element", "contact"]})
    assert SamplesIn.model_validate(SAMPLES | {"kind": ["contact"], "velocity_is_relative": [True]}).kind == ["contact"]


@pytest.mark.parametrize(
    ("name", "is_one"),
    [
        ("a", True), ("A.b_c-d 9", True), ("a" * 100, True), ("a.", True), ("a-", True),
        ("", False), (" a", False), ("a ", False), (".a", False), ("_a", False), ("a" * 101, False), ("ä", False),
        ("a/b", False), ("a\n", False),
    ],
)  # fmt: skip
def test_a_name_begins_with_a_letter_and_ends_without_a_space(name: str, is_one: bool) -> None:
    if is_one:
        assert NewMaterial(name=name).name == name
    else:
        with pytest.raises(ValidationError):
            NewMaterial(name=name)


def test_a_sensor_is_calibrated_by_one_press_to_thirty_two() -> None:
    press = {"grasp_log": "a", "known_force": None}
    for count in (1, 32):
        assert len(NewCalibrationIn.model_validate({"presses": [press] * count}).presses) == count
    for count in (0, 33):
        with pytest.raises(ValidationError):
            NewCalibrationIn.model_validate({"presses": [press] * count})
    assert PressIn.model_validate(press).record().known_force is None


@pytest.mark.parametrize("value", ["1", True, None])
def test_a_body_takes_numbers_as_numbers_and_known_fields_alone(value: Any) -> None:
    with pytest.raises(ValidationError):
        NewGraspForce.model_validate(GRIP | {"tangential_load": value})
    with pytest.raises(ValidationError, match="Extra inputs"):
        NewGraspForce.model_validate(GRIP | {"load": 1.0})
