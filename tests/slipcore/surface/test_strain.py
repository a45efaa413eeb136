import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipcore import InvalidInput
from slipcore.detection.strain_rate.reference import signed_rate, surface_normal, surface_strain
from slipcore.surface.strain import (
    Lattice,
    displacement_gradient,
    frobenius,
    green_lagrange,
    inclination_factor,
    lattice_steps,
    literal_rate,
    principal_strains,
)

EPS = np.finfo(float).eps


def plane_lattice() -> Lattice:
    x, y = np.meshgrid(np.arange(4.0), np.arange(5.0))
    return Lattice.at_rest(1e-3 * np.stack([x, y, 0 * x], axis=-1))


def affine(lattice: Lattice, gradient: np.ndarray) -> np.ndarray:
    """Displacement [n, m, 3] with the given gradient [2, 2] and an offset."""
    displacement = np.zeros_like(lattice.position)
    displacement[..., :2] = lattice.position[..., :2] @ gradient.T + [2e-4, -1e-4]
    return displacement


def gradient_of(lattice: Lattice, displacement: np.ndarray) -> np.ndarray:
    return displacement_gradient(lattice, lattice_steps(displacement))


def strain_of(lattice: Lattice, gradient: np.ndarray) -> np.ndarray:
    return green_lagrange(gradient_of(lattice, affine(lattice, gradient)))


def test_gradient_of_an_affine_field_is_exact_on_any_lattice(lattice: Lattice) -> None:
    gradient = np.array([[0.03, -0.2], [0.11, 0.05]])
    found = gradient_of(lattice, affine(lattice, gradient))
    expected = np.broadcast_to(gradient[:, :, None, None], found.shape)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)  # rounding of mm-sized positions


def test_on_a_regular_lattice_the_gradient_is_the_papers_central_difference() -> None:
    i, j = np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij")
    lattice = Lattice.at_rest(1e-3 * np.stack([i, j, 0 * i], axis=-1))
    u = 1e-5 * np.stack([i**2 + i * j, np.sin(i) - j**3, 0 * i], axis=-1)
    gradient = gradient_of(lattice, u)
    for k in (0, 1):
        along_x = (u[2:, :, k] - u[:-2, :, k]) / 2e-3
        along_y = (u[:, 2:, k] - u[:, :-2, k]) / 2e-3
        np.testing.assert_allclose(gradient[k, 0, 1:-1], along_x, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(gradient[k, 1, :, 1:-1], along_y, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(gradient[k, 0, 0], (u[1, :, k] - u[0, :, k]) / 1e-3, rtol=1e-12, atol=1e-15)


def test_gradient_of_a_smooth_field_converges_with_second_order_inside() -> None:
    def error(size: int) -> float:
        s = np.linspace(-1.0, 1.0, size)
        x, y = np.meshgrid(s, s, indexing="ij")
        curved = 5e-3 * np.stack([x + 0.1 * y**2, y + 0.1 * x**2, 0 * x], axis=-1)
        u = np.zeros_like(curved)
        u[..., 0] = 1e-4 * np.sin(300.0 * curved[..., 0]) * np.cos(200.0 * curved[..., 1])
        exact = 0.03 * np.cos(300.0 * curved[..., 0]) * np.cos(200.0 * curved[..., 1])
        found = gradient_of(Lattice.at_rest(curved), u)[0, 0]
        return float(np.abs(found - exact)[1:-1, 1:-1].max())

    assert np.log2(error(21) / error(41)) > 1.9


def test_a_rigid_rotation_has_no_green_lagrange_strain(lattice: Lattice) -> None:
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    strain = strain_of(lattice, np.array([[c - 1.0, -s], [s, c - 1.0]]))
    np.testing.assert_allclose(strain, 0.0, atol=1e-12)  # rounding; the linear strain would be −0.13


def test_simple_shear_has_its_closed_form(lattice: Lattice) -> None:
    k = 0.3
    xx, yy, xy = strain_of(lattice, np.array([[0.0, k], [0.0, 0.0]]))
    np.testing.assert_allclose(xx, 0.0, atol=1e-12)
    np.testing.assert_allclose(yy, 0.5 * k**2, rtol=1e-11)
    np.testing.assert_allclose(xy, 0.5 * k, rtol=1e-11)


def test_uniform_stretch_has_its_closed_form(lattice: Lattice) -> None:
    strain = strain_of(lattice, 0.2 * np.eye(2))
    np.testing.assert_allclose(strain[:2], 0.5 * (1.2**2 - 1.0), rtol=1e-11)
    np.testing.assert_allclose(strain[2], 0.0, atol=1e-12)


def test_strain_does_not_see_a_rotation_after_it() -> None:
    stretch, (c, s) = np.array([[1.1, 0.02], [0.02, 0.95]]), (np.cos(0.4), np.sin(0.4))
    lattice = plane_lattice()
    plain = strain_of(lattice, stretch - np.eye(2))
    turned = strain_of(lattice, np.array([[c, -s], [s, c]]) @ stretch - np.eye(2))
    np.testing.assert_allclose(turned, plain, rtol=0, atol=1e-12)


def test_steps_are_central_inside_and_one_sided_at_the_edges() -> None:
    field = np.zeros((2, 4, 3))
    field[..., 1] = [0.0, 1.0, 4.0, 9.0]
    steps = lattice_steps(field)
    np.testing.assert_array_equal(steps[1, 1], [[1.0, 4.0, 8.0, 5.0]] * 2)
    np.testing.assert_array_equal(steps[0], 0.0)
    np.testing.assert_array_equal(steps[1, [0, 2]], 0.0)


def exact_principal(xx: float, yy: float, xy: float) -> tuple[mpmath.mpf, mpmath.mpf]:
    with mpmath.workdps(60):
        mean, half = (mpmath.mpf(xx) + mpmath.mpf(yy)) / 2, (mpmath.mpf(xx) - mpmath.mpf(yy)) / 2
        radius = mpmath.sqrt(half**2 + mpmath.mpf(xy) ** 2)
        return mean + radius, mean - radius


@pytest.mark.parametrize(
    "entries",
    [
        (0.1, 0.1 + 1e-15, 1e-17),  # nearly equal
        (0.1, 0.1, 0.0),  # equal
        (-0.1, -0.1 * (1 + 1e-14), 3e-16),
        (1.0, 1e-20, 0.0),  # far apart: mean − radius would be 0
        (-1.0, -1e-20, 1e-25),
        (0.3, -0.3, 0.2),  # mean zero
        (0.0, 0.0, 0.0),
        (1e-200, 2e-200, 5e-201),  # a determinant would underflow
        (1e200, 2e200, 5e199),  # and overflow
        (0.2, -0.1, 0.05),
    ],
)
def test_principal_strains_agree_with_sixty_digits(entries: tuple[float, float, float]) -> None:
    found = principal_strains(np.array(entries))
    for value, exact in zip(found, exact_principal(*entries), strict=True):
        assert abs(mpmath.mpf(float(value)) - exact) <= 4 * EPS * abs(exact)  # a handful of roundings


@given(st.tuples(*[st.floats(-1.0, 1.0, allow_subnormal=False)] * 3))
def test_principal_strains_are_as_exact_as_their_input_allows(entries: tuple[float, float, float]) -> None:
    found = principal_strains(np.array(entries))
    assert found[0] >= found[1]
    size = max(abs(e) for e in entries)
    for value, exact in zip(found, exact_principal(*entries), strict=True):
        # One rounding of an entry moves an eigenvalue by so much.
        assert abs(mpmath.mpf(float(value)) - exact) <= 4 * EPS * size + 1e-300


def test_frobenius_norm_is_that_of_the_principal_strains() -> None:
    strain = np.random.default_rng(1).standard_normal((3, 50))
    np.testing.assert_allclose(frobenius(strain), np.hypot(*principal_strains(strain)), rtol=1e-13)


def test_signed_rate_is_positive_while_the_strain_grows_and_negative_while_it_falls() -> None:
    strain = np.array([0.02, -0.01, 0.005])
    np.testing.assert_allclose(signed_rate(strain, 3.0 * strain), 3.0 * frobenius(strain), rtol=1e-14)
    np.testing.assert_allclose(signed_rate(strain, -3.0 * strain), -3.0 * frobenius(strain), rtol=1e-14)


def test_signed_rate_sees_the_axes_turn_where_the_literal_rate_is_blind() -> None:
    before, after, interval = np.array([0.1, -0.1, 0.0]), np.array([0.0, 0.0, 0.1]), 0.5
    rate = (after - before) / interval
    literal = literal_rate(principal_strains(before), principal_strains(after), interval)
    assert literal == pytest.approx(0.0, abs=1e-15)
    assert abs(signed_rate(after, rate)) == pytest.approx(np.sqrt(0.02 + 0.02) / interval, rel=1e-14)


def test_literal_rate_is_the_papers_and_never_negative() -> None:
    before, after = np.array([[0.3], [0.1]]), np.array([[0.1], [0.2]])
    assert literal_rate(before, after, 0.1)[0] == pytest.approx(np.hypot(2.0, 1.0), rel=1e-12)


def test_surface_normal_of_a_tilted_plane_is_its_closed_form(lattice: Lattice) -> None:
    flat = Lattice.at_rest(lattice.position * [1.0, 1.0, 0.0])
    displacement = np.zeros_like(flat.position)
    displacement[..., 2] = 0.3 * flat.position[..., 0] - 0.2 * flat.position[..., 1]
    expected = np.array([-0.3, 0.2, 1.0]) / np.sqrt(0.09 + 0.04 + 1.0)
    normal = surface_normal(flat, lattice_steps(displacement))
    np.testing.assert_allclose(normal, np.broadcast_to(expected, normal.shape), rtol=0, atol=1e-12)


def test_surface_normal_points_outwards_on_a_dome() -> None:
    x, y = np.meshgrid(np.linspace(-5e-3, 5e-3, 41), np.linspace(-5e-3, 5e-3, 41))
    radius = 15e-3
    dome = np.stack([x, y, np.sqrt(radius**2 - x**2 - y**2)], axis=-1)
    normal = surface_normal(Lattice.at_rest(dome), np.zeros((2, 3, 41, 41)))
    np.testing.assert_allclose(normal[1:-1, 1:-1], (dome / radius)[1:-1, 1:-1], rtol=0, atol=2e-4)  # O(pitch²)


def test_strain_on_an_inclined_face_is_divided_by_the_normals_z() -> None:
    lattice = plane_lattice()
    displacement = affine(lattice, 0.1 * np.eye(2))
    normal = np.broadcast_to([0.6, 0.0, 0.8], displacement.shape)
    plain = green_lagrange(gradient_of(lattice, displacement))
    np.testing.assert_allclose(surface_strain(lattice, lattice_steps(displacement), normal), plain / 0.8, rtol=1e-14)


def test_inclination_is_bounded_on_a_vertical_face() -> None:
    normal = np.array([[[1.0, 0.0, 0.0], [0.6, 0.0, 0.8]]])
    np.testing.assert_allclose(inclination_factor(normal), [[10.0, 1.25]], rtol=1e-14)


def test_strain_noise_is_what_random_displacements_show(lattice: Lattice) -> None:
    rng, sigma = np.random.default_rng(5), 1e-7
    noise = sigma * rng.standard_normal((4000, *lattice.position.shape))
    strain = np.stack([green_lagrange(gradient_of(lattice, u)) for u in noise])
    found = np.sqrt((frobenius(strain.transpose(1, 0, 2, 3)) ** 2).mean(axis=0))
    corner = np.zeros(found.shape, bool)
    corner[np.ix_([0, -1], [0, -1])] = True
    expected = sigma * lattice.strain_noise
    np.testing.assert_allclose(found[~corner], expected[~corner], rtol=0.05)  # 4000 draws: 4 standard errors
    np.testing.assert_allclose(found[corner], expected[corner], rtol=0.1)


@pytest.mark.parametrize("shape", [(1, 5), (5, 1), (1, 1)])
def test_a_lattice_of_one_row_is_refused(shape: tuple[int, int]) -> None:
    x, y = np.meshgrid(np.arange(shape[0]), np.arange(shape[1]), indexing="ij")
    with pytest.raises(InvalidInput, match=rf"position is {shape[0]} × {shape[1]} markers; allowed: at least 2 × 2"):
        Lattice.at_rest(1e-3 * np.stack([x, y, 0 * x], axis=-1))


def test_two_markers_at_one_place_are_refused_by_name() -> None:
    position = plane_lattice().position.copy()
    position[2, 1] = position[1, 1]
    with pytest.raises(InvalidInput, match=r"position is the same at \[1, 1\]"):
        Lattice.at_rest(position)


def test_markers_in_one_line_and_a_folded_lattice_are_refused() -> None:
    i, j = np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij")
    with pytest.raises(InvalidInput, match="folded or in one line"):
        Lattice.at_rest(1e-3 * np.stack([i + j, i + j, 0 * i], axis=-1))
    with pytest.raises(InvalidInput, match="folded or in one line"):
        Lattice.at_rest(1e-3 * np.stack([np.abs(i - 1.2), j, 0 * i], axis=-1))
