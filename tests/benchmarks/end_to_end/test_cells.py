"""What grasps are seen with, and what is told of the fits."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.end_to_end import __main__ as end_to_end
from benchmarks.end_to_end.__main__ import (
    AXES,
    SETTINGS,
    Finding,
    Setting,
    cells,
    coefficients,
    limit,
    seen,
    simulated,
    value,
)
from estimators.method_names import METHODS


@pytest.fixture(scope="module")
def found() -> list[Finding]:
    """Of one seed's two grasps on few elements."""
    return end_to_end.findings(1, [Setting(grasps=2, side=10)])


def test_every_setting_differs_from_the_common_one_in_one_thing_at_most() -> None:
    for axis, settings in AXES.items():
        values = [value(axis, setting) for setting in settings]
        assert value(axis, Setting()) in values
        assert len(set(values)) == len(values)
    fields = Setting.__dataclass_fields__
    for setting in SETTINGS:
        assert sum(getattr(setting, name) != getattr(Setting(), name) for name in fields) <= 1


def test_the_same_pressure_has_the_same_friction_on_elements_of_any_size() -> None:
    small, large = (coefficients(1, area) @ [1.0, 1e-3, 0.08 * area] for area in (1.0, Setting(side=10).area))
    assert Setting(side=10).area == pytest.approx(4.0)
    assert small == pytest.approx(large)


def test_a_setting_sees_its_frames_with_its_noise() -> None:
    log = simulated(0, 0, 10)
    quiet = seen(log, Setting(side=10, thinning=5, marker_noise=0.0, force_noise=0.0), np.random.default_rng(0))
    assert len(quiet.time) == value("frames a grasp", Setting(thinning=5)) == 24
    np.testing.assert_array_equal(quiet.displacement, log.displacement[::5])
    noisy = seen(log, Setting(side=10, marker_noise=1e-5, force_noise=1e-3), np.random.default_rng(0))
    assert log.force is not None
    assert noisy.force is not None
    assert (noisy.displacement - log.displacement[::2]).std() == pytest.approx(1e-5, rel=0.05)
    assert (noisy.force - log.force[::2]).std() == pytest.approx(1e-3, rel=0.05)


def test_every_method_tells_friction_near_the_truth(found: list[Finding]) -> None:
    assert [each.method for each in found] == list(METHODS)
    for each in found:
        assert abs(each.error) < 0.05
        assert each.half_width > 0.0
        assert each.seconds.total > each.seconds.fit > 0.0


def test_refused_fits_count_as_such_and_nowhere_else(found: list[Finding]) -> None:
    first = replace(found[0], error=0.03, half_width=0.02)
    other, refused = replace(first, error=-0.01), replace(first, error=np.nan, half_width=np.nan)
    (cell,) = cells([first, other, refused]).values()
    assert (cell.fits, cell.refused) == (3, 1)
    assert cell.error == pytest.approx(np.sqrt(5e-4))
    assert (cell.half_width, cell.covered) == (0.02, 0.5)
    (nothing,) = cells([refused]).values()
    assert np.isnan(nothing.error)


def test_the_limit_shrinks_with_the_root_of_the_grasps() -> None:
    assert limit(1) == pytest.approx(0.03 * 0.39, rel=0.01)
    assert limit(4) == pytest.approx(0.5 * limit(1))


def test_tables_and_the_picture_show_what_there_is(found: list[Finding], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(end_to_end, "AXES", dict.fromkeys(AXES, (found[0].setting,)))
    told = cells(found)
    assert end_to_end.accuracy_table(told).count("\n") == 1 + len(AXES)
    assert end_to_end.seconds_table(told).splitlines()[2].startswith("| grasps | 2 |")
    assert len(end_to_end.draw(told).axes) == 6
