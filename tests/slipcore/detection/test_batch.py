from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from slipcore import (
    LOOKAHEAD,
    METHODS,
    FixedLagSmoother,
    GraspLog,
    InvalidInput,
    SlipHistory,
    collect_history,
    detect_slip,
    for_reconstructed_forces,
)
from slipcore.defaults import LIMITS
from slipcore.detection.detector import init, step
from slipcore.detection.filter.method import METHOD
from slipcore.detection.filter.state import END, ONSET, PROBABILITY, ROWS
from slipcore.detection.filter.tuning import Tuning

Same = Callable[[SlipHistory, SlipHistory], None]
Scene = Callable[..., GraspLog]
Score = Callable[[GraspLog, SlipHistory], float]
SETTINGS = Tuning._fields


def late(log: GraspLog, method: str, lookahead: int) -> SlipHistory:
    """What a live user would do who can wait."""
    state = init(log.position, log.element_area, method)
    smoother, answers = FixedLagSmoother(state, lookahead), []
    for count, frame in enumerate(log.frames()):
        state, now = step(state, frame)
        settled = smoother.take(state, now)
        assert (settled is None) == (count < lookahead)
        answers += [] if settled is None else [settled]
    return collect_history([*answers, *smoother.rest()], state)


def posterior_by_enumeration(first: float, steps: np.ndarray, likelihood: np.ndarray) -> np.ndarray:
    """Slip probability at each time of a chain of two states given all of it: the sum over every path."""
    weight, slips = np.zeros(len(steps) + 1), 0.0
    for path in product((0, 1), repeat=len(steps) + 1):
        p = first if path[0] else 1.0 - first
        for (onset, end), (stick, slip), was, now in zip(steps, likelihood, path, path[1:], strict=False):
            change = end if was else onset
            p *= (change if was != now else 1.0 - change) * (slip if now else stick)
        weight += p * np.array(path)
        slips += p
    return weight / slips


def filtered(first: float, steps: np.ndarray, likelihood: np.ndarray) -> list[np.ndarray]:
    """The same chain as a detector remembers it frame by frame: memories [ROWS, 1, 1]."""
    own = [np.zeros((ROWS, 1, 1))]
    own[0][PROBABILITY] = p = first
    for (onset, end), (stick, slip) in zip(steps, likelihood, strict=True):
        slips = p * (1.0 - end) + (1.0 - p) * onset
        p = slips * slip / (slips * slip + (1.0 - slips) * stick)
        memory = np.zeros((ROWS, 1, 1))
        memory[PROBABILITY], memory[ONSET], memory[END] = p, onset, end
        own.append(memory)
    return own


@pytest.mark.parametrize("lookahead", [0, 1, 4])
def test_smoother_of_a_chain_is_the_sum_over_all_its_paths(lookahead: int) -> None:
    rng = np.random.default_rng(lookahead)
    steps, likelihood = rng.uniform(0.02, 0.6, (lookahead, 2)), rng.uniform(0.1, 3.0, (lookahead, 2))
    settings = np.zeros(len(SETTINGS))
    settings[SETTINGS.index("threshold")] = 0.5
    expected = posterior_by_enumeration(0.3, steps, likelihood)
    _, probability = METHOD.revise(filtered(0.3, steps, likelihood), settings)
    np.testing.assert_allclose(probability, expected[0], rtol=1e-12)  # a dozen roundings


@pytest.mark.parametrize("method", ["filter", "strain_rate", "rigid_fit"])
def test_a_whole_log_with_lookahead_is_what_a_patient_stream_says(
    short_ramp: GraspLog, method: str, same_history: Same
) -> None:
    same_history(late(short_ramp, method, LOOKAHEAD), detect_slip(short_ramp, method, lookahead=LOOKAHEAD))


def test_no_more_than_the_lookahead_is_looked_at(short_ramp: GraspLog) -> None:
    whole, cut = detect_slip(short_ramp, lookahead=2), 40
    kept = {
        name: getattr(short_ramp, name)[:cut] for name in ("time", "displacement", "force", "normal", "object_pose")
    }
    part = detect_slip(replace(short_ramp, **kept, truth=None), lookahead=2)
    np.testing.assert_array_equal(part.probability[: cut - 2], whole.probability[: cut - 2])
    assert (part.probability[cut - 2 :] != whole.probability[cut - 2 : cut]).any()


@pytest.mark.parametrize("method", sorted(set(METHODS) - {"filter"}))
def test_methods_without_a_posterior_learn_nothing_from_later_frames(
    short_ramp: GraspLog, method: str, same_history: Same
) -> None:
    same_history(detect_slip(short_ramp, method, lookahead=3), detect_slip(short_ramp, method))


@pytest.mark.parametrize("name", ["cond1", "cond4", "reversal", "ring", "cond1_layer5c"])
def test_two_frames_of_lookahead_find_more_of_the_slip(name: str, scene: Scene, f1_score: Score) -> None:
    log = scene(name, marker_noise=3e-6, force_noise=2e-3)
    now, later = (f1_score(log, detect_slip(log, lookahead=k)) for k in (0, LOOKAHEAD))
    assert later > now


def test_more_lookahead_than_frames_is_all_there_is(short_ramp: GraspLog) -> None:
    history = detect_slip(short_ramp, lookahead=100)
    assert len(history.time) == len(short_ramp)
    assert ((history.probability >= 0.0) & (history.probability <= 1.0)).all()


def test_what_was_not_observed_stays_unsaid_in_smoother(short_ramp: GraspLog) -> None:
    observed = np.random.default_rng(0).random(short_ramp.displacement.shape[:3]) > 0.05
    history = detect_slip(replace(short_ramp, observed=observed), lookahead=2)
    assert not (history.contact | history.slip)[~observed].any()
    assert not np.isfinite(history.velocity[1:]).all(axis=-1)[~(observed[1:] & observed[:-1])].any()


@pytest.mark.parametrize("lookahead", [-1, 101, 1.5, True, "2", None])
def test_a_lookahead_that_is_no_number_of_frames_is_refused(short_ramp: GraspLog, lookahead: object) -> None:
    with pytest.raises(InvalidInput, match="lookahead"):
        detect_slip(short_ramp, lookahead=lookahead)


def test_what_reconstructed_forces_are_unsure_of_is_noise_that_lasts(scene: Scene, f1_score: Score) -> None:
    """An error that stays from frame to frame had counted as a force ratio, and so as slip."""
    log = scene("cond1", marker_noise=3e-6)
    assert log.force is not None
    assert log.truth is not None
    wrong = log.force + 0.03 * np.random.default_rng(5).standard_normal((1, *log.force.shape[1:]))
    told = {"force": "reconstructed", "force_deviation": "0.03"}
    known = replace(log, force=wrong, contact=log.truth.contact, metadata=told)
    found = detect_slip(known)
    as_measured = detect_slip(replace(known, metadata={}))
    so_weighed = detect_slip(replace(known, metadata={}), **for_reconstructed_forces(0.03))
    np.testing.assert_array_equal(found.slip, so_weighed.slip)
    alone = detect_slip(replace(known, force=None, metadata={}))
    assert f1_score(log, found) > f1_score(log, alone) - 0.01
    assert f1_score(log, found) > f1_score(log, as_measured) + 0.01


def test_when_a_load_is_turned_back_reconstructed_forces_do_not_hold_slip(scene: Scene, f1_score: Score) -> None:
    """All sticks then, at the ratios at which it slipped: they had counted as slip for some frames."""
    log = scene("reversal", marker_noise=3e-6)
    assert log.truth is not None
    told = {"force": "reconstructed", "force_deviation": "0.002"}
    known = replace(log, contact=log.truth.contact, metadata=told)
    found = f1_score(log, detect_slip(known))
    assert found > f1_score(log, detect_slip(known, heading_length=0.0)) + 0.01
    assert found > f1_score(log, detect_slip(replace(known, metadata={}))) + 0.02
    alone = replace(known, force=None, metadata={})
    assert found > f1_score(log, detect_slip(alone))


def test_forces_as_unsure_as_they_may_be_large_are_taken(short_ramp: GraspLog) -> None:
    """As of a gel that was described in the wrong unit: the option's own bound was a tenth of that of forces."""
    told = {"force": "reconstructed", "force_deviation": str(LIMITS.force)}
    unsure = replace(short_ramp, metadata=told)
    assert unsure.force_deviation == LIMITS.force
    assert len(detect_slip(unsure).slip) == len(short_ramp)
