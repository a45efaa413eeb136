"""How probes of materials are made, chosen and counted."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import special, stats

from benchmarks.estimators import next_grasp
from benchmarks.estimators.next_grasp import (
    ELEMENTS,
    FORCES,
    FRAMES,
    LENGTH,
    MOST,
    PLACES,
    QUANTILE,
    Material,
    needed,
    probe,
    probe_of_all,
    same,
    scheduled,
)
from estimators.grasp_design import Probing, WorkingPoint

POINT = WorkingPoint(0.1, 0.0, QUANTILE, ELEMENTS)
LAW = np.array([0.5, 8.0, -0.4])


def material(*scales: float) -> Material:
    return Material(LAW, scales, POINT)


def test_who_knows_all_tells_the_quantile_of_grasps_or_of_contacts() -> None:
    """Where grasps alone differ it is that of a log-normal of mean 1; where samples do, that of a contact's mean."""
    spread = np.sqrt(np.log(1.01))
    between = stats.lognorm(s=spread, scale=np.exp(-0.5 * spread**2)).ppf(QUANTILE)
    assert material(0.1, 0.0, 0.0).conservative() == pytest.approx(0.46 * between, rel=1e-9)
    own = special.ndtri(1.0 - QUANTILE) * 0.05 / np.sqrt(ELEMENTS)
    assert material(0.0, 0.03, 0.04).conservative() == pytest.approx(0.46 - own, rel=1e-9)
    both = np.hypot(0.46 * (1.0 - between), own)
    assert material(0.1, 0.03, 0.04).conservative() == pytest.approx(0.46 - both, rel=1e-9)


@pytest.mark.parametrize("made", [probe, probe_of_all])
def test_a_probe_without_scatter_lies_on_the_law(made: next_grasp.Probed) -> None:
    moments = made(material(0.0, 0.0, 0.0), (0.15, 2e-3, LENGTH), np.random.default_rng(1))
    np.testing.assert_allclose(moments.fit().coefficients, LAW, rtol=1e-6)


def test_a_probe_lasts_as_long_as_its_slip_and_presses_as_asked() -> None:
    rng = np.random.default_rng(2)
    slow, fast = (probe(material(0.0, 0.0, 0.0), (0.15, speed, 1e-3), rng) for speed in (2e-3, 6e-3))
    assert slow.n / fast.n == 15 / 5
    shortest = probe(material(0.0, 0.0, 0.0), (0.15, 1.0, 1e-3), rng)
    assert shortest.n / fast.n == 2 / 5
    low, high = probe(material(0.0, 0.0, 0.0), (0.3, 2e-3, 1e-3), rng).domain.normal_force
    assert (low, high) == pytest.approx([2.0 * each for each in slow.domain.normal_force], rel=1e-12)
    assert 0.0 < slow.domain.normal_force[0] < 0.15 < slow.domain.normal_force[1] < 0.15 * 1.5  # Hertz: 1.5 times


def test_a_probe_of_all_has_every_place_in_every_frame() -> None:
    moments = probe_of_all(material(0.0, 0.0, 0.0), (1.0, 1.0, 1.0), np.random.default_rng(3))
    assert moments.n == PLACES * FRAMES
    assert FORCES[0] <= moments.domain.normal_force[0] < moments.domain.normal_force[1] <= FORCES[1]


def test_grasps_differ_by_a_factor_of_mean_1() -> None:
    rng, loose = np.random.default_rng(4), material(0.1, 0.0, 0.0)
    factors = [probe(loose, (0.15, 2e-3, LENGTH), rng).fit().coefficients[0] / LAW[0] for _ in range(200)]
    assert np.mean(factors) == pytest.approx(1.0, abs=4.0 * 0.1 / np.sqrt(200.0))
    assert np.std(factors) == pytest.approx(0.1, rel=0.2)  # four standard errors


def test_a_schedule_goes_through_speeds_at_each_force_and_begins_again() -> None:
    speeds, forces = [5e-4, np.sqrt(5e-4 * 4e-3), 4e-3], [0.05, 0.15, 0.45]
    expected = [(force, speed, LENGTH) for force in forces for speed in speeds]
    found = [scheduled(None, count) for count in range(1, 12)]
    np.testing.assert_allclose(found, expected + expected[:2], rtol=1e-12)
    assert {same(None, count) for count in range(1, 12)} == {(0.15, 2e-3, LENGTH)}


def robot(monkeypatch: pytest.MonkeyPatch, told: list[float]) -> tuple[int, float]:
    """What a robot needs whose fits tell these, one after the other, over what is true."""
    truth, answers = material(0.0, 0.0, 0.0).conservative(), iter(told)

    def fit(_: list[Any], **__: Any) -> Any:
        ratio = next(answers)
        return SimpleNamespace(predict=lambda *_, **__: ratio * truth)

    monkeypatch.setattr(next_grasp.estimators, "fit", fit)
    return needed(material(0.0, 0.0, 0.0), lambda _, count: (0.1, 1e-3 * (1 + count), 2e-3), 1)


def test_probes_are_counted_up_to_the_first_of_three_that_are_right_on_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first probe takes 0.5 s of slip, the next ones 1, 2/3 and 1/2 s."""
    count, seconds = robot(monkeypatch, [1.2, 1.09, 0.89, 0.91, 1.0, 1.09])
    assert count == 4
    assert seconds == pytest.approx(4.0 * Probing().seconds + 0.5 + 1.0 + 2.0 / 3.0 + 0.5, rel=1e-9)


def test_who_is_never_right_needs_all_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    assert robot(monkeypatch, [1.0, 1.0, 1.2] * 10)[0] == MOST


def test_materials_are_drawn_within_the_population() -> None:
    drawn = [Material.drawn(np.random.default_rng([1, number])) for number in range(300)]
    levels = np.array([each.law[0] for each in drawn])
    assert 0.25 <= levels.min() < 0.27
    assert 0.78 < levels.max() <= 0.8
    slopes = np.array([each.law[1] * 5e-3 / each.law[0] for each in drawn])
    assert np.std(slopes) == pytest.approx(0.1, rel=0.17)  # four standard errors
    falls = np.array([each.law[2] * 0.2 / each.law[0] for each in drawn])
    assert np.mean(falls) == pytest.approx(-0.05, abs=4.0 * 0.1 / np.sqrt(300.0))
    forces = [each.working_point.normal_force for each in drawn]
    assert FORCES[0] <= min(forces) < max(forces) <= FORCES[1]
    assert np.median([each.scales[0] for each in drawn]) == pytest.approx(0.05, rel=0.12)
