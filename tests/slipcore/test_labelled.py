import csv
import io
import sys
from dataclasses import replace

import numpy as np
import pytest

from estimators import fit
from slipcore import FrictionSamples, GraspLog, SlipHistory, collect_samples, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp

SHORT = RampSchedule(rest=0.1, press=0.3, settle=0.1, shear=0.6, hold=0.1)


@pytest.fixture(scope="module")
def log() -> GraspLog:
    return tangential_ramp(points=10, pitch=1.5e-3, schedule=SHORT, marker_noise=1e-6, seed=1)


@pytest.fixture(scope="module")
def history(log: GraspLog) -> SlipHistory:
    return detect_slip(log)


@pytest.fixture(scope="module")
def samples(log: GraspLog, history: SlipHistory) -> FrictionSamples:
    found = collect_samples(log, history)
    assert len(found)
    return found


def test_samples_are_a_table_with_a_row_each(samples: FrictionSamples) -> None:
    table = samples.to_dataframe()
    assert list(table.columns) == list(samples.arrays())
    for name in samples.arrays():
        assert np.array_equal(table[name].to_numpy(), getattr(samples, name))
    numbers = ("element_area", "normal_force_noise", "velocity_noise")
    assert table.attrs == {name: getattr(samples, name) for name in numbers}


def test_samples_are_labelled_with_their_units(samples: FrictionSamples) -> None:
    data = samples.to_xarray()
    assert data.sizes == {"sample": len(samples)}
    assert data.tangential_velocity.attrs["units"] == "m/s"
    assert data.friction_coefficient.attrs["units"] == "1"
    assert np.array_equal(data.normal_force, samples.normal_force)


def test_a_history_has_a_row_a_frame(history: SlipHistory) -> None:
    table = history.to_dataframe()
    assert np.array_equal(table.index, history.time)
    touching, slipping = table.elements_in_contact, table.elements_in_slip
    shares = 1.0 - slipping[touching > 0] / touching[touching > 0]
    assert shares.to_numpy() == pytest.approx(table.stick_ratio[touching > 0].to_numpy(), abs=0.02)
    assert table.attrs["method"] == history.method


def test_a_history_is_labelled_by_time_and_element(history: SlipHistory) -> None:
    data = history.to_xarray()
    assert data.slip.dims == ("time", "row", "column")
    assert data.velocity.dims == ("time", "row", "column", "plane_axis")
    assert data.velocity.attrs["units"] == "m/s"
    when = history.time[len(history.time) // 2]
    assert np.array_equal(data.slip.sel(time=when), history.slip[len(history.time) // 2])
    assert "observed" not in data  # all were


def test_a_log_is_labelled_and_what_it_has_not_is_left_out(log: GraspLog) -> None:
    assert np.array_equal(log.to_xarray().displacement.sel(axis="z"), log.displacement[..., 2])
    without = replace(log, force=None, object_pose=None).to_xarray()
    assert {"force", "object_pose"}.isdisjoint(without.data_vars)
    assert log.to_xarray().attrs == {"sensor": log.sensor, "element_area_m2": log.element_area}


def test_a_notebook_shows_records_and_what_somebody_typed_as_text(
    log: GraspLog, history: SlipHistory, samples: FrictionSamples
) -> None:
    shown = replace(log, sensor="<script>alert(1)</script>")._repr_html_()
    assert "&lt;script&gt;" in shown
    assert "<script>" not in shown
    assert history._repr_html_().count('<path d="M') == 1
    assert f"<td>{len(samples)}</td>" in samples._repr_html_()
    assert "<td>0</td>" in samples.take(np.zeros(len(samples), bool))._repr_html_()


def test_no_cell_of_a_table_is_a_formula_whatever_somebody_typed(log: GraspLog, history: SlipHistory) -> None:
    typed = replace(log, sensor='=HYPERLINK("http://x")', metadata={"object": "@SUM(1)", "+1": "-2+3", "\t=1": "\t=1"})
    samples = collect_samples(typed, history)
    for table in (samples, history, fit(samples, method="ols")):
        cells = {cell for row in csv.reader(io.StringIO(table.to_dataframe().to_csv())) for cell in row}
        doubtful = {cell for cell in cells if cell.startswith(("=", "+", "-", "@", "\t", "\r"))}
        assert all(np.isfinite(float(cell)) for cell in doubtful)


def test_frames_without_contact_leave_a_gap_in_the_curve(history: SlipHistory) -> None:
    ratio = np.array([np.nan, 1.0, 0.5, np.nan, 0.25, 0.0])
    shown = replace(history, stick_ratio=ratio)._repr_html_()
    assert 'd="M72.0 0.0 L144.0 30.0 M288.0 45.0 L360.0 60.0"' in shown


@pytest.mark.parametrize(("library", "method"), [("pandas", "to_dataframe"), ("xarray", "to_xarray")])
def test_without_the_library_it_says_what_to_install(
    samples: FrictionSamples, library: str, method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ModuleNotFoundError) as caught:
        getattr(samples, method)()
    assert caught.value.__notes__ == [f"{library} comes with the extra `notebook` of stiction"]
