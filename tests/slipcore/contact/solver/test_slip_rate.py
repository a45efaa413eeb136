"""Rates of slip of second order: convergence where slip turns, and no change where it does not."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.slip_rate import carried_share
from slipcore.contact.solver.state import StepResult
from slipcore.frames import FloatArray

FRICTION, FORCE = 0.4, 10.0
SLIDING = FRICTION * FORCE
TURN = ((0.6, 0.0), (0.6, 0.6))
LOOP = ((0.75, 0.0), (-0.75, 0.0), (0.75, 0.0))


def ball(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray((x**2 + y**2) / (2.0 * 15e-3))


def follow(corners: tuple[tuple[float, float], ...], steps: int, poisson: float, *, second: bool) -> list[StepResult]:
    """Pressed, then pulled in straight lines to shares of the sliding force, in so many steps each."""
    problem = ContactProblem((HalfSpace.from_young(1e6, poisson),), FRICTION, heights=(ball,))
    solver = QuasiStatic(problem, Grid.square(16, 11.5e-3), 1e-6, 1e-8, second_order=second)
    ends = SLIDING * np.array([(0.0, 0.0), *corners])
    lines = [a + (b - a) * k / steps for a, b in pairwise(ends) for k in range(1, steps + 1)]
    loads = [StepLoad(FORCE, tangential=np.append(at, 0.0), duration=1.0 / steps) for at in [ends[0], *lines]]
    return list(solver.run(loads))


@cache
def limit(corners: tuple[tuple[float, float], ...], poisson: float) -> FloatArray:
    """The last traction, in many steps of second order."""
    return follow(corners, 160, poisson, second=True)[-1].force[:2]


def order(corners: tuple[tuple[float, float], ...], poisson: float, *, second: bool) -> tuple[float, float]:
    """Order of the last traction between 10 and 40 steps a line, and its error at 40."""
    fine = limit(corners, poisson)
    last = (follow(corners, steps, poisson, second=second)[-1].force[:2] for steps in (10, 40))
    coarse, fair = (float(np.linalg.norm(force - fine) / np.linalg.norm(fine)) for force in last)
    return float(np.log(coarse / fair) / np.log(4.0)), fair


def test_a_load_that_turns_is_followed_at_second_order() -> None:
    rate, error = order(TURN, 0.0, second=True)
    assert rate >= 1.8
    assert error <= 4e-4


def test_a_loop_is_followed_at_second_order() -> None:
    rate, error = order(LOOP, 0.3, second=True)
    assert rate >= 1.5
    assert error <= 5e-4


@pytest.mark.parametrize(("corners", "poisson"), [(TURN, 0.0), (LOOP, 0.3)])
def test_backward_euler_comes_to_the_same_at_first_order(
    corners: tuple[tuple[float, float], ...], poisson: float
) -> None:
    rate, error = order(corners, poisson, second=False)
    assert 0.7 <= rate <= 1.2
    assert error <= 5e-3


def test_slip_along_one_line_is_what_backward_euler_makes_it() -> None:
    """At ν = 0 nothing turns, so the step's slip has the direction of its rate (Cattaneo and Mindlin)."""
    pulled = ((0.8, 0.0), (-0.5, 0.0))
    for first, second in zip(*(follow(pulled, 8, 0.0, second=second) for second in (False, True)), strict=True):
        largest = np.abs(second.force[:2]).max()
        np.testing.assert_allclose(second.force[:2], first.force[:2], rtol=0.0, atol=1e-4 * largest + 1e-12)


def test_slip_stops_with_the_load_and_sticks_where_it_turns_back() -> None:
    steps = 10
    corners = ((0.75, 0.0), (0.75, 0.0), (0.6, 0.0))
    results = follow(corners, steps, 0.3, second=True)
    assert results[steps].moved.any()
    for held in results[steps + 1 : 2 * steps + 1]:
        assert not held.moved.any()
    assert results[2 * steps + 1].moved.sum() < 0.05 * results[0].contact.sum()


def test_a_contact_on_the_limit_surface_does_not_go_on_by_itself() -> None:
    """Its motion is not given by the load: the least with which all slides is told."""
    first, second = (follow(((1.0, 0.0), (1.0, 0.0)), 10, 0.0, second=second) for second in (False, True))
    assert second[10].stick_ratio <= 0.1
    assert second[-1].pose[0] == pytest.approx(first[-1].pose[0], rel=1e-4)


def test_the_slip_of_the_last_step_counts_only_at_the_same_rate_of_loads() -> None:
    rate = np.array([0.0, 2.0, 0.0, 0.0])
    assert carried_share(rate, rate, 1.0) == pytest.approx(1.0 / 3.0)
    assert carried_share(rate, 1.1 * rate, 0.5) == pytest.approx(0.125)
    for other in (-rate, 2.0 * rate, 0.0 * rate, np.array([0.0, 2.0, 1.0, 0.0])):
        assert carried_share(rate, other, 1.0) == 0.0
    assert carried_share(rate, rate, 3.0) == 0.0
