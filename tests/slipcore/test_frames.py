import copy
import dataclasses
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slipcore import FrictionLaw, GraspLog, GroundTruth, InvalidInput
from slipcore.defaults import LIMITS
from slipcore.frames import (
    Frames,
    check_element_area,
    check_frame,
    check_mask,
    check_normal,
    check_pose,
    check_position,
    reported,
)

SHAPE = (4, 3, 5)


@pytest.fixture
def fields() -> dict[str, Any]:
    """Keyword arguments of a valid log with every part."""
    generator = np.random.default_rng(11)
    x, y = np.meshgrid(np.arange(3) * 1e-3, np.arange(5) * 1e-3, indexing="ij")
    normal = generator.normal(size=(*SHAPE, 3)) * 0.1 + [0.0, 0.0, 1.0]
    return {
        "time": np.array([0.0, 0.03, 0.06, 0.5]),
        "position": np.stack([x, y, np.zeros_like(x)], axis=-1),
        "displacement": generator.normal(scale=1e-4, size=(*SHAPE, 3)),
        "element_area": 1e-6,
        "force": generator.normal(scale=0.1, size=(*SHAPE, 3)),
        "normal": normal / np.linalg.norm(normal, axis=-1, keepdims=True),
        "object_pose": generator.normal(scale=1e-3, size=(4, 3)),
        "gripper_force": np.array([-0.02, 1.0, 5.0, 4.5]),
        "gripper_force_deviation": 0.05,
        "sensor": "left finger",
        "metadata": {"tier": "closed form"},
        "truth": GroundTruth(
            contact=np.ones(SHAPE, bool),
            slip_kinematic=np.zeros(SHAPE, bool),
            slip_contact_factor=np.zeros(SHAPE, bool),
            stick_ratio=np.array([np.nan, 1.0, 0.5, 0.0]),
            friction=FrictionLaw((0.4, 0.0, 0.0)),
        ),
    }


def refused(fields: dict[str, Any], message: str, **changes: Any) -> None:
    with pytest.raises(InvalidInput, match=message):
        GraspLog(**(fields | changes))


def changed(array: np.ndarray, place: tuple[int, ...], value: float) -> np.ndarray:
    copied = np.array(array)
    copied[place] = value
    return copied


def test_a_valid_log_keeps_what_it_was_given(fields: dict[str, Any]) -> None:
    log = GraspLog(**fields)
    for name in ("time", "position", "displacement", "force", "normal", "object_pose", "gripper_force"):
        np.testing.assert_array_equal(getattr(log, name), fields[name], err_msg=name)
    assert (log.grid, len(log), log.sensor, log.metadata["tier"]) == ((3, 5), 4, "left finger", "closed form")
    assert log.gripper_force_deviation == 0.05


def test_the_optional_parts_may_be_absent(fields: dict[str, Any]) -> None:
    log = GraspLog(fields["time"], fields["position"], fields["displacement"], 1e-6)
    assert log.force is log.normal is log.object_pose is log.truth is None
    assert log.gripper_force is log.gripper_force_deviation is None
    assert (log.sensor, dict(log.metadata)) == ("unknown", {})


def test_arrays_are_read_only_copies_in_double_precision(fields: dict[str, Any]) -> None:
    log = GraspLog(**(fields | {"displacement": fields["displacement"].astype(np.float32)}))
    assert log.displacement.dtype == np.float64
    for array in (log.time, log.position, log.displacement, log.force, log.normal, log.object_pose):
        assert array is not None
        assert not array.flags.writeable
    assert log.truth is not None
    assert not log.truth.contact.flags.writeable
    assert not log.truth.stick_ratio.flags.writeable
    fields["time"][0] = -1.0
    fields["truth"].contact[0] = False
    assert log.time[0] == 0.0
    assert log.truth.contact.all()


def test_the_record_and_its_metadata_are_frozen(fields: dict[str, Any]) -> None:
    log = GraspLog(**fields)
    with pytest.raises(dataclasses.FrozenInstanceError):
        log.sensor = "other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        log.metadata["tier"] = "other"  # type: ignore[index]


@pytest.mark.parametrize("duplicate", [lambda log: pickle.loads(pickle.dumps(log)), copy.copy, copy.deepcopy])
def test_a_log_survives_a_trip_to_another_process(
    fields: dict[str, Any], duplicate: Callable[[GraspLog], GraspLog]
) -> None:
    log = GraspLog(**fields)
    back = duplicate(log)
    np.testing.assert_array_equal(back.displacement, log.displacement)
    assert not back.displacement.flags.writeable
    assert dict(back.metadata) == dict(log.metadata)
    assert back.truth is not None
    assert log.truth is not None
    assert back.truth.friction == log.truth.friction


def test_frames_walk_through_the_log_in_order(fields: dict[str, Any]) -> None:
    log = GraspLog(**fields)
    frames = list(log.frames())
    assert [frame.time for frame in frames] == [0.0, 0.03, 0.06, 0.5]
    assert log.force is not None
    assert log.object_pose is not None
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.displacement, log.displacement[k])
        np.testing.assert_array_equal(frame.force, log.force[k])
        np.testing.assert_array_equal(frame.object_pose, log.object_pose[k])
        np.testing.assert_array_equal(frame.normal, fields["normal"][k])


def test_frames_of_a_log_without_forces_have_none(fields: dict[str, Any]) -> None:
    log = GraspLog(fields["time"], fields["position"], fields["displacement"], 1e-6)
    assert all(frame.force is frame.object_pose is frame.normal is None for frame in log.frames())


@pytest.mark.parametrize("name", ["contact", "observed"])
def test_masks_are_kept_and_walked_through_frame_by_frame(fields: dict[str, Any], name: str) -> None:
    mask = np.random.default_rng(2).random(SHAPE) < 0.5
    log = GraspLog(**(fields | {name: mask}))
    np.testing.assert_array_equal(getattr(log, name), mask)
    assert not getattr(log, name).flags.writeable
    for k, frame in enumerate(log.frames()):
        np.testing.assert_array_equal(getattr(frame, name), mask[k])
    refused(
        fields, rf"{name} is bool of shape \[4, 3, 4\]; allowed: bool of shape \[4, 3, 5\]", **{name: mask[..., 1:]}
    )
    refused(fields, f"{name} is int64 of shape", **{name: mask.astype(np.int64)})


@pytest.mark.parametrize(
    ("time", "message"),
    [
        ([0.0, 0.1, 0.1, 0.2], "time is 0.1 s at frame 2, after 0.1 s; allowed: strictly increasing seconds"),
        ([0.0, 0.2, 0.1, 0.3], "time is 0.1 s at frame 2, after 0.2 s"),
        ([0.0, 33.0e3, 66.0e3, 99.0e3], r"time is 3.3e\+04 s between frames"),
        ([0.0, 1e-9, 2e-9, 3e-9], "time is 1e-09 s between frames"),
        ([0.0, np.nan, 0.1, 0.2], r"time is nan at index \[1\] \(1 in all\); allowed: finite numbers"),
        ([0.0, 0.1, 0.2, np.inf], "time is inf"),
        ([0.0, 0.1, 0.2], r"displacement is of shape \[4, 3, 5, 3\]; allowed: shape \[3, 3, 5, 3\]"),
        ([0.0], r"time is 1 frame\(s\); allowed: at least 2 frames"),
        ([], r"time is empty"),
        ([[0.0, 0.1, 0.2, 0.3]], r"time is of shape \[1, 4\]; allowed: shape \[any\]"),
        (0.0, r"time is of shape \[\]"),
        ([0.0, 0.1, [0.2], 0.3], "time is not an array"),
        (["0.0", "0.1", "0.2", "0.3"], "time is of dtype <U3; allowed: an array of real numbers"),
        (np.array(["2026-01-01", "2026-01-02", "2026-01-03", "2026-01-04"], "M8[s]"), "time is of dtype datetime64"),
        ([0.0, 0.1, 0.2, 0.3 + 0j], "time is of dtype complex128"),
        ([0.0, 0.1, None, 0.3], "time is of dtype object"),
    ],
)
def test_time_that_cannot_be_is_refused(fields: dict[str, Any], time: Any, message: str) -> None:
    refused(fields, message, time=time)


def test_a_long_gap_in_time_is_allowed(fields: dict[str, Any]) -> None:
    assert len(GraspLog(**(fields | {"time": [0.0, 0.03, 0.06, 3600.0]}))) == 4


def test_time_since_the_epoch_is_allowed(fields: dict[str, Any]) -> None:
    assert GraspLog(**(fields | {"time": 1.8e9 + fields["time"]})).time[0] == 1.8e9


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: p * 1e3, "position is 4 m at its largest; allowed: at most 1 m"),
        (lambda p: p * 200, r"position is 0.8 m across; allowed: 0.0001 to 0.5 m across \(is it in m\?\)"),
        (lambda p: p * 1e-3, "position is 4e-06 m across"),
        (lambda p: p[..., :2], r"position is of shape \[3, 5, 2\]; allowed: shape \[any, any, 3\]"),
        (lambda p: p.reshape(15, 3), r"position is of shape \[15, 3\]"),
        (lambda p: p[:0], "position is empty"),
        (lambda p: changed(p, (1, 2, 0), np.nan), r"position is nan at index \[1, 2, 0\]"),
        (
            lambda p: np.where(np.arange(5)[:, None] == 3, p[:, 2:3], p),
            r"position is the same at \[0, 2\] and its next",
        ),
    ],
)
def test_positions_that_cannot_be_are_refused(
    fields: dict[str, Any], change: Callable[[np.ndarray], np.ndarray], message: str
) -> None:
    refused(fields, message, position=change(fields["position"]))


def test_a_single_marker_and_a_line_of_markers_are_lattices() -> None:
    single = GraspLog([0.0, 0.1], np.zeros((1, 1, 3)), np.full((2, 1, 1, 3), 0.05), 1e-6)  # type: ignore[arg-type]
    assert single.grid == (1, 1)
    line = np.zeros((1, 4, 3))
    line[0, :, 1] = np.arange(4) * 1e-3
    assert check_position(line).shape == (1, 4, 3)


@pytest.mark.parametrize(
    ("name", "factor", "message"),
    [
        ("displacement", 1e3, r"displacement is \S+ m at its largest; allowed: at most \S+ m \(is it in m\?\)$"),
        ("force", 1e6, "force is .* N per element at its largest; allowed: at most 10000 N per element"),
        ("object_pose", 1e5, "object_pose"),
        ("gripper_force", 1e4, "gripper_force is 5e\\+04 N at its largest; allowed: at most 10000 N"),
        ("gripper_force", -1.0, r"gripper_force is -5 to 0.02 N; allowed: positive where the object presses"),
        ("gripper_force_deviation", -1.0, "gripper_force_deviation is -0.05 N; allowed: 1e-06 to 10000 N"),
    ],
)
def test_absurd_units_are_refused(fields: dict[str, Any], name: str, factor: float, message: str) -> None:
    refused(fields, message, **{name: fields[name] * factor})


def test_millimetres_below_the_fixed_limit_are_found_by_the_width_of_the_sensor(fields: dict[str, Any]) -> None:
    refused(fields, "displacement is 0.05 m", displacement=np.full((*SHAPE, 3), 0.05))  # of a sensor 4 mm wide


@pytest.mark.parametrize("name", ["displacement", "force", "normal", "object_pose"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_named_with_its_place(fields: dict[str, Any], name: str, value: float) -> None:
    place = (2, 0) if name == "object_pose" else (2, 1, 0, 2)
    refused(
        fields,
        rf"{name} is {value} at index \[{place[0]}, .*\(1 in all\)",
        **{name: changed(fields[name], place, value)},
    )


@pytest.mark.parametrize("name", ["displacement", "force", "normal", "object_pose"])
def test_a_field_of_another_shape_is_named(fields: dict[str, Any], name: str) -> None:
    refused(fields, rf"{name} is of shape \[3, ", **{name: fields[name][:3]})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gripper_force": np.ones(3)}, r"gripper_force is of shape \[3\]; allowed: shape \[4\]"),
        ({"gripper_force": np.array([0.0, np.nan, 1.0, 1.0])}, r"gripper_force is nan at index \[1\] \(1 in all\)"),
        ({"gripper_force": None}, "gripper_force_deviation is given without gripper_force"),
        ({"gripper_force_deviation": np.inf}, "gripper_force_deviation is inf"),
        ({"gripper_force_deviation": np.ones(4)}, r"gripper_force_deviation is of shape \[4\]"),
    ],
)
def test_a_grippers_force_that_is_none_is_named(fields: dict[str, Any], changes: dict[str, Any], message: str) -> None:
    refused(fields, message, **changes)


def test_a_gripper_that_holds_nothing_may_be_off_by_its_zero(fields: dict[str, Any]) -> None:
    log = GraspLog(**(fields | {"gripper_force": np.full(4, -0.09)}))
    assert log.gripper_force is not None
    assert "up to -0.09 N" in log._repr_html_()


def test_zero_forces_are_a_log(fields: dict[str, Any]) -> None:
    log = GraspLog(**(fields | {"force": np.zeros((*SHAPE, 3))}))
    assert log.force is not None
    assert not log.force.any()


def test_normals_must_be_unit_vectors_that_point_outward(fields: dict[str, Any]) -> None:
    refused(fields, "normal is of length 1.1", normal=fields["normal"] * 1.1)
    refused(fields, "normal is of length 0", normal=np.zeros((*SHAPE, 3)))
    refused(fields, "normal is z component -.*outward", normal=-fields["normal"])
    assert GraspLog(**(fields | {"normal": fields["normal"].astype(np.float32)})).normal is not None


@pytest.mark.parametrize("area", [0.0, -1e-6, 1.0, np.nan, np.inf, 1e-13])
def test_an_absurd_element_area_is_refused(area: float) -> None:
    with pytest.raises(InvalidInput, match="element_area is"):
        check_element_area(area)


@pytest.mark.parametrize("area", [None, "1e-6", [1e-6], 1e-6 + 0j])
def test_an_element_area_that_is_no_number_is_refused(area: Any) -> None:
    with pytest.raises(InvalidInput, match="element_area is of"):
        check_element_area(area)


def test_metadata_must_be_a_mapping_and_becomes_strings(fields: dict[str, Any]) -> None:
    refused(fields, "metadata is a list", metadata=["a"])
    assert dict(GraspLog(**(fields | {"metadata": {"grid": 64}})).metadata) == {"grid": "64"}


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("contact", np.ones((4, 3, 4), bool), r"truth.contact is bool of shape \[4, 3, 4\]; allowed: bool of shape"),
        ("slip_kinematic", np.ones(SHAPE), "truth.slip_kinematic is float64 of shape"),
        ("slip_contact_factor", np.ones(SHAPE, int), "truth.slip_contact_factor is int64"),
        ("stick_ratio", np.ones(3), r"truth.stick_ratio is of shape \[3\]; allowed: shape \[4\]"),
        ("stick_ratio", np.array([0.0, 0.5, 1.1, 1.0]), "truth.stick_ratio is 1.1; allowed: 0 to 1"),
        ("stick_ratio", np.array([0.0, -0.5, 1.0, 1.0]), "truth.stick_ratio is -0.5"),
    ],
)
def test_a_truth_that_does_not_fit_the_log_is_refused(
    fields: dict[str, Any], name: str, value: np.ndarray, message: str
) -> None:
    refused(fields, message, truth=dataclasses.replace(fields["truth"], **{name: value}))


@pytest.mark.parametrize(
    ("coefficients", "scale", "message"),
    [
        ((0.4, 0.0), 0.0, r"coefficients is of shape \[2\]; allowed: shape \[3\]"),
        ((0.4, np.nan, 0.0), 0.0, "coefficients is nan"),
        ((0.4, 0.0, 0.0), -0.1, "scale is -0.1; allowed: at least 0 and finite"),
        ((0.4, 0.0, 0.0), np.nan, "scale is nan"),
    ],
)
def test_a_friction_law_that_cannot_be_is_refused(coefficients: Any, scale: float, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        FrictionLaw(coefficients, scale)


def test_one_frame_gets_the_checks_of_a_log() -> None:
    assert check_frame("force", np.ones((3, 5, 3)), (3, 5, 3), 10.0, "N").shape == (3, 5, 3)
    with pytest.raises(InvalidInput, match="force is 11 N at its largest; allowed: at most 10 N"):
        check_frame("force", np.full((3, 5, 3), -11.0), (3, 5, 3), 10.0, "N")
    with pytest.raises(InvalidInput, match="force is of shape"):
        check_frame("force", np.ones((3, 5)), (3, 5, 3), 10.0, "N")


def test_one_frames_pose_and_normals_get_the_checks_of_a_log() -> None:
    assert check_pose([0.01, 0.02, 3.0]).tolist() == [0.01, 0.02, 3.0]
    with pytest.raises(InvalidInput, match="object_pose x, y is 10 m at its largest"):
        check_pose([10.0, 0.0, 0.0])
    with pytest.raises(InvalidInput, match="normal is of length 2"):
        check_normal(np.full((1, 1, 3), [0.0, 0.0, 2.0]), (1, 1, 3))


def test_the_error_carries_name_value_and_allowed_through_pickling() -> None:
    error = pickle.loads(pickle.dumps(InvalidInput("force", 3, "less")))
    assert (error.name, error.value, error.allowed, str(error)) == ("force", "3", "less", "force is 3; allowed: less")


@pytest.mark.parametrize("time", [[-1.7e308, 0.0, 1.7e308], [0.0, 0.1, 1e10], [1e15, 1e15 + 1, 1e15 + 2]])
def test_a_time_that_no_recording_has_is_refused(time: list[float]) -> None:
    with pytest.raises(InvalidInput, match="time is"):
        GraspLog(
            time=np.array(time),
            position=np.zeros((1, 1, 3)),
            displacement=np.zeros((3, 1, 1, 3)),
            element_area=1e-6,
        )


def test_a_log_shares_only_what_nobody_can_change(fields: dict[str, Any]) -> None:
    given = fields["displacement"]
    assert not np.shares_memory(GraspLog(**fields).displacement, given)
    given.flags.writeable = False
    assert not np.shares_memory(GraspLog(**fields).displacement, given)
    fixed = np.frombuffer(given.tobytes()).reshape(given.shape)
    assert np.shares_memory(GraspLog(**fields | {"displacement": fixed}).displacement, fixed)


@pytest.mark.parametrize("frames", [slice(1, 3), np.array([1, 2]), np.array([False, True, True, False])])
def test_some_frames_of_a_log_are_those_of_all_it_has(fields: dict[str, Any], frames: Frames) -> None:
    masks = {name: np.random.default_rng(2).random(SHAPE) < 0.5 for name in ("contact", "observed")}
    whole = GraspLog(**fields | masks)
    part = whole.take(frames)
    for one, expected in zip(part.frames(), list(whole.frames())[1:3], strict=True):
        for found, value in zip(one, expected, strict=True):
            np.testing.assert_array_equal(found, value)
    assert part.truth is not None
    np.testing.assert_array_equal(part.truth.stick_ratio, [1.0, 0.5])
    np.testing.assert_array_equal(part.gripper_force, [1.0, 5.0])
    assert (part.sensor, part.metadata, part.truth.friction) == (whole.sensor, whole.metadata, fields["truth"].friction)


def test_frames_that_are_no_log_are_refused(fields: dict[str, Any]) -> None:
    without = GraspLog(**fields | dict.fromkeys(("force", "normal", "object_pose", "truth")))
    assert without.take(slice(2)).force is None
    with pytest.raises(InvalidInput, match=r"time is 1 frame\(s\)"):
        without.take(slice(1))
    with pytest.raises(InvalidInput, match="time is"):
        without.take(np.array([2, 1]))


@pytest.mark.parametrize("bound", [LIMITS.gripper_deviation, LIMITS.gripper_force])
def test_a_deviation_at_either_end_of_its_range_is_taken(fields: dict[str, Any], bound: float) -> None:
    assert GraspLog(**fields | {"gripper_force_deviation": bound}).gripper_force_deviation == bound
    beyond = bound * (1.01 if bound == LIMITS.gripper_force else 0.99)
    refused(fields, "gripper_force_deviation", gripper_force_deviation=beyond)


def test_a_gripper_that_holds_nothing_reports_nothing() -> None:
    least = LIMITS.gripper_deviation
    found = reported(np.array([-1.0, 0.0, 0.9 * least, least, 2.0]))
    assert np.isnan(found[:3]).all()
    assert found[3:].tolist() == [least, 2.0]


def test_a_mask_of_rows_of_different_lengths_is_named() -> None:
    with pytest.raises(InvalidInput, match="observed is not an array"):
        check_mask("observed", [[True], [True, False]], (2, 2))
