import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import arrays
from scipy import ndimage

from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.contact.reference.hertz import HertzContact
from slipcore.defaults import GROSS_SLIP
from slipcore.frames import BoolArray
from slipcore.gross_slip import find_gross_slip, is_gross_slip

ALL = np.ones((5, 5), bool)
CROSS = ndimage.generate_binary_structure(2, 1)


def sticking(*elements: int) -> BoolArray:
    """Slip [5, 5] of all elements but these."""
    slip = ALL.copy()
    slip.ravel()[list(elements)] = False
    return slip


@pytest.mark.parametrize(
    ("slip", "whole"),
    [
        (sticking(), True),
        (sticking(12), True),
        (sticking(0, 4, 20, 24), True),
        (sticking(0, 6, 12, 18, 24), True),  # a corner is no side
        (sticking(0, 2, 4, 20, 22, 24), False),  # scattered, but too many: 24 %
        (sticking(12, 13), False),
        (sticking(0, 5), False),
        (~ALL, False),
    ],
)
def test_a_contact_slips_as_a_whole_where_few_scattered_elements_seem_to_stick(slip: BoolArray, whole: bool) -> None:
    assert is_gross_slip(ALL, slip) == whole


def test_without_contact_nothing_slips_as_a_whole() -> None:
    assert not is_gross_slip(~ALL, ~ALL)


def test_what_does_not_touch_neither_counts_nor_sticks_beside_another() -> None:
    contact = ALL.copy()
    contact[:, 3:] = False
    slip = contact.copy()
    slip[2, 2] = False
    assert is_gross_slip(contact, slip)
    assert not is_gross_slip(contact & np.eye(5, dtype=bool), slip)  # 1 of 3


def test_of_three_by_three_pillars_one_may_seem_to_stick_and_of_four_none() -> None:
    slip = np.ones((3, 3), bool)
    slip[1, 1] = False
    assert is_gross_slip(np.ones((3, 3), bool), slip)
    assert not is_gross_slip(np.ones((2, 2), bool), slip[:2, :2])


@given(contact=arrays(bool, (4, 6, 5)), slip=arrays(bool, (4, 6, 5), elements=st.sampled_from([True] * 9 + [False])))
def test_frames_are_judged_as_counting_by_scipy_says(contact: BoolArray, slip: BoolArray) -> None:
    found = find_gross_slip(contact, slip)
    for k in range(len(contact)):
        sticks = contact[k] & ~slip[k]
        beside = ndimage.convolve(sticks.astype(int), CROSS.astype(int), mode="constant") > 1
        touching = contact[k].sum()
        few = sticks.sum() <= GROSS_SLIP.sticking * touching
        scattered = (sticks & beside).sum() <= GROSS_SLIP.together * touching
        assert found[k] == (touching > 0 and few and scattered)


@pytest.mark.parametrize(
    ("load_ratio", "whole"), [(0.5, False), (0.9, False), (0.98, False), (0.995, True), (1.0, True)]
)
def test_a_stick_zone_is_taken_for_none_from_99_percent_of_the_load_that_a_sphere_bears(
    load_ratio: float, whole: bool
) -> None:
    """Closed form of Cattaneo and Mindlin: c²/a² = (1 − Q/μP)^⅔, 5 % at Q/μP = .989."""
    contact = HertzContact(20e-3, 5.0, half_space(2e5, 0.5))
    pulled = CattaneoMindlin(contact, 0.5, load_ratio * 0.5 * 5.0)
    a = contact.contact_radius
    x, y = np.meshgrid(*2 * [np.linspace(-1.1 * a, 1.1 * a, 61)])
    r = np.hypot(x, y)
    assert is_gross_slip(r < a, (r < a) & (r >= pulled.stick_radius)) == whole
