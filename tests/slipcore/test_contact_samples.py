"""Samples of whole contacts, and when these contradict their elements, by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipcore import FrictionSamples, GraspLog
from slipcore.collection import _contact_samples, _means_of_groups, _rolls, contradiction
from slipcore.defaults import COLLECTION
from slipcore.patch_record import ContactFriction, Patch

AREA = 4e-6


def patch(first: int, plateau: list[int], **given: Any) -> Patch:
    """Frames from the first on; a plateau where it says 1."""
    count = len(plateau)
    nothing = np.zeros(count)
    plain: dict[str, Any] = {
        "pose": np.zeros((count, 3)),
        "speed": nothing,
        "regime": np.full(count, "sliding"),
        "normal_force": nothing,
        "tangential_force": np.zeros((count, 2)),
        "moment": nothing,
        "load_ratio": nothing,
        "element_force": nothing,
        "ratio_noise": nothing,
        "noise_frames": np.ones(count),
    }
    return Patch(first=first, plateau=np.array(plateau, bool), **plain | given)


def elements(friction: list[float], force: list[float], repeat: int = 1) -> FrictionSamples:
    mu, f_n = np.repeat(friction, repeat).astype(float), np.repeat(force, repeat).astype(float)
    place = np.arange(len(mu))
    one = np.ones(len(mu))
    plain = FrictionSamples(mu, 1e-3 * one, f_n, mu * f_n, 0.1 * place, place, one, AREA)
    return replace(plain, normal_force_noise=2e-3, velocity_noise=3e-5)


def test_groups_are_levelled_to_their_means() -> None:
    begins = np.array([True, False, True, False, False, True])
    found = _means_of_groups(np.array([1.0, 3.0, 6.0, 0.0, 3.0, 5.0]), begins)
    np.testing.assert_allclose(found, [2.0, 2.0, 3.0, 3.0, 3.0, 5.0], rtol=1e-12)


def test_each_frame_on_a_plateau_gives_a_sample_at_the_plateaus_means() -> None:
    """Plateaus: frames 3 and 4, and 6, of the first patch; of the second, which begins where that ends, 7 and 8."""
    rest = np.stack([*np.meshgrid(*[2e-3 * np.arange(2.0)] * 2, indexing="ij"), np.zeros((2, 2))], axis=-1)
    time = 0.1 * np.arange(10)
    log = GraspLog(time, rest, np.zeros((10, 2, 2, 3)), AREA, sensor="left")
    first = patch(
        2,
        [0, 1, 1, 0, 1],
        speed=np.array([9.0, 1.0, 3.0, 9.0, 5.0]),
        element_force=np.array([9.0, 0.2, 0.4, 9.0, 0.5]),
        load_ratio=np.array([9.0, 0.5, 0.6, 9.0, 0.7]),
    )
    second = patch(
        7,
        [1, 1],
        speed=np.array([7.0, 8.0]),
        element_force=np.array([0.1, 0.3]),
        load_ratio=np.array([0.8, 0.9]),
    )
    found = _contact_samples(log, [first, second], elements([0.5], [0.1]))
    np.testing.assert_allclose(found.time, time[[3, 4, 6, 7, 8]], rtol=1e-12)
    np.testing.assert_allclose(found.friction_coefficient, [0.5, 0.6, 0.7, 0.8, 0.9], rtol=1e-12)
    np.testing.assert_allclose(found.tangential_velocity, [2.0, 2.0, 5.0, 7.5, 7.5], rtol=1e-12)
    np.testing.assert_allclose(found.normal_force, [0.3, 0.3, 0.5, 0.2, 0.2], rtol=1e-12)
    np.testing.assert_allclose(found.tangential_force, found.friction_coefficient * found.normal_force, rtol=1e-12)
    np.testing.assert_array_equal(found.element, [4, 4, 4, 5, 5])  # beyond the lattice of four, by patch
    assert set(found.kind) == {"contact"}
    assert not found.velocity_is_relative.any()
    assert (found.sensor, found.element_area) == ("left", AREA)
    assert (found.normal_force_noise, found.velocity_noise) == (2e-3, 3e-5)
    np.testing.assert_array_equal(found.weight, np.ones(5))


def test_without_a_plateau_there_are_no_samples_of_the_contact() -> None:
    rest = np.zeros((2, 2, 3))
    rest[1, :, 0] = rest[:, 1, 1] = 2e-3
    log = GraspLog(0.1 * np.arange(4), rest, np.zeros((4, 2, 2, 3)), AREA)
    assert len(_contact_samples(log, [patch(0, [0, 0, 0])], elements([0.5], [0.1]))) == 0


def contact(low: float, high: float, is_bound: bool = False) -> ContactFriction:
    return ContactFriction(0.5 * (low + high) if not is_bound else low, low, high, is_bound, "what is told")


FEW, ENOUGH = COLLECTION.least_samples // 4 - 1, COLLECTION.least_samples // 4
LEAST, MOST = 1.0 - COLLECTION.agreement, 1.0 + COLLECTION.agreement


@pytest.mark.parametrize(
    ("weakly", "strongly", "agrees"),
    [
        (LEAST * 0.5 + 0.001, 0.5, True),
        (LEAST * 0.5 - 0.001, 0.5, False),
        (0.5, LEAST * 0.5 - 0.001, False),
        (MOST * 0.6 - 0.001, 0.5, True),
        (MOST * 0.6 + 0.001, 0.5, False),
        (0.5, MOST * 0.6 + 0.001, False),
    ],
)
def test_elements_agree_whose_weakest_and_strongest_quarters_lie_near_the_contacts_interval(
    weakly: float, strongly: float, agrees: bool
) -> None:
    data = elements([weakly, 9.0, 0.01, strongly], [0.1, 0.2, 0.3, 0.4], ENOUGH)
    found = contradiction(data, contact(0.5, 0.6), [patch(0, [1])])
    assert (found is None) == agrees
    if found is not None:
        assert f"{weakly:.2f} where they press least and {strongly:.2f} where they press most" in found
        assert found.endswith("the contact as a whole 0.55")


def test_few_elements_contradict_nothing_but_a_bound_is_told_as_one() -> None:
    far = elements([0.1, 0.1, 0.1, 0.1], [0.1, 0.2, 0.3, 0.4], FEW)
    assert contradiction(far, contact(0.5, 0.6), [patch(0, [1])]) is None
    far = elements([0.1, 0.1, 0.1, 0.1], [0.1, 0.2, 0.3, 0.4], ENOUGH)
    found = contradiction(far, contact(0.5, np.inf, is_bound=True), [patch(0, [1])])
    assert found is not None
    assert found.endswith("the contact as a whole at least 0.50")


@pytest.mark.parametrize(
    ("regime", "rolls"),
    [
        (["rolling", "rolling", "sliding"], True),
        (["rolling", "sliding", "none", "none"], False),
        (["rolling", "rolling", "sliding", "none"], True),
        (["none"], False),
    ],
)
def test_a_contact_rolls_that_does_so_for_more_than_half_of_its_time(regime: list[str], rolls: bool) -> None:
    patches = [patch(0, [0] * len(regime), regime=np.array(regime))]
    assert _rolls(patches) == rolls
    bound = contact(0.5, np.inf, is_bound=True)
    few = elements([0.1], [0.1])
    assert contradiction(few, bound, patches) == ("what is told" if rolls else None)
    assert contradiction(few, contact(0.5, 0.6), patches) is None  # a value, though it rolls
