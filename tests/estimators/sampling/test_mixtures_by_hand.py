"""Weights and components of a proposal, and what a chain is worth, by hand."""

import numpy as np
import pytest

from estimators.defaults import PROPOSAL, SAMPLING, WEIGHT_POWERS
from estimators.sampling import chain as chains
from estimators.sampling.chain import Chain, autocorrelation_time, split_rhat
from estimators.sampling.proposal import StudentMixture, evenness, flattened, root_of, standard


def test_evenness_is_the_effective_number_of_weights_over_their_number() -> None:
    assert evenness(np.zeros(7)) == pytest.approx(1.0, rel=1e-12)
    assert evenness(np.log([1.0, 1.0, 2.0])) == pytest.approx(16.0 / 6.0 / 3.0, rel=1e-12)
    assert evenness(np.array([0.0, -np.inf, -np.inf, -np.inf])) == 0.25
    assert evenness(np.array([1e6, 1e6])) == 1.0


def test_weights_are_raised_to_the_largest_power_at_which_enough_of_them_count() -> None:
    even = np.log([1.0, 2.0, 3.0])
    np.testing.assert_allclose(flattened(even), np.array([1.0, 2.0, 3.0]) / 3.0, rtol=1e-12)
    steep = np.linspace(0.0, 30.0, 50)
    for power in WEIGHT_POWERS:
        if evenness(power * steep) > PROPOSAL.enough:
            break
    assert power not in (WEIGHT_POWERS[0], WEIGHT_POWERS[-1])
    np.testing.assert_allclose(flattened(steep), np.exp(power * (steep - 30.0)), rtol=1e-12)
    hopeless = np.linspace(0.0, 1e6, 50)
    np.testing.assert_allclose(flattened(hopeless), np.exp(WEIGHT_POWERS[-1] * (hopeless - 1e6)), rtol=1e-12)


def test_a_root_is_of_the_spread_and_nowhere_much_thinner_than_the_wide_one() -> None:
    spread, wide = np.array([[4.0, 1.0], [1.0, 2.0]]), np.diag([2.0, 3.0])
    root = root_of(spread, wide)
    np.testing.assert_allclose(root @ root.T, spread + PROPOSAL.thinnest * np.diag([4.0, 9.0]), rtol=1e-12)
    thin = root_of(np.zeros((2, 2)), wide)
    np.testing.assert_allclose(thin @ thin.T, PROPOSAL.thinnest * np.diag([4.0, 9.0]), rtol=1e-12)


def test_components_move_to_the_points_near_them_and_the_first_stays() -> None:
    """Points so near a component, and so far from the others, that each belongs to it alone."""
    degrees, far = SAMPLING.proposal_degrees_of_freedom, 1e6
    part, centre = np.array([0.5, 0.3, 0.2]), np.array([[-far], [0.0], [far]])
    x, weight = np.array([[-0.5], [1.5], [far]]), np.array([1.0, 3.0, 4.0])
    found = StudentMixture(part, centre, np.ones((3, 1, 1))).fitted(x, weight)
    pulls = np.array([1.0, 3.0]) * (degrees + 1.0) / (degrees + np.array([0.25, 2.25]))
    middle = pulls @ x[:2, 0] / pulls.sum()
    np.testing.assert_allclose(found.centre[:, 0], [-far, middle, far], rtol=1e-6)
    spread = pulls @ (x[:2, 0] - middle) ** 2 / 4.0
    assert found.root[1, 0, 0] ** 2 == pytest.approx(spread + PROPOSAL.thinnest, rel=1e-6)
    assert found.root[2, 0, 0] ** 2 == pytest.approx(PROPOSAL.thinnest, rel=1e-6)
    assert found.root[0, 0, 0] == 1.0
    raised = np.array([PROPOSAL.defensive, 0.5, 0.5])
    np.testing.assert_allclose(found.part, raised / raised.sum(), rtol=1e-6)


def test_a_component_that_nothing_came_near_stays_and_may_come_back() -> None:
    lost = StudentMixture(np.array([0.5, 0.5]), np.array([[0.0], [1e30]]), np.ones((2, 1, 1)))
    found = lost.fitted(np.array([[0.5], [-0.5]]), np.ones(2))
    np.testing.assert_array_equal(found.centre, lost.centre)
    np.testing.assert_array_equal(found.root, lost.root)
    assert found.part[1] == pytest.approx(PROPOSAL.least_part / (1.0 + PROPOSAL.least_part), rel=1e-6)
    assert found.part.sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("dimension", [1, 4])
def test_a_standard_proposal_is_one_component_about_zero(dimension: int) -> None:
    proposal, degrees = standard(dimension), SAMPLING.proposal_degrees_of_freedom
    assert proposal.dimension == dimension
    x = np.random.default_rng(1).standard_normal((5, dimension))
    expected = -0.5 * (degrees + dimension) * np.log1p((x**2).sum(axis=1) / degrees)
    np.testing.assert_allclose(proposal.log_density(x), expected, rtol=1e-12)


def test_chains_that_agree_in_their_halves_have_the_least_split_rhat() -> None:
    """Of halves (0, 1) and (0, 1): no variance between, and (n − 1)/n of that within; one more step is left out."""
    draws = np.array([[0.0], [1.0], [0.0], [1.0], [9.0]])[:, :, None]
    assert split_rhat(draws) == pytest.approx(np.sqrt(0.5), rel=1e-12)
    # halves (0, 1) and (2, 3): variance ½ within, of means ½ and 2½ that is 2
    assert split_rhat(np.arange(4.0)[:, None, None]) == pytest.approx(np.sqrt(0.5 + 2.0 / 0.5), rel=1e-12)
    assert split_rhat(np.zeros((8, 2, 1))) == np.inf


def test_a_time_is_at_least_that_of_a_series_that_turns_at_each_step() -> None:
    assert autocorrelation_time(np.tile([1.0, -1.0], 50)[:, None, None]) == pytest.approx(0.01, rel=1e-12)
    assert autocorrelation_time(np.zeros((10, 2, 1))) == pytest.approx(1.0, rel=1e-12)
    noise = np.random.default_rng(2).standard_normal((400, 30, 2))
    np.testing.assert_allclose(autocorrelation_time(noise), 1.0, atol=0.1)


@pytest.mark.parametrize(
    ("steps", "time", "rhat", "trouble"),
    [
        (500, 10.0, 1.0, ""),
        (499, 10.0, 1.0, "499 steps at an autocorrelation time of 10.0; 50 times needed"),
        (500, 10.0, SAMPLING.max_split_rhat, ""),
        (500, 10.0, 1.02, "split R-hat 1.020; at most 1.01 allowed"),
        (500, 10.0, np.nan, ""),
    ],
)
def test_a_chain_is_in_trouble_that_is_short_or_disagrees(steps: int, time: float, rhat: float, trouble: str) -> None:
    assert chains._trouble(steps, time, rhat) == trouble


def test_a_chain_is_judged_without_its_burn_in() -> None:
    """A start far off lasts five times: of white noise that is five or six steps, and never more than half."""
    draws = np.random.default_rng(3).standard_normal((400, 20, 1))
    found = chains._judge(draws, 0.9, "independence")
    burnt = 400 - len(found.draws)
    assert burnt == int(np.ceil(SAMPLING.window * autocorrelation_time(draws).max()))
    np.testing.assert_array_equal(found.draws, draws[burnt:])
    assert (found.acceptance, found.move, found.trouble, found.stopped) == (0.9, "independence", "", "accuracy")
    time = found.autocorrelation_time
    np.testing.assert_allclose(found.effective_sample_size, (400 - burnt) * 20 / np.maximum(time, 1.0), rtol=1e-12)
    assert found.flat().shape == ((400 - burnt) * 20, 1)
    drifting = np.linspace(0.0, 1.0, 100)[:, None, None] * np.ones((1, 4, 1))
    assert len(chains._judge(drifting, 0.5, "independence").draws) == 50
    assert np.isnan(chains._judge(draws, 0.5, "differential evolution").split_rhat)


@pytest.mark.parametrize(
    ("move", "acceptance", "low"),
    [
        ("independence", SAMPLING.min_acceptance, False),
        ("independence", 0.99 * SAMPLING.min_acceptance, True),
        ("differential evolution", 0.0, False),
    ],
)
def test_too_few_independent_proposals_that_are_taken_end_a_chain(move: str, acceptance: float, low: bool) -> None:
    chain = Chain(np.zeros((1, 1, 1)), np.ones(1), np.ones(1), 0.0, acceptance, 1.0, move, "", "")
    assert chains._acceptance_too_low(chain) == low
