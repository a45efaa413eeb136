"""Mergeable moments of samples, by hand: weights, ranges, unknown velocities and bytes."""

import struct
from dataclasses import replace

import numpy as np
import pytest

import estimators
from estimators import Domain, InvalidSamples, Moments
from estimators.linear.statistics import GRASPS, MAGIC, NUMBERS, UNKNOWN, WITH_GRASPS, WITH_UNKNOWN, union
from slipcore.samples import FrictionSamples

AREA = 2e-6


def three(relative: bool = False, sensor: str = "") -> FrictionSamples:
    """Three samples, of which the last, the fastest and hardest pressed, has no weight."""
    mu, v, f_n = np.array([0.4, 0.5, 9.0]), np.array([1e-3, 3e-3, 9e-3]), np.array([0.1, 0.05, 0.9])
    element, weight, time = np.array([3, 7, 9]), np.array([1.0, 2.0, 0.0]), np.array([0.0, 0.1, 0.2])
    plain = FrictionSamples(mu, v, f_n, mu * f_n, time, element, weight, AREA, sensor=sensor)
    return replace(plain, velocity_is_relative=np.ones(3, bool)) if relative else plain


def test_samples_count_by_their_weights_and_those_of_none_not_at_all() -> None:
    moments = Moments.from_samples(three())
    assert (moments.n, moments.weight_square, moments.element_area) == (2, 5.0, AREA)
    assert moments.factor.weight == 3.0
    np.testing.assert_allclose(moments.factor.mean, [7e-3 / 3.0, 0.2 / 3.0, 1.4 / 3.0], rtol=1e-12)
    assert moments.domain == Domain((1e-3, 3e-3), (0.05, 0.1))
    assert moments.effective_n == pytest.approx(9.0 / 5.0, rel=1e-12)
    square = np.asarray(moments.factor.triangle.T @ moments.factor.triangle, float)
    away = np.array([2e-3, -0.05, 0.1])  # of two samples: w₁ w₂/(w₁ + w₂) of their difference squared
    np.testing.assert_allclose(square, 2.0 / 3.0 * np.outer(away, away), rtol=1e-9)


def test_unknown_velocities_count_as_zero_and_are_in_no_range() -> None:
    moments = Moments.from_samples(three(relative=True))
    assert moments.domain == Domain((np.inf, -np.inf), (0.05, 0.1))
    assert moments.factor.mean[0] == 0.0
    assert moments.unknown_weight == 3.0
    assert moments.unknown_force == pytest.approx(0.2, rel=1e-12)
    known = Moments.from_samples(three())
    assert (known.unknown_weight, known.unknown_force) == (0.0, 0.0)
    both = known.merge(moments)
    assert both.domain == known.domain
    assert (both.n, both.weight_square, both.unknown_weight) == (4, 10.0, 3.0)
    assert both.unknown_force == pytest.approx(0.2, rel=1e-12)


def test_on_another_area_forces_alone_are_others() -> None:
    moments = Moments.from_samples(three(relative=True))
    larger = moments.at_element_area(3.0 * AREA)
    assert larger.element_area == 3.0 * AREA
    assert larger.domain.tangential_velocity == moments.domain.tangential_velocity
    assert larger.domain.normal_force == pytest.approx((0.15, 0.3), rel=1e-12)
    np.testing.assert_allclose(larger.factor.mean, moments.factor.mean * [1.0, 3.0, 1.0], rtol=1e-12)
    np.testing.assert_allclose(larger.factor.triangle, moments.factor.triangle * [1.0, 3.0, 1.0], rtol=1e-12)
    assert larger.unknown_force == pytest.approx(0.6, rel=1e-12)
    assert larger.unknown_weight == 3.0
    np.testing.assert_allclose(larger.grasps[0].mean, moments.grasps[0].mean * [1.0, 3.0, 1.0], rtol=1e-12)
    assert moments.at_element_area(AREA) is moments


def test_what_fades_keeps_its_means_and_range_and_forgets_its_places() -> None:
    moments = Moments.from_samples(three(relative=True))
    faded = moments.forget(0.25)
    assert (faded.factor.weight, faded.weight_square) == (0.75, 5.0 / 16.0)
    assert faded.effective_n == pytest.approx(moments.effective_n, rel=1e-12)
    np.testing.assert_allclose(faded.factor.triangle, 0.5 * moments.factor.triangle, rtol=1e-12)
    np.testing.assert_array_equal(faded.factor.mean, moments.factor.mean)
    assert (faded.unknown_weight, faded.unknown_force) == pytest.approx((0.75, 0.05), rel=1e-12)
    assert faded.grasps == ()
    assert (faded.n, faded.domain) == (2, moments.domain)
    assert moments.forget(1.0).factor.weight == 3.0


def test_one_more_sample_widens_the_range() -> None:
    moments = Moments.from_samples(three()).add(5e-3, 0.02, 0.6, weight=3.0)
    assert (moments.n, moments.weight_square, moments.factor.weight) == (3, 14.0, 6.0)
    assert moments.domain == Domain((1e-3, 5e-3), (0.02, 0.1))
    assert float(moments.factor.mean[2]) == pytest.approx(3.2 / 6.0, rel=1e-12)
    assert moments.grasps == ()  # its place is not known


def test_grasps_are_kept_of_samples_whose_places_are_told_and_carry_their_sensor() -> None:
    assert Moments.from_samples(three(), places=False).grasps == ()
    named = Moments.from_samples(three(sensor="left"))
    assert [grasp.sensor for grasp in named.grasps] == ["left"]
    assert [grasp.sensor for grasp in named.of_sensor("right").grasps] == ["right"]
    two = named.merge(Moments.from_samples(three(sensor="other")))
    assert [grasp.sensor for grasp in two.grasps] == ["left", "other"]
    assert named.merge(Moments.from_samples(three(), places=False)).grasps == ()
    assert [grasp.sensor for grasp in named.merge(Moments.empty(AREA)).grasps] == ["left"]


def test_a_union_holds_all_ranges() -> None:
    domains = [Domain((1.0, 2.0), (0.5, 0.6)), Domain((np.inf, -np.inf), (0.1, 0.2)), Domain((0.5, 1.5), (0.3, 0.9))]
    assert union(domains) == Domain((0.5, 2.0), (0.1, 0.9))


@pytest.mark.parametrize(("relative", "places"), [(False, False), (False, True), (True, True), (True, False)])
def test_bytes_keep_everything_but_the_sensor(relative: bool, places: bool) -> None:
    moments = Moments.from_samples(three(relative, "left"), places)
    content = moments.to_bytes()
    assert content[:4] == (WITH_UNKNOWN if relative else WITH_GRASPS if places else MAGIC)
    back = Moments.from_bytes(content)
    for name in ("n", "weight_square", "domain", "element_area", "unknown_weight", "unknown_force"):
        assert getattr(back, name) == getattr(moments, name), name
    np.testing.assert_array_equal(back.factor.mean, moments.factor.mean.astype(float))
    np.testing.assert_array_equal(back.factor.triangle, moments.factor.triangle.astype(float))
    assert len(back.grasps) == places
    assert back.to_bytes() == content
    assert places or relative or len(content) == 140


@pytest.mark.parametrize("relative", [False, True])
def test_bytes_that_are_cut_anywhere_or_followed_by_more_are_refused(relative: bool) -> None:
    content = Moments.from_samples(three(relative)).to_bytes()
    for length in range(len(content)):
        with pytest.raises(InvalidSamples, match="moments"):
            Moments.from_bytes(content[:length])
    with pytest.raises(InvalidSamples, match="moments is followed by 2 more bytes"):
        Moments.from_bytes(content + b"ab")
    plain = Moments.from_samples(three(), places=False).to_bytes()
    with pytest.raises(InvalidSamples, match=r"moments is 141 bytes from b'SMo1'; .*bytes made by to_bytes"):
        Moments.from_bytes(plain + b"x")


def spoilt(place: int, value: float) -> bytes:
    """Bytes of plain moments with another number: n, Σw, Σw², area, three means, four ends, and six of the triangle."""
    content = Moments.from_samples(three(), places=False).to_bytes()
    start = len(MAGIC) + struct.calcsize("<d") * place
    return content[:start] + struct.pack("<d", value) + content[start + 8 :]


@pytest.mark.parametrize(
    ("place", "value"),
    [
        *((0, -1.0), (1, -1e-9), (2, -1e-9), (3, 0.0), (3, -1e-6)),
        *((0, np.nan), (1, np.inf), (2, np.nan), (3, np.nan), (4, np.inf), (6, np.nan), (16, np.nan)),
    ],
)
def test_numbers_that_no_moments_have_are_refused(place: int, value: float) -> None:
    with pytest.raises(InvalidSamples, match="moments is not finite, negative or of no area"):
        Moments.from_bytes(spoilt(place, value))


def test_numbers_at_the_ends_of_what_moments_have_are_taken() -> None:
    assert Moments.from_bytes(spoilt(0, 0.0)).n == 0
    assert Moments.from_bytes(spoilt(1, 0.0)).factor.weight == 0.0
    assert Moments.from_bytes(spoilt(7, np.inf)).domain.tangential_velocity == (np.inf, 3e-3)  # nothing known


@pytest.mark.parametrize("weight", [0.0, -1.0, np.nan, np.inf])
def test_a_weight_of_unknown_velocities_is_above_zero(weight: float) -> None:
    content = Moments.from_samples(three(relative=True)).to_bytes()
    start = len(WITH_UNKNOWN) + NUMBERS.size
    told = UNKNOWN.pack(weight, 0.1)
    with pytest.raises(InvalidSamples, match="weight of unknown velocities"):
        Moments.from_bytes(content[:start] + told + content[start + UNKNOWN.size :])


def test_a_count_of_grasps_that_are_not_there_is_refused() -> None:
    content = Moments.from_samples(three()).to_bytes()
    start = len(WITH_GRASPS) + NUMBERS.size
    with pytest.raises(InvalidSamples, match="moments of a grasp is 0 bytes"):
        Moments.from_bytes(content[:start] + GRASPS.pack(2) + content[start + GRASPS.size :])


@pytest.mark.parametrize(
    ("sample", "weight", "message"),
    [
        ((-1e-9, 0.1, 0.5), 1.0, "tangential_velocity is -1e-09; .*finite and at least 0"),
        ((np.inf, 0.1, 0.5), 1.0, "tangential_velocity is inf"),
        ((1e-3, -0.1, 0.5), 1.0, "normal_force is -0.1"),
        ((1e-3, 0.1, np.nan), 1.0, "friction_coefficient is nan; .*finite"),
        ((1e-3, 0.1, 0.5), -1.0, "weight is -1.0; .*finite and above 0"),
        ((1e-3, 0.1, 0.5), np.inf, "weight is inf"),
    ],
)
def test_an_impossible_sample_is_refused_by_name_and_value(
    sample: tuple[float, float, float], weight: float, message: str
) -> None:
    with pytest.raises(InvalidSamples, match=message):
        Moments.empty(AREA).add(*sample, weight=weight)


def test_a_sample_at_rest_that_is_not_pressed_and_pushes_back_is_one() -> None:
    assert Moments.empty(AREA).add(0.0, 0.0, -0.1).n == 1


@pytest.mark.parametrize("factor", [-0.5, 0.0, 1.0 + 1e-9, np.nan])
def test_nothing_fades_by_more_than_all_or_grows(factor: float) -> None:
    with pytest.raises(estimators.InvalidSamples, match=f"factor is {factor}; .*above 0 and at most 1"):
        Moments.empty(AREA).forget(factor)
