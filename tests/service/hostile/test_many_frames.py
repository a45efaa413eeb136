from pathlib import Path
from time import process_time

import numpy as np
import pytest

import slipcore
from service import formats
from service.domain.models.stored_results import encode_history, encode_samples, summarise_history, summarise_samples
from slipcore import GraspLog
from stiction_client import container

FRAMES = 50_000
MOST_SECONDS = 2.0
"""s of CPU for as many frames; 0.5 measured, 7 where each frame is a call from Python."""


@pytest.fixture
def small_sensor(ramp: GraspLog) -> GraspLog:
    """Many frames of 2×2 elements of a ramp, over and over."""
    times = -(-FRAMES // len(ramp))
    corner = np.s_[:, :2, :2]
    return GraspLog(
        ramp.time[1] * np.arange(FRAMES),
        ramp.position[:2, :2],
        np.tile(ramp.displacement[corner], (times, 1, 1, 1))[:FRAMES],
        element_area=ramp.element_area,
        force=np.tile(ramp.force[corner], (times, 1, 1, 1))[:FRAMES],  # type: ignore[index]
    )


def test_a_frame_of_few_elements_costs_microseconds_through_all_stages(small_sensor: GraspLog, tmp_path: Path) -> None:
    """2 MB that unpack to a million such frames held a worker for minutes."""
    container.write(small_sensor, tmp_path / "log.npz")
    slipcore.warm_up()
    began = process_time()
    log = formats.read(tmp_path / "log.npz")
    history = slipcore.detect_slip(log, lookahead=slipcore.LOOKAHEAD)
    samples = slipcore.collect_samples(log, history)
    encode_history(history), encode_samples(samples)
    summarise_history(history, 0.0, ""), summarise_samples(samples, None, "")
    assert process_time() - began < MOST_SECONDS
    assert history.contact.shape == (FRAMES, 2, 2)
