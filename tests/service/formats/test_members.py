"""From members by their names to a log."""

import json
from typing import Any

import numpy as np
import pytest

from service.formats.members import TRUTH, grasp_log, of_all_frames, scalar, stated_metadata
from slipcore import InvalidInput
from slipcore.frames import UNNAMED

SHAPE = (2, 3, 3)
PLACE = 1e-3 * np.stack(np.meshgrid(np.arange(3.0), np.arange(3.0), [0.0], indexing="ij"), axis=-1)[:, :, 0]
LEAST: dict[str, Any] = {
    "time": np.arange(2.0),
    "position": PLACE,
    "displacement": np.full((*SHAPE, 3), 1e-6),
    "element_area": np.array(1e-6),
}
KNOWN: dict[str, Any] = {
    "truth_contact": np.ones(SHAPE, bool),
    "truth_slip_kinematic": np.zeros(SHAPE, bool),
    "truth_slip_contact_factor": np.ones(SHAPE, bool),
    "truth_stick_ratio": np.array([0.25, 0.75]),
    "truth_friction": np.array([0.4, 0.1, -0.2, 0.03]),
}


def test_a_log_of_what_it_must_have_has_nothing_else() -> None:
    log = grasp_log(LEAST)
    assert (log.element_area, log.sensor, log.metadata) == (1e-6, UNNAMED, {})
    for name in ("force", "normal", "object_pose", "contact", "observed", "gripper_force", "truth"):
        assert getattr(log, name) is None
    assert log.gripper_force_deviation is None


def test_each_member_is_found_in_its_place() -> None:
    rng = np.random.default_rng(0)
    normal = np.broadcast_to([0.0, 0.6, 0.8], (*SHAPE, 3))
    arrays = {
        "force": rng.normal(size=(*SHAPE, 3)),
        "normal": normal,
        "object_pose": 0.1 * rng.normal(size=(2, 3)),
        "contact": rng.random(SHAPE) < 0.5,
        "observed": rng.random(SHAPE) < 0.5,
        "gripper_force": np.array([1.0, 2.0]),
    }
    told = {"sensor": np.array("left"), "metadata": np.array('{"a": "1"}'), "gripper_force_deviation": np.array(0.5)}
    log = grasp_log({**LEAST, **arrays, **told, **KNOWN})
    for name, array in arrays.items():
        np.testing.assert_array_equal(getattr(log, name), array)
    assert (log.sensor, log.metadata, log.gripper_force_deviation) == ("left", {"a": "1"}, 0.5)
    assert log.truth is not None
    assert (log.truth.friction.coefficients, log.truth.friction.scale) == ((0.4, 0.1, -0.2), 0.03)
    assert log.truth.contact.all()
    assert not log.truth.slip_kinematic.any()
    assert log.truth.slip_contact_factor.all()
    np.testing.assert_array_equal(log.truth.stick_ratio, [0.25, 0.75])


@pytest.mark.parametrize("missing", TRUTH)
def test_a_truth_that_lacks_a_member_is_told_which(missing: str) -> None:
    part = {name: value for name, value in KNOWN.items() if name != missing}
    with pytest.raises(InvalidInput, match=f"truth is without {missing}; allowed: all of the truth's members, or none"):
        grasp_log({**LEAST, **part})


@pytest.mark.parametrize("count", [3, 5])
def test_the_friction_of_a_truth_has_four_numbers(count: int) -> None:
    with pytest.raises(
        InvalidInput, match=rf"truth_friction is of shape \[{count}\]; allowed: shape \[4\]: β₀, β₁, β₂, σ"
    ):
        grasp_log({**LEAST, **KNOWN, "truth_friction": np.ones(count)})


@pytest.mark.parametrize("value", [np.array([1.0]), np.ones((1, 1)), np.empty(0)])
def test_a_single_value_has_no_axes(value: Any) -> None:
    with pytest.raises(InvalidInput, match=r"area is of shape \[[\d, ]+\]; allowed: a single value \(shape \[\]\)"):
        scalar({"area": value}, "area")


def test_text_that_cannot_be_stored_is_refused() -> None:
    with pytest.raises(InvalidInput, match="sensor is not valid Unicode; allowed: Unicode text"):
        scalar({"sensor": np.array("a\ud800")}, "sensor")
    assert scalar({"sensor": np.array("μ")}, "sensor") == "μ"


@pytest.mark.parametrize("text", ["[]", '"a"', '{"a": 1}', '{"a": null}', '{"a": {}}', "{"])
def test_metadata_are_an_object_of_strings(text: str) -> None:
    with pytest.raises(InvalidInput, match=r"metadata is .*; allowed: a JSON object of strings"):
        stated_metadata({"metadata": np.array(text)})
    with pytest.raises(InvalidInput) as refusal:
        stated_metadata({"metadata": np.array(json.dumps(["x" * 200]))})
    assert len(refusal.value.value) == 100


def test_without_metadata_there_are_none() -> None:
    assert stated_metadata({}) == {}
    assert stated_metadata({"metadata": np.array('{"a": "1", "μ": "é"}')}) == {"a": "1", "μ": "é"}


def test_what_all_frames_state_alike_is_the_log_s() -> None:
    stated = np.array([[1.0, np.nan], [1.0, np.nan]])
    np.testing.assert_array_equal(of_all_frames("area", stated), [1.0, np.nan])
    assert of_all_frames("sensor", np.array(["left"] * 3)) == "left"


@pytest.mark.parametrize("other", [[1.0, 2.0], [np.nan, np.nan], [2.0, np.nan]])
def test_what_frames_state_otherwise_is_refused_with_the_first_that_does(other: list[float]) -> None:
    stated = np.array([[1.0, np.nan], [1.0, np.nan], other, other])
    with pytest.raises(
        InvalidInput, match=r"area is other in frame 2 than in frame 0; allowed: one value of the whole log$"
    ):
        of_all_frames("area", stated)
    with pytest.raises(InvalidInput, match=r"map displacement to the same fields$"):
        of_all_frames("position", stated)
