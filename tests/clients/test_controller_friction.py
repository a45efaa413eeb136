"""What a grip controller knows and learns of friction, by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from stiction_client import Contact, ControlSettings, InvalidArgument
from stiction_client.controller.friction import KnownFriction, LearnedFriction, error_of_mean, utilisation
from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.recognition import GripRecognition
from stiction_client.defaults import NORMAL_DEVIATIONS
from stiction_client.quantile import FrictionQuantile
from tests.service.report.test_material import MODEL

FLAT, ROUND = Contact(6e-5), Contact.round(6e-5, at_force=8.0)
SETTINGS = ControlSettings(
    contact=FLAT,
    least_force=0.5,
    most_force=40.0,
    learn_frames=4,
    learn_spread=0.05,
    learned_error=0.03,
    sample_error=0.08,
    contradiction_frames=2,
    contradiction_deviations=2.0,
    recognise_time=1.0,
)
KNOWN = KnownFriction(FLAT, FrictionQuantile(0.6, -0.1, 0.2, 0.0, 0.0), 0.5, deviations=2.0, of_others=True)
"""Of a mean of 0.6 − 0.05·F and a scatter of 0.1."""


def learned(*values: float, count: int = 4) -> LearnedFriction:
    return LearnedFriction(values, (count,) * len(values), values)


def test_a_quantile_lies_as_far_below_the_mean_as_its_mirror_image_above() -> None:
    assert KNOWN.bounds(2.0) == (pytest.approx(0.3), pytest.approx(0.7))
    assert KNOWN.expected(2.0) == pytest.approx(0.5)
    assert replace(KNOWN, shifted=1.2).expected(2.0) == pytest.approx(0.6)


def test_an_element_of_a_round_contact_bears_the_cube_root() -> None:
    known = replace(KNOWN, contact=ROUND)
    assert known.bounds(8.0) == (pytest.approx(0.3), pytest.approx(0.7))


@pytest.mark.parametrize(("sharpened", "force"), [(1.0, 4.0), (2.0, 2.0)])
def test_a_load_needs_less_force_by_as_much_as_friction_is_more(sharpened: float, force: float) -> None:
    known = replace(KnownFriction.learned(0.25, 0.3, FLAT), sharpened=sharpened)
    assert known.required(1.0, 0.0, 40.0) == pytest.approx(force)
    assert known.required(1.0, 0.0, 0.99 * force) == math.inf


def test_torque_is_borne_by_the_arm_of_the_contact() -> None:
    known = KnownFriction.learned(0.25, 0.3, ROUND)
    arm = float(ROUND.arm(1.0))
    assert known.required(0.0, 0.25 * arm * 8.0 ** (4.0 / 3.0), 40.0) == pytest.approx(8.0)
    assert known.required(0.0, 0.0, 40.0) == 0.0


def test_a_model_s_quantile_is_of_the_elements_that_touch_under_the_least_force() -> None:
    known = KnownFriction.of_model(MODEL, SETTINGS)
    assert (known.of_others, known.unit) == (True, pytest.approx(MODEL.element_area / 6e-5))
    asked = FrictionQuantile.of(MODEL, 0.0, SETTINGS.slip_probability, 1.0)
    assert [known.quantile(force) for force in (0.05, 0.5)] == [asked(force) for force in (0.05, 0.5)]


def test_samples_err_less_the_more_they_are_but_for_what_they_have_in_common() -> None:
    assert error_of_mean(4, SETTINGS) == pytest.approx(0.05)
    assert error_of_mean(10**9, SETTINGS) == pytest.approx(0.03, rel=1e-6)
    assert learned(0.4, 0.5, count=2).error(SETTINGS) == pytest.approx(0.05)


def test_frames_count_by_their_elements() -> None:
    uneven = LearnedFriction((0.4, 0.6), (3, 1), ())
    assert uneven.mean == pytest.approx(0.45)
    assert uneven.spread == pytest.approx(math.sqrt((3 * 0.05**2 + 0.15**2) / 4) / 0.45)


def test_as_many_frames_are_kept_as_teach() -> None:
    one = LearnedFriction()
    for number in range(6):
        one = one.with_frame(0.1 * number, number, number != 3, SETTINGS)
    assert one.counts == (1, 2, 4, 5)
    assert one.values == pytest.approx((0.1, 0.2, 0.4, 0.5))
    assert one.sampled == pytest.approx((0.2, 0.3, 0.4, 0.5))


def test_the_lowest_friction_is_below_the_median_of_all_samples() -> None:
    assert math.isnan(learned(0.4, 0.4, 0.4).lowest(SETTINGS))
    lowest = learned(0.4, 0.9, 0.5, 0.5).lowest(SETTINGS)
    assert 0.5 * (1.0 - 4.0 * 0.03) < lowest < 0.5 * (1.0 - 0.03)
    assert lowest == pytest.approx(learned(0.5, 0.5, 0.5, 0.5).lowest(SETTINGS))


@pytest.mark.parametrize(
    ("values", "agree"),
    [((0.4, 0.4, 0.4, 0.4), True), ((0.4, 0.4, 0.4), False), ((0.38, 0.42) * 2, True), ((0.37, 0.43) * 2, False)],
)
def test_frames_agree_once_they_are_enough_and_within_their_spread(values: tuple[float, ...], agree: bool) -> None:
    assert learned(*values).agrees(4, SETTINGS) is agree
    known = learned(*values).known(SETTINGS)
    assert (known is not None) is agree
    if known is not None:
        low, high = known.bounds(1.0)
        assert 0.5 * (low + high) == pytest.approx(0.4)
        assert 0.0 < low < 0.4
        assert not known.of_others


def test_friction_that_may_be_none_by_its_error_is_not_known() -> None:
    """Three errors of a third are all of it."""
    assert learned(0.4, 0.4, 0.4, 0.4, count=10**6).known(replace(SETTINGS, learned_error=0.3)) is not None
    assert learned(0.4, 0.4, 0.4, 0.4, count=10**6).known(replace(SETTINGS, learned_error=0.35)) is None


def test_no_friction_agrees_with_nothing() -> None:
    assert not LearnedFriction((0.0,) * 4, (4,) * 4, ()).agrees(4, SETTINGS)


@pytest.mark.parametrize(("mean", "refutes"), [(0.295, True), (0.296, False)])
def test_samples_refute_what_lies_further_off_than_both_errors_explain(mean: float, refutes: bool) -> None:
    """A scatter of 0.1 and an error of 0.0412 · 0.5 are 0.1021 together: twice of that below 0.5 is 0.2958."""
    assert KNOWN.refuted(learned(mean, mean), LoadEstimate(), 2.0, SETTINGS) is refutes


def test_a_load_that_is_borne_shows_as_much_friction_whatever_samples_say() -> None:
    assert KNOWN.refuted(learned(0.1), LoadEstimate(0.2), 2.0, SETTINGS)
    assert not KNOWN.refuted(learned(0.1), LoadEstimate(0.8), 2.0, SETTINGS)
    assert not KNOWN.refuted(LearnedFriction(), LoadEstimate(0.2), 2.0, SETTINGS)


def test_samples_sharpen_a_quantile_as_bayes_has_it() -> None:
    sampled = learned(0.4, 0.4, count=2)
    found = KNOWN.sharpen(sampled, 2.0, SETTINGS)
    error = 0.05 * 0.4
    weight = 0.01 / (0.01 + error**2)
    mean = 0.5 + weight * (0.4 - 0.5)
    assert found.samples == 4
    assert found.shifted == pytest.approx(mean / 0.5)
    assert found.sharpened == pytest.approx((mean - 2.0 * math.sqrt(weight) * error) / 0.3)


@pytest.mark.parametrize(
    ("known", "sampled", "force"),
    [
        (replace(KNOWN, of_others=False), learned(0.4, 0.4), 2.0),
        (replace(KNOWN, samples=9), learned(0.4, 0.4), 2.0),
        (KNOWN, learned(0.4), 2.0),
        (KNOWN, learned(0.3, 0.5), 2.0),
        (KNOWN, learned(0.4, 0.4), 0.0),
        (KNOWN, learned(0.4, 0.4), 11.0),
    ],
    ids=["of this grasp", "of more samples", "one frame", "apart", "no force", "no friction"],
)
def test_what_teaches_nothing_leaves_a_quantile_as_it_was(
    known: KnownFriction, sampled: LearnedFriction, force: float
) -> None:
    assert known.sharpen(sampled, force, SETTINGS) is known


def test_as_many_samples_as_before_sharpen_anew() -> None:
    assert replace(KNOWN, samples=8).sharpen(learned(0.4, 0.4), 2.0, SETTINGS).samples == 8


@pytest.mark.parametrize(("ratio", "used"), [(1.0, 0.0), (0.25, 0.875), (0.0, 1.0)])
def test_a_contact_is_used_by_what_has_ceased_to_stick(ratio: float, used: float) -> None:
    assert utilisation(ratio) == pytest.approx(used)


def recognition(**friction: float) -> GripRecognition:
    models = {name: replace(MODEL, coefficients=np.array([value, 0.0, 0.0])) for name, value in friction.items()}
    found = GripRecognition.among(models, SETTINGS)
    assert found is not None
    return found


def test_samples_within_the_time_add_up_by_their_elements_and_later_ones_begin_anew() -> None:
    begun = recognition(paper=0.4).step(5.0, True, 0.4, 3, SETTINGS)
    assert (begun.loaded, begun.sampled, begun.mean, begun.count, begun.frames) == (5.0, 5.0, 0.4, 3, 1)
    more = begun.step(6.0, True, 0.8, 1, SETTINGS)
    assert (more.loaded, more.sampled, more.count, more.frames) == (5.0, 5.0, 4, 2)
    assert more.mean == pytest.approx(0.5)
    late = more.step(6.001, True, 0.3, 2, SETTINGS)
    assert (late.sampled, late.mean, late.count, late.frames) == (6.001, 0.3, 2, 1)
    assert late.loaded == 5.0


def test_a_frame_without_samples_or_load_changes_nothing_else() -> None:
    one = recognition(paper=0.4)
    assert one.step(5.0, False, math.nan, 0, SETTINGS) is one
    loaded = one.step(5.0, True, math.nan, 0, SETTINGS)
    assert (loaded.loaded, loaded.frames) == (5.0, 0)


@pytest.mark.parametrize(("time", "waits"), [(5.0, True), (6.0, True), (6.001, False)])
def test_samples_are_waited_for_as_long_as_may_be(time: float, waits: bool) -> None:
    assert recognition(paper=0.4).step(5.0, True, math.nan, 0, SETTINGS).waits(time, SETTINGS) is waits


def test_slip_is_waited_for_up_to_what_learning_needs_of_the_stickiest_material() -> None:
    both, paper = recognition(paper=0.6, glass=0.3), recognition(paper=0.6)
    assert both.borne(1.0, SETTINGS) == pytest.approx(paper.borne(1.0, SETTINGS))
    low, _ = paper.materials["paper"].bounds(1.0)
    assert paper.borne(1.0, SETTINGS) == pytest.approx(low * utilisation(SETTINGS.learn_stick_ratio))


@pytest.mark.parametrize(("sampled", "borne"), [(0.3, 0.3 * utilisation(0.1)), (0.1, 0.2), (0.9, None)])
def test_no_more_is_borne_than_samples_say_and_no_less_than_most_objects_bear(
    sampled: float, borne: float | None
) -> None:
    both = recognition(paper=0.6, glass=0.3)
    told = both.step(0.0, True, sampled, 3, SETTINGS).borne(1.0, SETTINGS)
    assert told == pytest.approx(both.borne(1.0, SETTINGS) if borne is None else borne)


@pytest.mark.parametrize(("sampled", "name"), [(0.6, "paper"), (0.3, "glass"), (2.5, "unknown")])
def test_the_likeliest_is_the_one_whose_friction_was_sampled(sampled: float, name: str) -> None:
    seen = recognition(paper=0.6, glass=0.3).step(0.0, True, sampled, 50, SETTINGS)
    likeliest, probability = seen.likeliest(1.0, SETTINGS)
    probabilities = seen.probabilities(1.0, SETTINGS)
    assert (likeliest, probability) == (name, probabilities.max())
    assert probabilities.sum() == pytest.approx(1.0)
    assert len(probabilities) == 3


def test_no_material_is_called_unknown_and_of_none_nothing_is_recognised() -> None:
    with pytest.raises(InvalidArgument, match='allowed: names other than "unknown"'):
        GripRecognition.among({"paper": MODEL, "unknown": MODEL}, SETTINGS)
    assert GripRecognition.among({}, SETTINGS) is None


def test_samples_that_say_the_same_without_any_error_refute_nothing() -> None:
    certain = KnownFriction(FLAT, FrictionQuantile(0.5, 0.0, 0.0, 0.0, 0.0), 0.5, deviations=2.0, of_others=True)
    exact = replace(SETTINGS, learned_error=0.0, sample_error=0.0)
    assert not certain.refuted(learned(0.5, 0.5), LoadEstimate(), 2.0, exact)
    assert certain.refuted(learned(0.499, 0.499), LoadEstimate(), 2.0, exact)


@pytest.mark.parametrize(("count", "learnt"), [(1, False), (50, True)])
def test_a_grasp_is_learnt_once_more_samples_would_say_little_more(count: int, learnt: bool) -> None:
    """Of two frames: their common error is 0.03, and 0.13 that of one element."""
    settings = replace(SETTINGS, learned_error=0.03, sample_error=0.13)
    assert KNOWN.sharpen(learned(0.5, 0.5, count=count), 2.0, settings).learnt == learnt


def test_a_grasp_of_far_more_friction_than_known_is_not_learnt_by_a_quantile() -> None:
    assert not KNOWN.sharpen(learned(0.95, 0.95, count=500), 2.0, SETTINGS).learnt


def test_what_slip_disproves_is_as_before_its_samples_and_no_more_are_sought() -> None:
    sharpened = KNOWN.sharpen(learned(0.4, 0.4, count=2), 2.0, SETTINGS)
    disproved = sharpened.disproved()
    assert (disproved.sharpened, disproved.shifted, disproved.samples, disproved.learnt) == (1.0, 1.0, 0, True)


def test_a_contact_that_slid_has_the_friction_that_it_bore() -> None:
    slid = KnownFriction.slid(0.4, SETTINGS)
    assert slid.expected(5.0) == pytest.approx(0.4)
    assert slid.bounds(5.0)[0] == pytest.approx(0.4 * (1.0 - NORMAL_DEVIATIONS * SETTINGS.learned_error))
    assert not slid.of_others
