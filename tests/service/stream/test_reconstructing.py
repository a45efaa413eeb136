"""Forces of live streams whose frames have none, without the process and the network around them."""

from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.domain.sensors.reconstruct import CONTRADICTED
from service.formats import read
from service.stream import detector_session, detectors, friction_looks, reconstructing
from service.stream.detector_session import PackedFrame
from service.stream.grip import Grip
from service.stream.messages import Control
from service.stream.observing import SampledForces
from slipcore import Frame, FrictionSamples, GraspLog, InvalidInput, SlipState, collect_samples, detect_slip
from slipcore.defaults import FilterOptions
from slipcore.forces import ForceStream
from slipcore.forces.defaults import RECONSTRUCTION

pytestmark = pytest.mark.usefixtures("looks_at_once")

GEL = {"young_modulus": 1e6, "poisson_ratio": 0.5, "thickness": None, "marker_depth": 0.0}
"""What the ramp is pressed on."""
ROOM = detector_session.MemoryLimit("me", 2**30)
GRIP = Control(6e-5, {"least_force": 0.5, "most_force": 30.0}, round_at=5.0)


def opened(
    log: GraspLog, keep: bool = False, limit: detector_session.MemoryLimit = ROOM, control: Control | None = None
) -> detector_session.DetectorSession:
    options = detector_session.SessionOptions(control, gel=GEL)
    detectors.open_session("one", log.position.tobytes(), log.grid, log.element_area, "filter", keep, limit, options)
    return detectors._SESSIONS["one"]


def frame(log: GraspLog, k: int, *, force: bool = False, **changes: Any) -> PackedFrame:
    assert log.force is not None
    given = log.force[k].tobytes() if force else None
    return PackedFrame(k, float(log.time[k]), log.displacement[k].tobytes(), given)._replace(**changes)


def fed(log: GraspLog) -> list[dict[str, Any]]:
    return [detectors.step("one", frame(log, k))[0] for k in range(len(log))]


def test_forces_slip_samples_and_commands_follow_from_displacement(
    ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert ramp.force is not None
    found: list[FrictionSamples] = []

    def collected(*arguments: Any, **options: float) -> FrictionSamples:
        assert 1e-3 < options["force_noise"] < 1e-2
        assert options["force_to_noise"] == RECONSTRUCTION.force_to_noise
        found.append(collect_samples(*arguments))
        return found[-1]

    sampled: list[SampledForces | None] = []

    def stepped(grip: Grip, frame: Frame, state: SlipState, of: SampledForces | None) -> dict[str, Any]:
        sampled.append(of)
        return step_grip(grip, frame, state, of)

    step_grip = Grip.step
    monkeypatch.setattr(Grip, "step", stepped)
    monkeypatch.setattr(friction_looks, "collect_samples", collected)
    session = opened(ramp, control=GRIP)
    reports = -ramp.force[..., 2].sum(axis=(1, 2))
    answers = [detectors.step("one", frame(ramp, k, gripper_force=reports[k]))[0] for k in range(len(ramp))]
    assert session.forces is not None
    assert isinstance(options := session.detector.state.setup.options, FilterOptions)
    noise = session.forces.of_samples["force_noise"]
    assert options.force_floor == session.forces.deviation == noise  # as unsure as samples' forces
    assert options.heading_length > 0.0 == FilterOptions().heading_length
    assert [answer["force"]["wait_for"] for answer in answers[:14]] == ["noise"] * 14
    history = detect_slip(ramp)
    for k in (40, 60, 80):
        told = answers[k]["force"]
        assert told["source"] == "reconstructed"
        assert told["age"] < 0.5
        assert told["given"]
        assert told["findings"] == []
        np.testing.assert_allclose(told["resultant"], ramp.force[k].sum(axis=(0, 1)), atol=0.5)
        assert answers[k]["stick_ratio"] == pytest.approx(history.stick_ratio[k], abs=0.1)
    contradictions = [told for answer in answers if (told := answer["force"]["contradiction"]) is not None]
    assert 0.0 < np.median(contradictions) < 3.0
    assert answers[-1]["command"]["normal_force"] > 0.5
    np.testing.assert_array_equal(session.frames[-1].force, session.forces.alike)  # samples are of these
    assert sampled[-1] is not None
    np.testing.assert_array_equal(sampled[-1].force, session.forces.alike)  # the grip controller's, too
    assert sampled[-1].least == RECONSTRUCTION.force_to_noise * noise
    assert session.look is not None
    session.look.result()
    assert np.median(found[-1].friction_coefficient) == pytest.approx(0.4, rel=0.05)


def test_a_kept_log_is_stored_without_them_for_its_job_finds_better_ones(ramp: GraspLog, tmp_path: Path) -> None:
    opened(ramp, keep=True)
    for k, (force, deviation) in enumerate(((0.5, 0.2), (None, None), (0.4, 0.1))):
        given = frame(ramp, k, gripper_force=force, gripper_force_deviation=deviation)
        told = detectors.step("one", given)[0]["force"]
        assert (told["wait_for"], told["given"], told["contradiction"]) == ("noise", force is not None, None)
    detectors.write("one", tmp_path / "log.npz", "gel sensor")
    log = read(tmp_path / "log.npz")
    assert log.force is None
    assert log.normal is None
    assert log.sensor == "gel sensor"
    np.testing.assert_array_equal(log.gripper_force, [0.5, 0.0, 0.4])
    assert log.gripper_force_deviation == 0.2


def test_a_grippers_force_that_is_none_is_refused_and_one_that_is_contradicted_told(
    ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened(ramp)
    bearable = 10.0 * GEL["young_modulus"] * ramp.element_area * 14**2
    for force, deviation in ((np.nan, None), (-0.2, None), (1.01 * bearable, None), (1.0, -1.0), (None, 1.0)):
        with pytest.raises(InvalidInput, match="gripper_force"):
            detectors.step("one", frame(ramp, 0, gripper_force=force, gripper_force_deviation=deviation))
    monkeypatch.setattr(ForceStream, "contradicted", 0.5)
    (finding,) = detectors.step("one", frame(ramp, 0, gripper_force=1.0))[0]["force"]["findings"]
    assert (finding["name"], "in 50% of the frames" in finding["evidence"]) == (CONTRADICTED, True)


def test_frames_have_forces_all_or_none_by_the_first_one_that_is_taken(ramp: GraspLog) -> None:
    session = opened(ramp)
    detectors.step("one", frame(ramp, 0))
    assert session.all_bytes > session.held_bytes
    with pytest.raises(InvalidInput, match="force is given; allowed: in every frame or in none"):
        detectors.step("one", frame(ramp, 1, force=True))
    assert detectors.step("one", frame(ramp, 2))[0]["force"]["source"] == "reconstructed"
    detectors.drop("one")
    session = opened(ramp)
    with pytest.raises(InvalidInput, match="object_pose"):
        detectors.step("one", frame(ramp, 0, object_pose=[np.nan] * 3))
    assert "force" not in detectors.step("one", frame(ramp, 1, force=True))[0]
    assert session.all_bytes == session.held_bytes
    with pytest.raises(InvalidInput, match="force is missing; allowed: in every frame or in none"):
        detectors.step("one", frame(ramp, 2))


def test_without_room_or_with_too_many_markers_there_are_none_and_it_says_why(
    ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened(ramp, limit=detector_session.MemoryLimit("me", 3 * 2**20))
    assert "bytes is" in detectors.step("one", frame(ramp, 0))[0]["force"]["reason"]
    monkeypatch.setattr(reconstructing, "MOST_NODES", 300)
    opened(ramp)
    reason = detectors.step("one", frame(ramp, 0))[0]["force"]["reason"]
    assert "of which at most 300 cover the markers and what is around them" in reason
    monkeypatch.setattr(reconstructing, "MOST_MARKERS", 100)
    opened(ramp)
    for k in range(2):
        answer = detectors.step("one", frame(ramp, k))[0]
        assert answer["force"] == {"source": "none", "reason": "grid is 196 markers; allowed: at most 100"}
        assert answer["contact"] == 0
    opened(ramp, control=GRIP)
    with pytest.raises(InvalidInput, match="none are reconstructed: grid is 196 markers"):
        detectors.step("one", frame(ramp, 0))
    assert "command" in detectors.step("one", frame(ramp, 0, force=True))[0]


def test_a_look_that_fails_costs_the_stream_that_look(
    ramp: GraspLog, looks_at_once: Executor, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    opened(ramp)
    done = looks_at_once.submit

    def fails_once(_: Any) -> Future[Any]:
        monkeypatch.setattr(looks_at_once, "submit", done)
        return done(lambda: 1 / 0)

    monkeypatch.setattr(looks_at_once, "submit", fails_once)
    assert detectors.step("one", frame(ramp, 0))[0]["force"]["wait_for"] == "noise"
    assert "a look for the contact failed" in caplog.text


def test_looks_that_go_on_failing_end_the_stream_s_forces(
    ramp: GraspLog, looks_at_once: Executor, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    opened(ramp)
    done = looks_at_once.submit
    monkeypatch.setattr(looks_at_once, "submit", lambda _: done(lambda: 1 / 0))
    told = [detectors.step("one", frame(ramp, k))[0]["force"] for k in range(6)]
    assert told[-1] == {"source": "none", "reason": "looking for the contact failed"}
    assert caplog.text.count("a look for the contact failed") == reconstructing.MOST_FAILURES


@pytest.mark.parametrize("first", [0, 20])
def test_forces_that_come_after_the_touch_are_told_with_what_to_do(ramp: GraspLog, first: int) -> None:
    """The ramp itself touches from its eighth frame on, when noise is not known yet."""
    opened(ramp)
    answers = [detectors.step("one", frame(ramp, k))[0] for k in range(first, first + 15)]
    assert [answer["findings"] for answer in answers[:14]] == [[]] * 14
    (finding,) = answers[14]["findings"]
    assert (finding["name"], finding["remedy"]) == ("no rest", "open the stream two seconds before the touch")


def test_who_waits_for_the_forces_before_the_touch_is_told_nothing(ramp: GraspLog) -> None:
    opened(ramp)
    for k in range(15):
        still = ramp.displacement[k % 6].tobytes()
        assert detectors.step("one", frame(ramp, k, displacement=still))[0]["findings"] == []
    touched = frame(ramp, 15, displacement=ramp.displacement[30].tobytes())
    assert detectors.step("one", touched)[0]["findings"] == []
