"""The grip controller beside a live detector, without the process and the network around it."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from service.stream import detector_session, detectors
from service.stream.detector_session import PackedFrame
from service.stream.grip import settings_of
from service.stream.messages import Control
from service.stream.observing import LEAST_SHARE, LEAST_SPEED, WINDOW, Observer
from slipcore import Frame, GraspLog, InvalidInput, SlipDetector
from stiction_client import GraspController, InvalidArgument

FORCES = {"least_force": 0.5, "most_force": 30.0}
ROUND = Control(6e-5, FORCES, round_at=5.0)

ROOM = detector_session.MemoryLimit("me", 2**30)


def open_session(log: GraspLog, control: Control | None, keep: bool = False) -> None:
    options = detector_session.SessionOptions(control)
    detectors.open_session("one", log.position.tobytes(), log.grid, log.element_area, "filter", keep, ROOM, options)


@pytest.fixture
def log(ramp: GraspLog) -> GraspLog:
    return ramp.take(np.arange(60))


def answers(log: GraspLog, control: Control | None) -> list[dict[str, Any]]:
    """Those of a session without an expected model."""
    assert log.force is not None
    open_session(log, control)
    try:
        frames = zip(log.time.tolist(), log.displacement, log.force, strict=True)
        return [
            detectors.step("one", PackedFrame(k, time, displacement.tobytes(), force.tobytes()))[0]
            for k, (time, displacement, force) in enumerate(frames)
        ]
    finally:
        detectors.drop("one")


def test_each_frame_is_answered_with_the_controller_s_command(log: GraspLog) -> None:
    """The same as the detector, the observer and the controller give one after the other."""
    assert log.force is not None
    detector, observer = SlipDetector(log.position, log.element_area), Observer(log.position)
    state = GraspController.init(settings_of(ROUND))
    for k, answer in enumerate(answers(log, ROUND)):
        frame = Frame(float(log.time[k]), log.displacement[k], log.force[k], None)
        observer, seen = observer.step(frame, detector.step(frame.time, frame.displacement, frame.force))
        state, command = GraspController.step(state, seen)
        assert answer["command"] == asdict(command)
    assert state.normal_force > FORCES["least_force"]


def test_without_a_controller_nothing_is_commanded(log: GraspLog) -> None:
    assert all("command" not in answer for answer in answers(log, None))


def test_those_who_watch_see_what_the_controller_commands(log: GraspLog) -> None:
    assert log.force is not None
    open_session(log, ROUND)
    given = PackedFrame(0, float(log.time[0]), log.displacement[0].tobytes(), log.force[0].tobytes())
    answer, shown = detectors.step("one", given, is_shown=True)
    detectors.drop("one")
    assert shown is not None
    assert f'"command":{answer["command"]["normal_force"]}'.encode() in shown.replace(b" ", b"")


def test_a_contact_that_bears_no_torque_is_refused_for_frames_have_some(log: GraspLog) -> None:
    with pytest.raises(InvalidInput, match=r"control: torque_arm is 0.0; allowed: above 0 m, .* such as 0\.\d+ m"):
        answers(log, Control(6e-5, FORCES, torque_arm=0.0))


def test_what_the_controller_refuses_leaves_the_session_as_it_was(
    log: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = answers(log, ROUND)
    step, seen = GraspController.step, []

    def refuse_every_other(state: Any, observation: Any) -> Any:
        seen.append(observation)
        if len(seen) % 2:
            raise InvalidArgument("torque", 1.0, "0")
        return step(state, observation)

    monkeypatch.setattr(GraspController, "step", refuse_every_other)
    assert log.force is not None
    open_session(log, ROUND, keep=True)
    try:
        for k, (time, displacement, force) in enumerate(
            zip(log.time.tolist(), log.displacement, log.force, strict=True)
        ):
            given = PackedFrame(k, time, displacement.tobytes(), force.tobytes())
            with pytest.raises(InvalidInput, match=r"control: torque is 1\.0; allowed: 0"):
                detectors.step("one", given)
            assert detectors.step("one", given)[0]["command"] == expected[k]["command"]
        assert len(detectors._SESSIONS["one"].kept or []) == len(log)
    finally:
        detectors.drop("one")
    assert any(each.slip_samples is not None for each in seen)  # of which the last frames decide


def test_torque_is_about_what_presses_wherever_places_are_counted_from(log: GraspLog) -> None:
    assert log.force is not None
    shear = log.force[40].copy()
    shear[..., 0] = 0.3 * np.maximum(-shear[..., 2], 0.0)  # all pulls along x, in proportion to pressure: no torque
    for shift in (0.0, 0.05):
        found = SlipDetector(log.position, log.element_area).step(0.0, log.displacement[40], log.force[40])
        shifted = log.position + np.array([shift, 2.0 * shift, 0.0])
        shear[..., 1] = 0.0
        _, seen = Observer(shifted).step(Frame(0.0, log.displacement[40], shear, None), found)
        beside = 1e-8  # m: what is beside the contact has no part in its centre
        assert seen.torque == pytest.approx(0.0, abs=beside * seen.tangential)
        arm = shifted[..., 0] - shifted[..., 0].mean()
        shear[..., 1] = -arm * shear[..., 2] * found.contact
        _, turned = Observer(shifted).step(Frame(0.0, log.displacement[40], shear, None), found)
        assert turned.torque > 1e-5


def test_samples_tell_how_many_of_what_slips_is_seen_to_move(log: GraspLog) -> None:
    assert log.force is not None
    found = SlipDetector(log.position, log.element_area).step(0.0, log.displacement[40], log.force[40])
    pressing = np.where(found.contact, -log.force[40][..., 2], 0.0)
    pressed = pressing > LEAST_SHARE * pressing.max()
    velocity = np.zeros((*log.grid, 2))
    velocity[tuple(np.argwhere(pressed)[0])] = 3.0 * LEAST_SPEED
    slides, observer = replace(found, slip=found.contact, velocity=velocity), Observer(log.position)
    for k in range(WINDOW):
        observer, seen = observer.step(Frame(float(k), log.displacement[40], log.force[40], None), slides)
    assert seen.slip_samples is not None
    assert seen.slip_samples.normal_force.size == 1
    assert seen.slip_samples.moving == pytest.approx(1.0 / pressed.sum())


def test_a_frame_without_forces_is_refused_and_leaves_all_as_it_was(log: GraspLog) -> None:
    assert log.force is not None
    open_session(log, ROUND)
    time, displacement = float(log.time[0]), log.displacement[0].tobytes()
    with pytest.raises(InvalidInput, match="force is None; allowed: the elements' forces"):
        detectors.step("one", PackedFrame(0, time, displacement))
    assert detectors.step("one", PackedFrame(0, time, displacement, log.force[0].tobytes()))[0]["type"] == "state"
    detectors.drop("one")


def test_unknown_forces_are_left_out_of_what_is_observed(log: GraspLog) -> None:
    assert log.force is not None
    force = log.force[30].copy()
    detector, observer = SlipDetector(log.position, log.element_area), Observer(log.position)
    found = detector.step(0.0, log.displacement[30], force)
    row, column = np.argwhere(found.contact)[0]
    force[row, column] = np.nan
    _, seen = observer.step(Frame(0.0, log.displacement[30], force, None), found)
    known = binary_dilation(found.contact)  # and the elements beside it
    known[row, column] = False
    assert seen.normal == pytest.approx(-log.force[30][known].sum(axis=0)[2], rel=1e-12)


@pytest.mark.parametrize(
    ("control", "message"),
    [
        (Control(6e-5, {"least_force": 1.0}), "control: most_force is not given; allowed: 0.001 to 10000 N"),
        (Control(6e-5, {**FORCES, "grip": 1.0}), "control: settings is grip; allowed: least_force, most_force"),
        (Control(6e-5, {**FORCES, "learn_frames": 2.5}), "control: learn_frames is 2.5; allowed: a whole number"),
        (Control(6e-5, {**FORCES, "lead_time": -1.0}), "control: lead_time is -1.0; allowed: 0 to 1 s"),
        (Control(0.0, FORCES), "control: area is 0.0; allowed: 1e-12 to 1 m²"),
        (Control(6e-5, FORCES, round_at=-1.0), "control: at_force is -1.0"),
    ],
)
def test_settings_that_cannot_be_are_named(log: GraspLog, control: Control, message: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        answers(log, control)
    assert str(refused.value).startswith(message)


def test_frames_are_counted_in_whole_numbers_however_they_come() -> None:
    assert settings_of(Control(6e-5, {**FORCES, "learn_frames": 5.0})).learn_frames == 5
    contact = settings_of(Control(6e-5, FORCES, pressure_square=1.3, torque_arm=2e-3)).contact
    assert (contact.pressure_square, contact.torque_arm) == (1.3, 2e-3)
