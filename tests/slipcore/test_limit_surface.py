"""The limit surface where rotation is about a single point, and against exact arithmetic."""

from fractions import Fraction

import numpy as np
import pytest

from slipcore.contact.limit_load import limit_load
from slipcore.limit_surface import Planar, _answer, _moment, _weights

ALL = np.ones(3, bool)


def sliding_load(radius: np.ndarray, arm: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """What friction takes up in a rotation about a centre: on the limit surface by definition."""
    x, y = arm - centre[:, None]
    distance = np.hypot(x, y)
    friction = radius / np.where(distance > 0.0, distance, np.inf) * np.stack([-y, x])
    return np.array([*friction.sum(axis=1), (arm[0] * friction[1] - arm[1] * friction[0]).sum()])


@pytest.mark.parametrize("disks", [2, 3, 4, 40])
@pytest.mark.parametrize("size", [1.0, 1e-3])
def test_a_load_that_turns_all_about_one_disk_is_on_the_surface(disks: int, size: float) -> None:
    """That disk outweighs all others by the share that counts as still, which is no free motion."""
    rng = np.random.default_rng(disks)
    radius, arm = rng.uniform(0.5, 1.0, disks), size * rng.standard_normal((2, disks))
    load = sliding_load(radius, arm, arm[:, 0])
    assert limit_load(radius, arm, load, ALL).factor == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("spread", [0.0, 6.0, 12.0])
def test_the_motion_of_uneven_weights_is_that_of_exact_arithmetic(spread: float) -> None:
    """Weights of that many decades, on disks that lie a thousand times their distances from the origin."""
    rng = np.random.default_rng(int(spread))
    for _ in range(50):
        weight, arm = 10.0 ** rng.uniform(-spread, 0.0, 5), 1.0 + 1e-3 * rng.standard_normal((2, 5))
        load = Planar(*rng.standard_normal(3))
        weights = _weights(weight, arm, ALL, 1e-30)
        seen = _answer(weights, load, _moment(weights, load))
        spin = exact_spin(weight, arm, load)
        assert seen.turn == pytest.approx(spin, rel=1e-11)


def exact_spin(weight: np.ndarray, arm: np.ndarray, load: Planar) -> float:
    """ω of the motion d that solves Σ w BᵀB d = load."""
    w, (x, y) = [Fraction(each) for each in weight], [[Fraction(each) for each in row] for row in arm]
    a, b, c = sum(w), -sum(map(Fraction.__mul__, w, y)), sum(map(Fraction.__mul__, w, x))
    d = sum(each * (p * p + q * q) for each, p, q in zip(w, x, y, strict=True))
    moment = Fraction(load.turn) - (b * Fraction(load.x) + c * Fraction(load.y)) / a
    return float(moment / (d - (b * b + c * c) / a))


def test_a_single_disk_resists_no_rotation_about_itself() -> None:
    radius, arm = np.array([2.0]), np.array([[0.3], [-0.2]])
    through = np.array([1.0, 0.5, 0.3 * 0.5 + 0.2 * 1.0])
    assert limit_load(radius, arm, through, ALL).factor == pytest.approx(2.0 / np.hypot(1.0, 0.5), rel=1e-9)
    assert limit_load(radius, arm, through + np.array([0.0, 0.0, 0.1]), ALL).factor == 0.0


@pytest.mark.parametrize("held", [0, 1, 2])
def test_what_is_held_takes_no_part(held: int) -> None:
    """Minimum of σ over a fine circle of the motions that are left."""
    rng = np.random.default_rng(held)
    radius, arm, load = rng.uniform(0.5, 1.0, 6), rng.standard_normal((2, 6)), rng.standard_normal(3)
    given = np.arange(3) != held
    angle = np.linspace(0.0, 2.0 * np.pi, 200_001)
    motion = np.zeros((len(angle), 3))
    motion[:, given] = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    speed = np.hypot(motion[:, :1] - arm[1] * motion[:, 2:], motion[:, 1:2] + arm[0] * motion[:, 2:])
    power = motion @ np.where(given, load, 0.0)
    expected = ((speed @ radius)[power > 0.0] / power[power > 0.0]).min()
    found = limit_load(radius, arm, load, given)
    assert found.factor == pytest.approx(expected, rel=1e-6)
    assert found.motion[held] == 0.0
