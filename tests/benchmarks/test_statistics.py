"""Pure functions of benchmarks: drawn data, fits of growth, digits, summaries."""

import os
import subprocess
import sys
import time

import mpmath
import numpy as np
import pytest

from benchmarks.detector.markers import DOTS, LOST, SIDE, STEP, without
from benchmarks.estimators import nist, recognition
from benchmarks.paper import friction as paper_friction
from benchmarks.planner.__main__ import answer, bracketed, seconds
from benchmarks.service import http_load, ingest, stream
from estimators.defaults import RECOGNITION, REFERENCE
from estimators.recognition import SLOPES


def test_growth_of_memory_is_the_slope_of_its_latter_two_thirds() -> None:
    counts = list(range(100, 30_100, 100))
    warm = [2_000_000 + 50 * count if count > 10_000 else 300 * count for count in counts]
    slope, half_width = ingest.slope(counts, warm)
    assert slope == pytest.approx(50.0)
    assert half_width == pytest.approx(0.0, abs=1e-6)
    noisy = np.random.default_rng(0).normal(0.0, 1e5, len(counts))
    slope, half_width = ingest.slope(counts, [int(value) for value in np.array(warm) + noisy])
    assert abs(slope - 50.0) < 2.0 * half_width
    assert half_width > 0.1


def test_processes_are_looked_at_with_their_children() -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        assert child.pid in ingest.children(os.getpid())
        while not ingest.resident(child.pid):
            time.sleep(0.001)
        child.communicate(b"\n")
    assert ingest.resident(os.getpid()) > 10 * ingest.MIB
    assert ingest.resident(2**22 + 1) == 0  # no process has that number


@pytest.mark.parametrize("measured", [http_load.cpu_seconds, stream.cpu_seconds])
def test_processor_time_is_that_of_the_process(measured: object) -> None:
    assert callable(measured)
    before, began = measured(os.getpid()), time.process_time()
    while time.process_time() - began < 0.1:
        pass
    assert measured(os.getpid()) - before == pytest.approx(0.1, abs=0.03)


def test_loads_in_turn_are_the_medians_of_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    rates = iter([1.0, 100.0, 3.0, 300.0, 2.0, 200.0])
    monkeypatch.setattr(http_load, "load", lambda target, _: http_load.Load(target.what, next(rates), 0.1, 0.2, 0.3))
    targets = [http_load.Target(name, 1, 1, "/") for name in ("slow", "quick")]
    loads = [http_load.median(runs) for runs in http_load.in_turn(targets, rounds=3)]
    assert [(one.what, one.rate) for one in loads] == [("slow", 2.0), ("quick", 200.0)]


def test_digits_are_counted_in_the_worst_coefficient() -> None:
    certified = [mpmath.mpf(1), mpmath.mpf(1000)]
    assert nist._digits(np.array([1.0, 1000.0]), certified) == 15.0
    assert nist._digits(np.array([1.0, 1000.1]), certified) == pytest.approx(4.0, abs=1e-6)
    assert nist._digits(np.array([1.0, np.nan]), certified) == 0.0
    assert nist._digits(np.array([-5.0, 1000.0]), certified) == 0.0  # wrong by more than itself
    assert nist._digits(np.array([1e-3]), [mpmath.mpf(0)]) == pytest.approx(3.0)  # nothing to be relative to


def test_certified_values_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(2)
    x, y = rng.random((12, 2)), rng.random(12)
    rows, response = [[mpmath.mpf(v) for v in row] for row in x], [mpmath.mpf(v) for v in y]
    with mpmath.workdps(60):
        beta, errors = nist._certificate(rows, response, constant=True)
    ours, ours_errors = nist._ours(np.column_stack([x, y]), constant=True)
    theirs, theirs_errors = nist._statsmodels(np.column_stack([np.ones(12), x]), y, "qr")
    for found, spread in ((ours, ours_errors), (theirs, theirs_errors)):
        np.testing.assert_allclose(found, np.array([float(b) for b in beta]), rtol=1e-12)
        np.testing.assert_allclose(spread, np.array([float(e) for e in errors]), rtol=1e-12)


def test_extended_precision_keeps_what_a_double_loses() -> None:
    with mpmath.workdps(40):
        exact = mpmath.mpf(1) / 3
        found = nist._as_long([[exact]])[0, 0]
        error = abs(mpmath.mpf(float(found)) + mpmath.mpf(float(found - np.longdouble(float(found)))) - exact)
    assert error < abs(mpmath.mpf(float(exact)) - exact) / 100


def test_materials_of_the_population_have_its_spread() -> None:
    rng = np.random.default_rng(3)
    drawn = [recognition.material(rng) for _ in range(4000)]
    level = np.array([plane[0] for plane, _ in drawn])
    slope = np.array([plane[1] for plane, _ in drawn]) * REFERENCE.tangential_velocity
    scatter = np.array([scatter for _, scatter in drawn])
    assert level.mean() == pytest.approx(REFERENCE.friction, abs=0.02)
    assert level.std() == pytest.approx(RECOGNITION.level, rel=0.04)
    assert slope.std() == pytest.approx(RECOGNITION.slope * np.sqrt(np.mean(SLOPES**2)), rel=0.06)
    assert np.mean(scatter < REFERENCE.scatter) == pytest.approx(1.0 / np.sqrt(3.0), abs=0.03)  # |t| below 1 on two


def test_a_grasp_without_scatter_lies_on_its_plane(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recognition, "BETWEEN", 0.0)
    data = recognition.grasp(np.array([0.5, 3.0, -1.0]), 0.0, 30, np.random.default_rng(0))
    expected = 0.5 + 3.0 * data.tangential_velocity - data.normal_force
    np.testing.assert_allclose(data.friction_coefficient, expected, rtol=1e-12)
    np.testing.assert_allclose(data.tangential_force, expected * data.normal_force, rtol=1e-12)


def test_recognition_is_summed_up_by_size_and_strangers() -> None:
    def told(n: int, truth: str, answer: str) -> dict[str, float | str]:
        return {"n": n, "truth": truth, "answer": answer, "probability": 0.8, "unknown": 0.25}

    trials = [told(n, *pair) for n in recognition.SIZES for pair in (("material 1", "material 1"),) * 3]
    trials += [told(n, "unknown", "unknown") for n in recognition.SIZES] + [told(5, "material 1", "unknown")]
    lines = recognition.summary(trials)
    assert lines[2] == "| 5 | 80.0% | 80.0% | 100% of 1 | 25.00% |"
    assert lines[-2] == "| all | 94.1% | 80.0% | 100% of 4 | 7.69% |"
    assert "Unknown: 4 grasps; stated: 4 expected, with a standard error of 2." in lines[-1]


def test_grasps_of_a_material_differ_by_an_intercept() -> None:
    smooth = paper_friction.Material("smooth", (0.4, 5.0, -1.0), 0.0, 0.1)
    grasps = paper_friction.grasps_of(smooth, 0)
    offsets = []
    for data in grasps:
        rest = data.friction_coefficient - 5.0 * data.tangential_velocity + data.normal_force
        assert np.ptp(rest) < 1e-12
        offsets.append(rest[0] - 0.4)
    assert len(grasps) == paper_friction.GRASPS
    assert 0.02 < np.std(offsets) < 0.3


@pytest.fixture(scope="module", params=DOTS)
def dots(request: pytest.FixtureRequest) -> np.ndarray:
    return DOTS[request.param](np.random.default_rng(4))


def test_dots_are_distinct_points_of_the_lattice_about_as_dense(dots: np.ndarray) -> None:
    assert dots.min() >= 0
    assert dots.max() < SIDE
    assert len({*map(tuple, dots.T)}) == dots.shape[1]
    assert dots.shape[1] == pytest.approx((SIDE / STEP) ** 2, rel=0.25)


def test_dots_keep_their_distance(dots: np.ndarray) -> None:
    x, y = dots.astype(float)
    apart = np.hypot(x[:, None] - x, y[:, None] - y)
    assert apart[~np.eye(len(x), dtype=bool)].min() >= 1.0


@pytest.mark.parametrize(("lost", "whole_dots"), [("none", True), ("for good", True), ("each frame", False)])
def test_dots_are_lost_as_told(lost: str, whole_dots: bool) -> None:
    seen = without(np.zeros((50, 400, 3)), lost, np.random.default_rng(5))
    gone = np.isnan(seen).any(axis=-1)
    assert gone.mean() == pytest.approx(0.0 if lost == "none" else LOST, abs=0.03)
    assert (gone == gone[:1]).all() == whole_dots


def test_both_planners_find_the_same_force() -> None:
    load, torque = np.array([0.1, 1.0, 3.0]), np.array([0.0, 4e-3, 9e-3])
    np.testing.assert_allclose(bracketed(load, torque)(), answer(load, torque)(), rtol=1e-9)


def test_the_first_run_of_a_timing_does_not_count() -> None:
    pauses = iter([0.2])

    def call() -> None:
        time.sleep(next(pauses, 0.0))

    assert seconds(call) < 0.1
