"""What the paper's figures are measured with, on logs whose answer is known."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.paper import figure_02, figure_03, figure_06, figure_07, figure_10, figure_13, figure_16
from benchmarks.paper.__main__ import FIGURES
from benchmarks.paper.common import (
    f1_score,
    radius,
    stick_ratio_error,
    strain_rates,
    strains,
    total_force,
    true_slip,
)
from benchmarks.paper.stick_ratios import compare
from slipcore import GraspLog, GroundTruth

TIME = 0.1 * np.arange(21)


def stretched(rate: float = 0.1) -> GraspLog:
    """Markers that are stretched along x at a constant rate, 1/s; half of them slip from 1 s on."""
    x, y = np.meshgrid(1e-3 * np.arange(6), 1e-3 * np.arange(5), indexing="ij")
    position = np.stack([x, y, 0.0 * x], axis=-1)
    along = rate * TIME[:, None, None] * x
    displacement = np.stack([along, 0.0 * along, 0.0 * along], axis=-1)
    force = np.broadcast_to([0.01, 0.0, -0.1], displacement.shape)
    slip = np.zeros((21, 6, 5), bool)
    slip[10:, :3] = True
    contact = np.ones_like(slip)
    ratio = np.where(np.arange(21) < 10, 1.0, 0.5)
    return GraspLog(
        TIME, position, displacement, 1e-6, force=force, truth=GroundTruth(contact, slip, slip, ratio, None)  # type: ignore[arg-type]
    )  # fmt: skip


def test_strain_of_a_stretch_is_green_and_lagrange_s() -> None:
    """E = e + e²/2 for a stretch 1 + e; its rate is ė(1 + e), with its own sign as it grows."""
    log = stretched()
    e = 0.1 * TIME
    inside = np.s_[:, 1:-1, 1:-1]
    expected = (e + 0.5 * e**2)[:, None, None]
    np.testing.assert_allclose(strains(log)[:, 0][inside], expected + np.zeros((21, 4, 3)), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(strains(log)[:, 1:][:, :, 1:-1, 1:-1], 0.0, rtol=0.0, atol=1e-12)
    size, signed = strain_rates(log)
    between = np.diff(e + 0.5 * e**2) / 0.1
    np.testing.assert_allclose(size[inside][1:, 0, 0], between, rtol=1e-9, err_msg="rounding")
    np.testing.assert_allclose(signed[inside][1:], size[inside][1:], rtol=1e-9, err_msg="it grows")
    assert not size[0].any()


def test_masks_and_sums_of_a_log() -> None:
    log = stretched()
    np.testing.assert_allclose(total_force(log), np.broadcast_to([0.3, 0.0, -3.0], (21, 3)), rtol=1e-12)  # 30 elements
    assert radius(log)[3, 4] == pytest.approx(5e-3)
    assert true_slip(log)[10:, :3].all()
    assert true_slip(log).sum() == 11 * 15


@pytest.mark.parametrize(
    ("true", "found", "score"),
    [([1, 1, 0, 0], [1, 0, 1, 0], 0.5), ([1, 1, 0, 0], [1, 1, 0, 0], 1.0), ([1, 0, 0, 0], [0, 1, 1, 0], 0.0)],
)
def test_f1_is_the_harmonic_mean_of_precision_and_recall(true: list[int], found: list[int], score: float) -> None:
    assert f1_score(np.array(true, bool), np.array(found, bool)) == score
    assert np.isnan(f1_score(np.zeros(4, bool), np.zeros(4, bool)))


def history(ratio: np.ndarray, slip: np.ndarray) -> Any:
    return SimpleNamespace(stick_ratio=ratio, slip=slip)


def test_methods_are_compared_by_error_and_f1_with_their_mean() -> None:
    log = stretched()
    assert log.truth is not None
    right = history(log.truth.stick_ratio, true_slip(log))
    wrong = history(log.truth.stick_ratio + 0.3, np.ones_like(true_slip(log)))
    assert stick_ratio_error(log, wrong) == pytest.approx(0.3)
    assert stick_ratio_error(log, right, TIME > 1.0) == 0.0
    text, rows = compare({"a": log, "b": log}, {"a": {"filter": right}, "b": {"filter": wrong}})
    share = 11 * 15 / (21 * 30)
    assert rows[2] == pytest.approx(
        {"scene": "mean", "filter: error": 0.15, "filter: F1": 0.5 * (1.0 + 2.0 * share / (1.0 + share))}
    )
    assert text.count("\n") == 4


def test_the_printed_slip_is_right_at_none_and_wrong_by_half_at_the_edge() -> None:
    """At the edge of stick arcsin is π/2, so that both printed forms vanish; far out the slip tends to H₁."""
    assert figure_02.printed_slip(np.array([1e-3]), 1e-3)[0] == pytest.approx(0.0, abs=1e-18)
    assert figure_02.printed_slip(np.array([1e3]), 1e-3)[0] == pytest.approx(figure_02.scale(), rel=1e-5)
    assert figure_02.printed_gradient(np.array([0.5e-3, 1e-3]), 1e-3) == pytest.approx([0.0, 0.0], abs=1e-18)
    row = figure_02._row(np.linspace(1e-5, 3e-3 * (1 - 1e-9), 300), 1.5e-3)
    assert row["edge"] == pytest.approx(2.0)
    assert row["gradient_error"] < 1e-4  # of a finite difference
    assert row["peak"] > row["printed_peak"]


@pytest.mark.parametrize(("case", "last", "press"), [(1, 1.3e-3, 1.0), (2, 0.8e-3, 2.0), (3, -0.4e-3, 1.0)])
def test_the_beams_are_moved_as_their_case_says(case: int, last: float, press: float) -> None:
    travel, factor = figure_03.motion(case)
    assert (travel[0], factor[0]) == (0.0, 1.0)
    assert (travel[-1], factor[-1]) == pytest.approx((last, press))
    assert travel.max() == pytest.approx(max(last, 0.8e-3), rel=0.02)


def test_moments_of_a_load_are_found() -> None:
    log: Any = SimpleNamespace(time=np.linspace(0.0, 2.0, 61))
    assert [log.time[figure_06.frame_at(log, share)] for share in (0.2, 0.4, 1.0)] == pytest.approx([2 / 3, 1.0, 2.0])
    stages = [figure_10._stage(log, name) for name in figure_10.STAGES]
    np.testing.assert_array_equal(np.sum(stages, axis=0), (log.time > 1 / 3 + 1e-9).astype(int))  # each frame once


def test_an_onset_is_the_first_slipping_frame() -> None:
    assert figure_07._onset(TIME, TIME > 0.75) == pytest.approx(0.8)
    assert np.isnan(figure_07._onset(TIME, TIME > 5.0))
    log = stretched()
    early = history(np.ones(21), np.broadcast_to((TIME > 0.75)[:, None, None], (21, 6, 5)))
    never = history(np.ones(21), np.zeros((21, 6, 5), bool))
    row = figure_07._row("1, p_a", log, {"filter": early, "strain_rate": never}, (1, 1))
    assert row == {"point": "1, p_a", "begins": pytest.approx(1.0), "filter": "-2", "strain_rate": "never"}


def test_stages_and_spans_of_a_cycle() -> None:
    assert figure_13.stages(0.6) == pytest.approx({"press": 0.0, "shear": 0.5, "reverse": 1.5, "release": 3.5})
    slips = np.isin(np.arange(21), [3, 4, 5, 9, 19, 20])
    assert figure_13.spans(TIME, slips) == "0.30–0.50; 1.90–2.00"
    assert figure_13.spans(TIME, np.arange(21) == 9) == "none"


def test_the_adequacy_of_equal_correlations_is_known() -> None:
    """Of p variables with correlation r each pair has the partial one r/(1 + (p − 2) r)."""
    p, r = 5, 0.6
    root = np.linalg.cholesky(np.full((p, p), r) + (1.0 - r) * np.eye(p))
    white = np.linalg.qr(np.random.default_rng(3).standard_normal((40, p + 1)) - 0.0)[0]
    white -= white.mean(axis=0)
    white = np.linalg.qr(white[:, :p])[0]
    partial = r / (1.0 + (p - 2) * r)
    assert figure_16.adequacy(white @ root.T) == pytest.approx(r**2 / (r**2 + partial**2), rel=1e-9)


def test_principal_components_explain_all_variance() -> None:
    log = stretched()
    rng = np.random.default_rng(4)
    rate = rng.standard_normal((21, 1, 1)) * np.linspace(1.0, 2.0, 6)[:, None] + 0.3 * rng.standard_normal((21, 6, 5))
    fields = figure_16.significant(log, rate)
    after = TIME > 0.45
    size = np.abs(rate).max(axis=(1, 2))
    assert len(fields) == (after & (size > figure_16.LEAST_SHARE * size[after].max())).sum()
    found = figure_16.analyse(
        "signed", [log] * 3, [rate + 0.1 * rng.standard_normal(rate.shape) for _ in range(3)], True
    )
    assert found.explained.sum() == pytest.approx(1.0)
    assert found.explained[0] > 0.5
    assert found.points == 30
    first = found.maps[0]
    assert np.corrcoef(first.mean(axis=1), np.linspace(1.0, 2.0, 6))[0, 1] > 0.95


def test_lifts_are_those_of_their_grips() -> None:
    scenes = figure_16.grasps()
    assert len(scenes) == figure_16.TESTS * len(figure_16.GRIPS)
    assert [scene.name for scene in scenes] == [scene.name for scene in figure_16.grasps()]
    assert len(FIGURES) == 11
