from collections.abc import Callable
from pathlib import Path

import mpmath
import numpy as np
import pytest

from slipcore.contact.reference import CattaneoMindlin, Compliance, HertzContact, elastic_pair, half_space
from slipcore.errors import InvalidInput

Integrals = Callable[[float, float, float], dict[str, float]]
FRICTION, FORCE, RADIUS = 0.4, 10.0, 15e-3
CONDITION_1 = Path(__file__).parents[4].parent / "shared/data/contact/cond1.npz"


def sheared(ratio: float, poisson_ratio: float = 0.3) -> CattaneoMindlin:
    contact = HertzContact(RADIUS, FORCE, half_space(1e6, poisson_ratio))
    return CattaneoMindlin(contact, FRICTION, ratio * FRICTION * FORCE)


def textbook(case: CattaneoMindlin, x: float, y: float) -> dict[str, mpmath.mpf]:
    """The corrected (A6)–(A11), (A17) and (A18) as they stand, in 60 digits."""
    with mpmath.workdps(60):
        ratio = mpmath.mpf(case.tangential_force) / mpmath.mpf(FRICTION * FORCE)
        a = mpmath.mpf(case.contact.contact_radius)
        c = a * mpmath.cbrt(1 - ratio)
        s, p = mpmath.mpf(case.contact.compliance.shear), mpmath.mpf(case.contact.compliance.poisson)
        slope = mpmath.mpf(FRICTION) * mpmath.mpf(case.contact.pressure_slope)
        x, y = mpmath.mpf(x), mpmath.mpf(y)
        r = mpmath.sqrt(x * x + y * y)

        def circle(radius: mpmath.mpf) -> tuple[mpmath.mpf, mpmath.mpf]:
            if r <= radius:
                u_x = mpmath.pi / 32 * (4 * (2 * s - p) * radius**2 - (4 * s - 3 * p) * x**2 - (4 * s - p) * y**2)
                return u_x, mpmath.pi / 16 * p * x * y
            angle, root = mpmath.asin(radius / r), mpmath.sqrt(1 - (radius / r) ** 2)
            first = (2 * s - p) * ((2 * radius**2 - r**2) * angle + radius * r * root)
            second = (r**2 * angle + (2 * radius**2 - r**2) * root * radius / r) / r**2
            return (first + p / 2 * second * (x**2 - y**2)) / 8, p / 8 * second * x * y

        rigid = slope * mpmath.pi / 8 * (2 * s - p) * (a * a - c * c)
        outer, inner = circle(a), circle(c)
        u_x, u_y = slope * (outer[0] - inner[0]), slope * (outer[1] - inner[1])
        roots = [mpmath.sqrt(max(radius**2 - r**2, 0)) for radius in (a, c)]
        return {"u_x": u_x, "u_y": u_y, "s_x": u_x - rigid, "s_y": u_y, "d": rigid, "q": slope * (roots[0] - roots[1])}


@pytest.mark.parametrize("ratio", [1e-12, 1e-6, 0.05, 0.5, 0.95, 1.0 - 1e-9, 1.0])
@pytest.mark.parametrize("radius", [1e-3, 0.4, 0.99, 0.999999999, 1.000001, 1.5, 40.0])
def test_every_field_keeps_its_digits_from_no_load_to_sliding(ratio: float, radius: float) -> None:
    case = sheared(ratio)
    r = radius * case.contact.contact_radius
    x, y = r * np.cos(0.7), r * np.sin(0.7)
    exact = textbook(case, x, y)
    at_r = np.hypot(x, y)
    u, s = case.displacement(x, y), case.slip(x, y)
    scale = float(exact["d"])
    # the input's own rounding: of the ratio beside 1 − ratio, and of r beside a − r
    lost = 1e-12 + (2e-16 / (1.0 - ratio) if ratio < 1.0 else 0.0) + 2e-16 / abs(1.0 - radius)
    np.testing.assert_allclose(case.rigid_displacement, scale, rtol=1e-13)
    np.testing.assert_allclose(
        case.traction(at_r), float(exact["q"]), rtol=lost, atol=lost * float(textbook(case, 0.0, 1e-9)["q"])
    )
    np.testing.assert_allclose(u, [float(exact["u_x"]), float(exact["u_y"])], rtol=lost, atol=lost * scale)
    if radius < 1.0:
        np.testing.assert_allclose(s, [float(exact["s_x"]), float(exact["s_y"])], rtol=3e-9, atol=lost * scale)
    else:
        assert np.isnan(s).all()


@pytest.mark.parametrize("ratio", [0.2, 0.8])
@pytest.mark.parametrize("target", [None, half_space(3e6, 0.2)])
def test_displacement_matches_quadrature_of_the_cerruti_kernels(
    circle_integrals: Integrals, ratio: float, target: Compliance | None
) -> None:
    sensor = half_space(1e6, 0.3)
    compliance = sensor if target is None else elastic_pair(sensor, target)
    case = CattaneoMindlin(HertzContact(RADIUS, FORCE, compliance), FRICTION, ratio * FRICTION * FORCE)
    a, c = case.contact.contact_radius, case.stick_radius
    slope = FRICTION * case.contact.pressure_slope / (2 * np.pi)
    for x, y in [(0.1 * a, 0.05 * a), (0.6 * a, -0.7 * a), (-0.9 * a, 0.3 * a), (1.2 * a, 0.8 * a), (0.0, -3 * a)]:
        outer, inner = circle_integrals(x, y, a), circle_integrals(x, y, c)
        step = {name: outer[name] - inner[name] for name in outer}
        for body in (compliance, sensor):
            u_x = slope * ((body.shear - body.poisson) * step["one"] + body.poisson * step["xx"])
            u_y = slope * body.poisson * step["xy"]
            np.testing.assert_allclose(
                case.displacement(x, y, body), [u_x, u_y], rtol=1e-9, atol=1e-10 * u_x
            )  # the quadrature's own error


def test_traction_carries_the_tangential_force_and_reaches_the_limit_in_slip() -> None:
    case = sheared(0.6)
    a, c = case.contact.contact_radius, case.stick_radius
    assert case.stick_ratio == pytest.approx((1 - 0.6) ** (2 / 3), rel=1e-14, abs=0.0)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    angle = 0.25 * np.pi * (nodes + 1)

    def load(radius: float) -> float:  # of the part √(radius² − r²), smooth in the angle
        r = radius * np.sin(angle)
        root = np.sqrt(np.maximum(radius**2 - r**2, 0.0))
        return float((0.25 * np.pi * weights * root * 2 * np.pi * r * radius * np.cos(angle)).sum())

    slope = FRICTION * case.contact.pressure_slope
    assert slope * (load(a) - load(c)) == pytest.approx(0.6 * FRICTION * FORCE, rel=1e-12, abs=0.0)
    slipping, sticking = np.linspace(1.0001 * c, 0.9999 * a, 30), np.linspace(0.0, 0.9999 * c, 30)
    np.testing.assert_allclose(case.contact_factor(slipping), 1.0, rtol=1e-14)
    np.testing.assert_allclose(case.traction(slipping), FRICTION * case.contact.pressure(slipping), rtol=1e-13)
    assert (case.contact_factor(sticking) < 1.0).all()
    assert np.isnan(case.contact_factor(1.1 * a))


def test_slip_is_zero_in_stick_and_opposes_the_load_in_the_annulus() -> None:
    case = sheared(0.7)
    a, c = case.contact.contact_radius, case.stick_radius
    angle = np.linspace(0.0, 2 * np.pi, 24)
    for radius in (0.2 * c, 0.999 * c):
        assert (case.slip(radius * np.cos(angle), radius * np.sin(angle)) == 0.0).all()
    assert (case.slip(0.95 * a * np.cos(angle), 0.95 * a * np.sin(angle))[..., 0] < 0.0).all()


def test_slip_follows_the_paper_with_the_missing_factor_at_zero_poisson_ratio() -> None:
    case = sheared(0.7, poisson_ratio=0.0)
    a, c = case.contact.contact_radius, case.stick_radius
    r = np.linspace(1.001 * c, a, 40)[:-1]
    shear_modulus = 1.0 / case.contact.compliance.shear
    h_1 = 3 * 2 * FRICTION * FORCE / (16 * shear_modulus * a)
    phi_1 = (1 - 2 / np.pi * np.arcsin(c / r)) * (1 - 2 * c**2 / r**2) + 2 / np.pi * c / r * np.sqrt(1 - c**2 / r**2)
    np.testing.assert_allclose(case.slip(r, 0.0)[:, 0], -h_1 * r**2 / (2 * a**2) * phi_1, rtol=1e-7)
    printed = h_1 * phi_1  # (A19)
    assert np.abs(printed + case.slip(r, 0.0)[:, 0]).max() > 0.9 * np.abs(case.slip(r, 0.0)).max()


def test_slip_gradient_is_the_derivative_and_grows_to_the_edge() -> None:
    case = sheared(0.7, poisson_ratio=0.0)
    a, c = case.contact.contact_radius, case.stick_radius
    r = np.linspace(1.05 * c, 0.98 * a, 30)
    step = 1e-5 * a
    finite = np.abs(case.slip(r + step, 0.0) - case.slip(r - step, 0.0))[:, 0] / (2 * step)
    np.testing.assert_allclose(case.slip_gradient(r), finite, rtol=1e-6)  # central difference, second order
    assert (np.diff(case.slip_gradient(r)) > 0.0).all()
    assert (case.slip_gradient(np.linspace(0.0, c, 9)) == 0.0).all()
    printed = 4 * (c / r) ** 3 * (np.pi / 2 - np.arcsin(c / r))  # (6): an extremum near 1.17 that isn't there
    assert (np.diff(printed) < 0.0).any()


def test_displacement_is_continuous_at_the_edge_of_contact_and_of_stick() -> None:
    case = sheared(0.7)
    for radius in (case.contact.contact_radius, case.stick_radius):
        below, above = case.displacement(radius * (1 - 1e-9), 0.0), case.displacement(radius * (1 + 1e-9), 0.0)
        np.testing.assert_allclose(above, below, rtol=1e-8)


def test_printed_outside_field_is_wrong_and_the_corrected_one_right(circle_integrals: Integrals) -> None:
    s, p, c, x, y = 2.6, 0.78, 1.0, 1.5, 0.8
    r = np.hypot(x, y)
    integrals = circle_integrals(x, y, c)
    exact = ((s - p) * integrals["one"] + p * integrals["xx"]) / (2 * np.pi)
    angle, root = np.arcsin(c / r), np.sqrt(1 - c**2 / r**2)
    first = (2 * s - p) * ((2 * c**2 - r**2) * angle + c * r * root)
    corrected = (first + p / 2 * (r**2 * angle + (2 * c**2 - r**2) * root * c / r) * (x**2 - y**2) / r**2) / 8
    printed = (first + p / 2 * (r**2 * angle + (2 * c**2 - r**2) * root**2 * c / r) * (x**2 - y**2)) / 8  # (A8)
    assert corrected == pytest.approx(exact, rel=1e-11, abs=0.0)
    assert abs(printed / exact - 1.0) > 0.1


def test_printed_sum_of_the_two_circles_does_not_keep_the_stick_region_rigid() -> None:
    case = sheared(0.5)
    a, c = case.contact.contact_radius, case.stick_radius
    x = np.linspace(0.0, c, 5)
    compliance = case.contact.compliance

    def circle(radius: float) -> np.ndarray:
        square = 4 * (2 * compliance.shear - compliance.poisson) * radius**2
        return np.pi / 32 * (square - (4 * compliance.shear - 3 * compliance.poisson) * x**2)

    assert np.ptp(case.displacement(x, 0.0)[:, 0]) == 0.0
    assert np.ptp(circle(a) - circle(c)) < 1e-12 * circle(a).max()
    assert np.ptp(circle(a) + circle(c)) > 0.1 * circle(a).max()  # (A12)


def test_no_contact_moves_nothing() -> None:
    case = CattaneoMindlin(HertzContact(RADIUS, 0.0, half_space(1e6, 0.3)), FRICTION, 0.0)
    assert case.rigid_displacement == 0.0
    assert (case.displacement([0.0, 1e-3], [0.0, 0.0]) == 0.0).all()
    assert (case.traction([0.0, 1e-3]) == 0.0).all()


@pytest.mark.parametrize("force", [FRICTION * FORCE * (1 + 1e-9), -1e-9, np.nan])
def test_a_tangential_force_beyond_sliding_is_refused_by_name(force: float) -> None:
    with pytest.raises(InvalidInput, match=r"tangential_force is .* allowed: at least 0 and at most 4 N"):
        CattaneoMindlin(HertzContact(RADIUS, FORCE, half_space(1e6, 0.3)), FRICTION, force)


def test_no_friction_is_refused_by_name() -> None:
    with pytest.raises(InvalidInput, match="friction"):
        CattaneoMindlin(HertzContact(RADIUS, FORCE, half_space(1e6, 0.3)), 0.0, 0.0)


@pytest.mark.skipif(not CONDITION_1.exists(), reason="reference scenes are not on this machine")
@pytest.mark.parametrize("step", [12, 30, 50, 58])
def test_fields_of_an_independent_solution_of_the_paper_s_first_condition(step: int) -> None:
    with np.load(CONDITION_1) as scene:
        x, y = np.meshgrid(scene["x"] * 1e-3, scene["y"] * 1e-3)
        expected, force, stick_ratio = (
            scene["u"][step] * 1e-3,
            float(scene["F_T"][step]),
            float(scene["stick_ratio"][step]),
        )
        contact = HertzContact(RADIUS, float(scene["F_N"][step]), half_space(1e6, float(scene["nu"])))
    case = CattaneoMindlin(contact, FRICTION, force)
    # ν is 0.49: the true slip turns a little from the load, which the closed form leaves out
    np.testing.assert_allclose(case.displacement(x, y), expected[..., :2], atol=0.03 * np.abs(expected[..., :2]).max())
    normal = contact.normal_displacement(np.hypot(x, y))
    np.testing.assert_allclose(normal, expected[..., 2], atol=1e-3 * np.abs(expected[..., 2]).max())
    assert case.stick_ratio == pytest.approx(stick_ratio, abs=0.01)


@pytest.mark.parametrize("ratio", [0.3, 0.9])
def test_slip_at_the_edge_is_what_its_gradient_adds_up_to(ratio: float) -> None:
    """In the mean over directions, along and across the load, in which what depends on them cancels."""
    case = sheared(ratio, poisson_ratio=0.45)
    edge = case.contact.contact_radius * (1.0 - 1e-9)
    r = np.linspace(0.0, edge, 20_001)
    along, across = (case.slip(x, y)[0] for x, y in ((np.array(edge), np.array(0.0)), (np.array(0.0), np.array(edge))))
    assert np.trapezoid(case.slip_gradient(r), r) == pytest.approx(-0.5 * float(along + across), rel=1e-4)
    assert np.isnan(case.slip_gradient(1.001 * edge))
    assert case.slip_gradient(0.5 * case.stick_radius) == 0.0
