import numpy as np
import pytest

from slipcore import InvalidInput, contact_factor, element_forces, stick_ratio


def test_forces_split_into_magnitudes_that_add_up() -> None:
    rng = np.random.default_rng(6)
    force, normal = rng.standard_normal((4, 5, 3)), rng.standard_normal((4, 5, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    forces = element_forces(force, normal)
    np.testing.assert_allclose(forces.normal**2 + forces.tangential**2, (force**2).sum(-1), rtol=1e-12)
    np.testing.assert_allclose(forces.tangential, np.linalg.norm(np.cross(force, normal), axis=-1), rtol=1e-12)
    np.testing.assert_array_equal(forces.compressive, (force * normal).sum(-1) < 0.0)


def test_a_push_inwards_is_compressive_and_a_pull_is_not() -> None:
    forces = element_forces(np.array([[[0.3, 0.4, -2.0], [0.0, 0.0, 2.0]]]), np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(forces.normal, [[2.0, 2.0]], rtol=1e-15)
    np.testing.assert_allclose(forces.tangential, [[0.5, 0.0]], rtol=1e-15)
    np.testing.assert_array_equal(forces.compressive, [[True, False]])


def test_contact_factor_is_one_at_the_coulomb_limit_and_nan_without_force() -> None:
    np.testing.assert_allclose(contact_factor([0.2, 0.1, 0.0], [0.5, 0.5, 0.0], 0.4), [1.0, 0.5, np.nan], rtol=1e-15)


@pytest.mark.parametrize("friction", [0.0, -0.1, np.nan])
def test_contact_factor_refuses_friction_that_is_not_positive(friction: float) -> None:
    with pytest.raises(InvalidInput, match="friction_coefficient"):
        contact_factor(1.0, 1.0, friction)


def test_stick_ratio_is_the_sticking_share_of_the_contact() -> None:
    contact = np.array([[True, True, True, False], [True, False, False, False]])
    slip = np.array([[True, False, False, True], [False, False, False, False]])
    assert stick_ratio(contact, slip) == pytest.approx(0.75)
    assert stick_ratio(contact, contact) == 0.0
    assert np.isnan(stick_ratio(np.zeros((2, 2), bool), np.zeros((2, 2), bool)))
