"""What the page of concepts says of its pictures."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import concepts

PAGE = Path(__file__).parents[2] / "docs" / "concepts.md"


def test_the_page_shows_each_picture() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name in concepts.PICTURES:
        assert f"(images/concept-{name}.png)" in text
        assert (PAGE.parent / "images" / f"concept-{name}.png").exists()


@pytest.mark.parametrize(("load", "told"), [(0.5, "63 % stick"), (0.95, "still 14 %")])
def test_the_stick_ratios_that_the_page_tells(load: float, told: str) -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert told in text
    assert f"{concepts.loaded(load).stick_ratio:.0%}".replace("%", " %") in told


def test_the_linear_law_is_close_over_the_forces_observed_and_falls() -> None:
    intercept, slope = concepts.linear_law()
    force = np.linspace(*concepts.OBSERVED, 20)
    assert np.abs(intercept + slope * force - concepts.friction_of_tip(force)).max() < 0.02
    assert slope < 0.0
    assert -intercept / (2.0 * slope) == pytest.approx(0.24, abs=0.005)  # N, from where the line bears less


def test_twice_the_load_has_less_than_twice_the_area() -> None:
    bears = concepts.friction_of_tip(np.array([0.05, 0.1])) - concepts.PRESSURE_PART
    assert 2.0 * bears[1] / bears[0] == pytest.approx(1.59, abs=0.005)


def test_what_is_detected_follows_the_closed_form() -> None:
    load, seen = concepts.observed_ratio()
    assert load.max() == pytest.approx(0.98, abs=0.01)
    assert np.abs(seen - np.clip(1.0 - load, 0.0, 1.0) ** (2 / 3)).max() < 0.15


@pytest.mark.parametrize("name", concepts.PICTURES)
def test_each_axis_begins_at_zero_and_has_a_unit(name: str) -> None:
    axes = [each for each in concepts.PICTURES[name]().axes if each.get_xlabel()]
    assert all("[" in each.get_xlabel() and "[" in each.get_ylabel() for each in axes)
    assert all(each.get_ylim()[0] == 0.0 for each in axes)
    assert bool(axes) == (name != "slip")
