from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import PathCollection, QuadMesh

from service.report.pictures import SNAPSHOTS, slip_over_time
from slipcore import GraspLog, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp


@pytest.fixture(params=[(20, PathCollection), (80, QuadMesh)], ids=["sparse", "dense"])
def seen(request: pytest.FixtureRequest) -> tuple[GraspLog, type]:
    points, kind = request.param
    schedule = RampSchedule(rest=0.1, press=0.2, settle=0.1, shear=0.3, hold=0.1)
    return tangential_ramp(points=points, pitch=15e-3 / points, schedule=schedule), kind


def test_maps_show_every_element_however_dense(seen: tuple[GraspLog, type]) -> None:
    log, kind = seen
    history = detect_slip(log)
    figure = slip_over_time(log, history, "a ramp")
    maps = [collection for axes in figure.axes for collection in axes.collections if isinstance(collection, kind)]
    assert len(maps) == SNAPSHOTS
    codes = np.asarray(maps[-1].get_array()).ravel()
    assert codes.size == np.prod(log.grid)
    assert set(codes) <= {0, 1, 2}
    assert np.count_nonzero(codes) == history.contact[np.flatnonzero(history.contact.any(axis=(1, 2)))[-1]].sum()


def test_a_log_without_contact_is_shown_from_its_first_frame_to_its_last() -> None:
    log = tangential_ramp(points=8, schedule=RampSchedule(rest=0.1, press=0.1, settle=0.1, shear=0.1, hold=0.1))
    history = detect_slip(log)
    nothing = np.zeros_like(history.contact)
    figure = slip_over_time(log, replace(history, contact=nothing, slip=nothing), "nothing touched")
    maps = [axes for axes in figure.axes if axes.collections]
    times = [axes.get_title() for axes in maps]
    assert (times[0], times[-1]) == ("0.00 s", f"{log.time[-1] - log.time[0]:.2f} s")
    assert all(not np.any(part.get_array()) for axes in maps for part in axes.collections)
