"""What a contact feels without load, and whether its markers go with it: reckoned by hand."""

import numpy as np
import pytest

from slipcore.checks import contact
from tests.slipcore.checks.by_hand import PITCH, log, over_time, subject, told

HELD = np.zeros((20, 4, 3), bool)
HELD[5:15] = True
"""Ten of twenty frames."""


def torn(sideways: float, noise: float = 0.0) -> np.ndarray:
    """Each element presses with 0.1 N while it is held; every other one is pulled along x, and the others back."""
    force = np.zeros((20, 4, 3, 3))
    force[HELD] = [0.0, 0.0, -0.1]
    ways = np.where(np.arange(12).reshape(4, 3) % 2, 1.0, -1.0)
    force[..., 0] += np.where(HELD, sideways * 0.1 * ways, noise * 0.1)
    return force


@pytest.mark.parametrize(("sideways", "said"), [(0.24, ""), (0.4, "elements feel 0.40 of the normal force sideways")])
def test_elements_that_feel_a_quarter_sideways_while_the_contact_feels_none_are_found(
    sideways: float, said: str
) -> None:
    moved = np.where(HELD[..., None], [1e-5, 0.0, -1e-4], 0.0)
    seen = subject(log(moved, torn(sideways)), HELD)
    found = told(contact.load_free_tangential_force(seen))
    assert found.startswith(said)
    assert bool(found) == bool(said)


def test_noise_is_taken_off_what_elements_feel_sideways() -> None:
    """Where nothing touches each reads 0.3 of the normal force, of 0.5 in the grasp: √(0.25 − 0.09) are left."""
    moved = np.where(HELD[..., None], [1e-5, 0.0, -1e-4], 0.0)
    seen = subject(log(moved, torn(0.5, noise=0.3)), HELD)
    assert contact._tangential_noise(seen) == pytest.approx(0.03, rel=1e-12)
    share, by_noise = contact._sideways_shares(seen, np.flatnonzero(seen.held))
    assert share == pytest.approx(0.4, rel=1e-12)
    assert by_noise == pytest.approx(0.3 * np.sqrt(np.pi) / 2.0, rel=1e-12)  # mean of a magnitude in the plane


def test_a_load_on_the_whole_contact_is_no_crosstalk() -> None:
    """Also one by a moment: the halves of the contact are pulled against each other."""
    along, about = torn(0.0), torn(0.0)
    along[HELD, 0] = 0.05
    about[:, :2, :, 1], about[:, 2:, :, 1] = np.where(HELD, -0.05, 0.0)[:, :2], np.where(HELD, 0.05, 0.0)[:, 2:]
    moved = np.where(HELD[..., None], [1e-5, 0.0, -1e-4], 0.0)
    for force in (along, about):
        assert not any(contact.load_free_tangential_force(subject(log(moved, force), HELD)))


def test_the_ratio_of_loads_is_force_and_moment_in_quadrature() -> None:
    """0.3 of the normal force along, and 0.4 of the moment that friction of 1 on all elements would bear."""
    force = np.zeros((20, 1, 3, 3))
    force[..., 2] = -0.1
    force[:, 0, :, 0] = [0.03 + 0.04, 0.03, 0.03 - 0.04]  # arms of one pitch along y, and none
    seen = subject(log(0.0, force, grid=(1, 3)))
    np.testing.assert_allclose(contact._load_ratio(seen), np.hypot(0.3, 0.4), rtol=1e-12, err_msg="rounding")


@pytest.mark.parametrize(
    ("elements", "said"), [(1.9, ""), (2.5, "the contact travels 3 mm while the markers under it move 0.5 mm")]
)
def test_a_contact_travels_that_goes_two_elements_further_than_its_markers(elements: float, said: str) -> None:
    """The force of 1 N goes from the first row to where it is shared among two of a row of five."""
    share = np.linspace(0.0, 1.0, 20)
    last = (elements * PITCH + 0.5e-3) / (4.0 * PITCH)
    force = np.zeros((20, 5, 2, 3))
    force[:, 0, :, 2], force[:, 4, :, 2] = -0.5 * (1.0 - last * share)[:, None], -0.5 * (last * share)[:, None]
    moved = over_time(5e-4 * share, 1)
    seen = subject(log(moved, force, grid=(5, 2)), contact=True)
    assert told(contact.moving_contact(seen)) == said
    assert not any(contact.moving_contact(subject(log(moved, grid=(5, 2)), contact=True)))
