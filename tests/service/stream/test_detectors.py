"""Live detectors, without the process and the network around them."""

import numpy as np
import pytest

from service.stream import detectors
from slipcore import GraspLog, collect_samples, detect_slip


def feed(log: GraspLog, *, wait: bool) -> dict[str, object] | None:
    """All frames, with time for the looks between them or only at their end; the friction that was found."""
    assert log.force is not None
    position = log.position.tobytes()
    detectors.open_session("one", position, log.grid, log.element_area, "filter", keep=False, most_bytes=2**30)
    session = detectors._SESSIONS["one"]
    for k, time in enumerate(log.time.tolist()):
        detectors.step("one", k, time, log.displacement[k].tobytes(), log.force[k].tobytes(), None, None)
        if wait and session.look is not None:
            session.look.result()
    assert session.look is not None
    session.look.result()
    detectors.drop("one")
    return session.friction


def test_looks_once_a_second_find_the_samples_of_the_whole_log(ramp: GraspLog) -> None:
    samples = collect_samples(ramp, detect_slip(ramp))
    looked_until = ramp.time[
        detectors.WINDOW - 1 + (len(ramp) - detectors.WINDOW) // detectors.STRIDE * detectors.STRIDE
    ]
    expected = np.count_nonzero(samples.time < looked_until)
    friction = feed(ramp, wait=True)
    assert friction is not None
    assert friction["samples"] == pytest.approx(expected, rel=0.1, abs=2)  # each look estimates the noise anew
    assert np.all(np.isfinite(friction["coefficients"]))


def test_frames_that_come_faster_than_looks_are_looked_at_all_the_same(ramp: GraspLog) -> None:
    assert feed(ramp, wait=False) == feed(ramp, wait=True)


def test_a_look_that_fails_costs_the_stream_nothing_but_its_friction(
    ramp: GraspLog, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(detectors, "collect_samples", fail)
    assert feed(ramp, wait=True) is None
    assert "a look for friction failed" in caplog.text
