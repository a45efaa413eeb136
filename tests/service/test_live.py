"""Live detectors, without the process and the network around them."""

import numpy as np
import pytest

from service import live
from slipcore import GraspLog, collect_samples, detect_slip


def feed(log: GraspLog, *, look_between: bool) -> dict[str, object]:
    """All frames, with time for looks between them or only at their end; the friction that was found."""
    assert log.force is not None
    live.open_session("one", log.position.tolist(), log.grid, log.element_area, "filter", keep=False)
    for k, time in enumerate(log.time.tolist()):
        live.step("one", k, time, log.displacement[k].tobytes(), log.force[k].tobytes(), None, None)
        if look_between:
            live.look()
    while live.look():
        pass
    friction = live._SESSIONS["one"].friction
    live.drop("one")
    assert friction is not None
    return friction


def test_looks_once_a_second_find_the_samples_of_the_whole_log(ramp: GraspLog) -> None:
    samples = collect_samples(ramp, detect_slip(ramp))
    looked_until = ramp.time[live.WINDOW - 1 + (len(ramp) - live.WINDOW) // live.STRIDE * live.STRIDE]
    expected = np.count_nonzero(samples.time < looked_until)
    friction = feed(ramp, look_between=True)
    assert friction["samples"] == pytest.approx(expected, rel=0.05, abs=0)  # each look estimates the noise anew
    assert np.all(np.isfinite(friction["coefficients"]))


def test_a_look_that_still_waits_when_the_next_is_due_is_not_lost(ramp: GraspLog) -> None:
    assert feed(ramp, look_between=False) == feed(ramp, look_between=True)
