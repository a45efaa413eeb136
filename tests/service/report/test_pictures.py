from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.figure import Figure

from service.report.pictures import (
    MOST_SAMPLES,
    SNAPSHOTS,
    SlipOverTime,
    draw_slip,
    friction_sections,
    marginals,
    slip_over_time,
    truth_over_time,
)
from slipcore import FrictionLaw, FrictionSamples, GraspLog, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp
from tests.service.report.test_material import MODEL


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


@pytest.fixture(scope="module")
def ramp() -> GraspLog:
    schedule = RampSchedule(rest=0.1, press=0.2, settle=0.1, shear=0.3, hold=0.1)
    return tangential_ramp(points=8, pitch=2e-3, schedule=schedule)


def line(figure: Figure, label: str) -> np.ndarray:
    """What is drawn under a name, [2, k]."""
    (found,) = (each for axes in figure.axes for each in axes.lines if each.get_label() == label)
    return np.array(found.get_data())


def test_the_detected_stick_ratio_stands_above_the_true_one_where_that_is_known(ramp: GraspLog) -> None:
    history = detect_slip(ramp)
    figure = slip_over_time(replace(ramp, time=ramp.time + 5.0), history, "a ramp")
    assert ramp.truth is not None
    np.testing.assert_allclose(line(figure, "detected (filter)"), [ramp.time, history.stick_ratio], atol=1e-12)
    np.testing.assert_allclose(line(figure, "truth"), [ramp.time, ramp.truth.stick_ratio], atol=1e-12)
    assert figure.axes[0].get_xlim() == pytest.approx((0.0, ramp.time[-1]))
    unknown = slip_over_time(replace(ramp, truth=None), history, "")
    assert [each.get_label() for each in unknown.axes[0].lines if "_" not in str(each.get_label())] == [
        "detected (filter)"
    ]


def test_maps_are_of_evenly_spaced_moments_from_the_first_contact_to_the_last(ramp: GraspLog) -> None:
    history = detect_slip(ramp)
    touched = np.flatnonzero(history.contact.any(axis=(1, 2)))
    titles = [axes.get_title() for axes in slip_over_time(ramp, history, "").axes[1:]]
    assert len(titles) == SNAPSHOTS
    assert (titles[0], titles[-1]) == (f"{ramp.time[touched[0]]:.2f} s", f"{ramp.time[touched[-1]]:.2f} s")
    assert np.ptp(np.diff([float(title.removesuffix(" s")) for title in titles])) < 0.05


def test_forces_of_a_simulated_grasp_are_sums_pressure_upwards(ramp: GraspLog) -> None:
    figure = truth_over_time(ramp, "truth")
    assert ramp.force is not None
    total = ramp.force.sum(axis=(1, 2))
    np.testing.assert_allclose(line(figure, "normal force")[1], -total[:, 2], atol=1e-12)
    np.testing.assert_allclose(line(figure, "tangential force")[1], np.hypot(*total[:, :2].T), atol=1e-12)
    with pytest.raises(ValueError, match="without truth or forces; allowed: a simulated one"):
        truth_over_time(replace(ramp, truth=None), "")
    with pytest.raises(ValueError, match="without truth or forces"):
        truth_over_time(replace(ramp, force=None), "")


def test_sections_are_those_of_the_model_through_the_middle_of_its_data_in_mn_and_mm() -> None:
    truth = FrictionLaw((0.5, 2.0, -1.0))
    over_force, over_velocity = friction_sections(MODEL, truth=truth).axes
    velocity, force = 5.5e-4, 0.07
    x, mean = over_force.lines[0].get_data()
    np.testing.assert_allclose(x, np.linspace(20.0, 120.0, 60))
    np.testing.assert_allclose(mean, 0.45 + 0.1 * velocity - 0.02 * 1e-3 * np.asarray(x))
    np.testing.assert_allclose(over_force.lines[1].get_ydata(), 0.5 + 2.0 * velocity - 1e-3 * np.asarray(x))
    x, mean = over_velocity.lines[0].get_data()
    np.testing.assert_allclose(x, np.linspace(0.1, 1.0, 60))
    np.testing.assert_allclose(mean, 0.45 + 0.1 * 1e-3 * np.asarray(x) - 0.02 * force)
    assert "(line at v = 0.55 mm/s)" in over_force.get_xlabel()
    assert "(line at fₙ = 70 mN)" in over_velocity.get_xlabel()
    (band,) = over_force.collections
    low, high = (MODEL.predict(velocity, 0.02, quantile=level) for level in (0.05, 0.95))
    ends = [y for x, y in band.get_paths()[0].vertices if x == pytest.approx(20.0)]
    assert (min(ends), max(ends)) == (pytest.approx(float(low)), pytest.approx(float(high)))


def test_samples_are_thinned_out_evenly_and_sections_run_through_their_middle() -> None:
    count = 3 * MOST_SAMPLES
    force, velocity = np.linspace(0.01, 0.05, count), np.full(count, 3e-4)
    at = np.arange(count)
    arrays = (np.full(count, 0.4), velocity, force, 0.4 * force, at * 0.1, at, np.ones(count))
    samples = FrictionSamples(*arrays, 1e-6, velocity_is_relative=at < 10)
    over_force, over_velocity = friction_sections(MODEL, samples).axes
    shown = over_force.collections[0].get_offsets()
    assert len(shown) == MOST_SAMPLES
    assert (shown[0, 0], shown[-1, 0]) == (pytest.approx(10.0), pytest.approx(50.0))
    assert "v = 0.3 mm/s" in over_force.get_xlabel()
    assert "fₙ = 30 mN" in over_velocity.get_xlabel()
    drawn = np.asarray(over_velocity.collections[0].get_offsets())[:, 0]
    assert drawn[0] == 0.0  # where the object's motion is unknown a fit takes it as at rest
    assert drawn[-1] == pytest.approx(0.3)


def test_marginals_are_densities_with_the_truth_where_it_has_a_value() -> None:
    for law, marked in ((FrictionLaw((0.5, 0.0, 0.0)), 3), (FrictionLaw((0.5, 0.0, 0.0), 0.03), 4)):
        axes = marginals(MODEL, truth=law).axes
        lines = [each for one in axes for each in one.lines if each.get_label() == "truth"]
        assert [each.get_xdata()[0] for each in lines] == [0.5, 0.0, 0.0, 0.03][:marked]
    for one in axes[:3]:
        x, y = one.collections[0].get_paths()[0].vertices.T
        upper = (y > 0.0) & (np.append(np.diff(x), 0.0) > 0.0)
        assert np.trapezoid(y[upper], x[upper]) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(("points", "size"), [(8, 75.0), (20, 12.0), (40, 3.0)])
def test_marks_of_a_map_shrink_with_the_distance_of_the_elements(points: int, size: float) -> None:
    place = np.stack(np.mgrid[:points, :points], axis=-1) * 16e-3 / points
    none = np.zeros((3, points, points), bool)
    figure = draw_slip(SlipOverTime(np.arange(3.0), place, none, none, np.ones(3), "nobody"))
    (marks,) = {float(each) for axes in figure.axes for part in axes.collections for each in part.get_sizes()}
    assert marks == pytest.approx(size)
