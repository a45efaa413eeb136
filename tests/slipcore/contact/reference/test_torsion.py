from pathlib import Path

import mpmath
import numpy as np
import pytest

from slipcore.contact.reference import HertzContact, half_space
from slipcore.contact.reference.torsion import ReissnerSagoci, TorsionPartialSlip, sliding_moment
from slipcore.errors import InvalidInput

FRICTION = 0.4
CONTACT = HertzContact(15e-3, 10.0, half_space(1e6, 0.45))
LIMIT = sliding_moment(CONTACT, FRICTION)
CONDITION_4 = Path(__file__).parents[4].parent / "shared/data/contact/cond4.npz"


def twisted(ratio: float) -> TorsionPartialSlip:
    return TorsionPartialSlip(CONTACT, FRICTION, ratio * LIMIT)


def elliptic(s: mpmath.mpf) -> mpmath.mpf:
    return mpmath.ellipe(1 - s * s)


@pytest.mark.parametrize("ratio", [1e-12, 1e-6, 0.1, 0.499, 0.501, 0.9, 1 - 1e-6, 1 - 1e-12])
def test_stick_radius_gives_back_the_moment_from_no_load_to_full_slip(ratio: float) -> None:
    case = twisted(ratio)
    with mpmath.workdps(40):
        full = 3 * mpmath.pi**2 / 64
        if ratio < 0.5:
            share = mpmath.quad(lambda g: (1 - g) ** 2 * elliptic(1 - g), [0, mpmath.mpf(case.annulus)]) / full
            assert float(share) == pytest.approx(case.moment / LIMIT, rel=1e-13, abs=0.0)
        else:
            rest = mpmath.quad(lambda s: s * s * elliptic(s), [0, mpmath.mpf(case.stick_share)]) / full
            assert float(rest) == pytest.approx((LIMIT - case.moment) / LIMIT, rel=1e-12, abs=0.0)
    assert case.annulus + case.stick_share == pytest.approx(1.0, rel=1e-15, abs=0.0)
    assert case.stick_radius == pytest.approx(case.stick_share * CONTACT.contact_radius, rel=1e-15, abs=0.0)
    assert case.stick_ratio == pytest.approx(case.stick_share**2, rel=1e-15, abs=0.0)


@pytest.mark.parametrize("ratio", [1e-12, 0.1, 0.6, 0.99, 1 - 1e-9])
def test_twist_is_the_integral_of_johnson(ratio: float) -> None:
    case = twisted(ratio)
    with mpmath.workdps(40):
        if ratio < 0.5:
            integral = mpmath.quad(lambda g: elliptic(1 - g) / (1 - g), [0, mpmath.mpf(case.annulus)])
        else:
            top = -mpmath.log(mpmath.mpf(case.stick_share))
            integral = mpmath.quad(lambda v: elliptic(mpmath.exp(-v)), mpmath.linspace(0, top, 6))
    expected = FRICTION * CONTACT.peak_pressure * CONTACT.compliance.shear / 2 * float(integral)
    assert case.twist == pytest.approx(expected, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("ratio", [1e-6, 0.3, 0.9, 0.9999])
def test_traction_is_continuous_below_the_limit_and_carries_the_moment(ratio: float) -> None:
    case = twisted(ratio)
    a, c = CONTACT.contact_radius, case.stick_radius
    inner = np.nextafter(c, 0.0)  # the traction leaves the limit with the root of the distance
    assert case.traction(inner) == pytest.approx(float(FRICTION * CONTACT.pressure(c)), rel=1e-4, abs=0.0)
    stuck = np.linspace(0.0, 0.999 * c, 60)
    assert (case.traction(stuck) < FRICTION * CONTACT.pressure(stuck)).all()
    assert case.traction(0.0) == 0.0
    assert case.traction(1.1 * a) == 0.0
    nodes, weights = np.polynomial.legendre.leggauss(96)
    share, step = (0.5 * (nodes + 1)) ** 5, 2.5 * (0.5 * (nodes + 1)) ** 4 * weights  # a thin annulus is a sharp edge
    moment = 0.0
    for low, high in ((0.0, c), (c, a)):  # r runs as the sine, which takes away both roots
        span = np.arccos(low / high)
        r, width = high * np.cos(span * share), high * np.sin(span * share) * span * step
        moment += float((case.traction(r) * 2 * np.pi * r**2 * width).sum())
    assert moment == pytest.approx(ratio * LIMIT, rel=1e-7, abs=0.0)  # r is known to a rounding beside the annulus


@pytest.mark.parametrize(("ratio", "radius"), [(0.3, 0.5), (0.9, 0.2), (0.999999, 0.005)])
def test_stuck_traction_matches_high_precision(ratio: float, radius: float) -> None:
    case = twisted(ratio)
    with mpmath.workdps(30):
        rho, c = mpmath.mpf(radius), mpmath.mpf(case.stick_share)
        low, high = mpmath.sqrt(c**2 - rho**2), mpmath.sqrt(1 - rho**2)  # w = √(s² − r²)
        total = mpmath.quad(
            lambda w: elliptic(mpmath.sqrt(rho**2 + w**2)) * rho / (rho**2 + w**2), [low, 2 * low, 10 * low, high]
        )
    expected = 2 / np.pi * FRICTION * CONTACT.peak_pressure * float(total)
    assert case.traction(radius * CONTACT.contact_radius) == pytest.approx(expected, rel=1e-11, abs=0.0)


@pytest.mark.parametrize("ratio", [1e-9, 0.4, 0.95])
def test_slip_and_far_displacement_match_high_precision(ratio: float) -> None:
    case = twisted(ratio)
    a, c = CONTACT.contact_radius, case.stick_share
    strain = FRICTION * CONTACT.peak_pressure * CONTACT.compliance.shear / 2

    def turned(r: mpmath.mpf, s: mpmath.mpf) -> mpmath.mpf:  # circle r under the unit twist of a circle s < r
        return 2 / mpmath.pi * (r * mpmath.asin(s / r) - s * mpmath.sqrt(1 - (s / r) ** 2))

    for part in (0.2, 0.9):
        radius = float(c + part * case.annulus)
        with mpmath.workdps(40):
            r = mpmath.mpf(a * radius) / mpmath.mpf(a)
            start = mpmath.mpf(1) - mpmath.mpf(case.annulus) if ratio < 0.5 else mpmath.mpf(c)
            slip = -mpmath.quad(lambda s, r=r: elliptic(s) / s * (r - turned(r, s)), [start, r])
        # the place of r in the annulus is known to a rounding of r
        assert case.slip(a * radius) == pytest.approx(
            strain * a * float(slip), rel=1e-11 + 1e-15 / case.annulus, abs=0.0
        )
    for radius in (1.0001, 1.3, 20.0):
        with mpmath.workdps(40):
            r = mpmath.mpf(a * radius) / mpmath.mpf(a)
            start = mpmath.mpf(1) - mpmath.mpf(case.annulus) if ratio < 0.5 else mpmath.mpf(c)
            far = mpmath.quad(lambda s, r=r: elliptic(s) / s * turned(r, s), [start, 1])
        assert case.displacement(a * radius) == pytest.approx(strain * a * float(far), rel=1e-11, abs=0.0)


def test_stuck_part_turns_rigidly_and_the_annulus_lags() -> None:
    case = twisted(0.8)
    r = np.linspace(0.0, case.stick_radius, 20)
    np.testing.assert_allclose(case.displacement(r), case.twist * r, rtol=1e-14)
    assert (case.slip(r) == 0.0).all()
    slipping = np.linspace(1.01 * case.stick_radius, CONTACT.contact_radius, 20)
    assert (case.slip(slipping) < 0.0).all()
    assert (case.displacement(slipping) > 0.0).all()
    edge = CONTACT.contact_radius * np.array([1 - 1e-9, 1 + 1e-9])
    np.testing.assert_allclose(*case.displacement(edge), rtol=1e-4)


def test_small_moments_turn_as_without_slip() -> None:
    case = twisted(1e-6)
    free = ReissnerSagoci(CONTACT.contact_radius, CONTACT.compliance.shear, case.moment)
    assert case.twist == pytest.approx(free.twist, rel=1e-5, abs=0.0)
    np.testing.assert_allclose(
        case.displacement(2 * CONTACT.contact_radius), free.displacement(2 * CONTACT.contact_radius), rtol=1e-5
    )
    np.testing.assert_allclose(case.traction(2e-3), free.traction(2e-3), rtol=1e-5)


def test_full_slip_has_a_finite_moment_and_an_infinite_twist() -> None:
    case = TorsionPartialSlip(CONTACT, FRICTION, LIMIT)
    r = np.array([0.0, 0.5, 1.0]) * CONTACT.contact_radius
    assert case.stick_radius == 0.0
    assert case.twist == np.inf
    np.testing.assert_allclose(case.traction(r), FRICTION * CONTACT.pressure(r), rtol=1e-14)
    np.testing.assert_array_equal(case.slip(r), [0.0, -np.inf, -np.inf])
    assert np.isfinite(case.displacement(2 * CONTACT.contact_radius))


def test_no_moment_moves_nothing() -> None:
    case = twisted(0.0)
    r = np.array([0.0, 0.5, 1.0, 2.0]) * CONTACT.contact_radius
    assert case.twist == 0.0
    assert (case.traction(r) == 0.0).all()
    assert (case.displacement(r) == 0.0).all()


@pytest.mark.parametrize("ratio", [1.0 + 1e-9, -0.1, np.nan])
def test_moments_beyond_full_slip_are_refused_by_name(ratio: float) -> None:
    with pytest.raises(InvalidInput, match="moment"):
        twisted(ratio)


def test_twist_without_slip_carries_the_moment_and_is_rigid_inside() -> None:
    case = ReissnerSagoci(2e-3, 3e-6, 1e-3)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    angle = 0.25 * np.pi * (nodes + 1)
    r = 2e-3 * np.sin(angle)
    moment = (case.traction(r) * 2 * np.pi * r**2 * 2e-3 * np.cos(angle) * weights).sum() * 0.25 * np.pi
    assert moment == pytest.approx(1e-3, rel=1e-12, abs=0.0)
    np.testing.assert_allclose(case.displacement(r), case.twist * r, rtol=1e-14)
    np.testing.assert_array_equal(case.traction([2e-3, 3e-3]), [np.inf, 0.0])


@pytest.mark.parametrize("ratio", [1.0 + 1e-9, 1.5, 1e4])
def test_displacement_beside_a_turned_circle_matches_high_precision(ratio: float) -> None:
    case = ReissnerSagoci(2e-3, 3e-6, 1e-3)
    with mpmath.workdps(50):
        q = mpmath.mpf(2e-3) / mpmath.mpf(ratio * 2e-3)
        share = 2 / mpmath.pi * (mpmath.asin(q) - q * mpmath.sqrt(1 - q * q))
    assert case.displacement(ratio * 2e-3) == pytest.approx(
        case.twist * ratio * 2e-3 * float(share), rel=1e-11, abs=0.0
    )


@pytest.mark.parametrize(
    ("arguments", "name"),
    [((0.0, 1e-6, 1.0), "contact_radius"), ((1e-3, 0.0, 1.0), "shear_compliance"), ((1e-3, 1e-6, np.inf), "moment")],
)
def test_impossible_twists_are_refused_by_name(arguments: tuple[float, float, float], name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        ReissnerSagoci(*arguments)


@pytest.mark.skipif(not CONDITION_4.exists(), reason="reference scenes are not on this machine")
def test_twist_and_stick_ratio_of_an_independent_solution() -> None:
    with np.load(CONDITION_4) as scene:
        turning = np.flatnonzero(scene["M"] > 0.0)
        moments, twists = scene["M"][turning] * 1e-3, scene["rigid"][turning, 2]
        stick_ratio, force = scene["stick_ratio"][turning], float(scene["F_N"][-1])
        friction, poisson_ratio = float(scene["mu"]), float(scene["nu"])
    contact = HertzContact(15e-3, force, half_space(1e6, poisson_ratio))
    cases = [TorsionPartialSlip(contact, friction, float(moment)) for moment in moments]
    # its README: 0.23 % of twist and 0.015 of stick ratio against closed form, on 64 × 64 cells
    np.testing.assert_allclose([case.twist for case in cases], twists, atol=2.5e-3 * twists.max())
    np.testing.assert_allclose([case.stick_ratio for case in cases], stick_ratio, atol=0.02)
