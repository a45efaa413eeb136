"""The fixed point of coupled steps."""

import numpy as np

from slipcore.contact.solver.step_equations import Mixing


def test_mixing_halves_the_steps_to_the_fixed_point_of_a_linear_map() -> None:
    """Plain iteration takes 20 steps to 1e-10 at a factor of 0.3, which coupling has at ν = 0."""
    solution, mixing, point = np.array([1.0, -2.0, 0.5]), Mixing(), np.zeros(3)
    rates = np.array([0.3, 0.28, 0.29])
    for steps in range(60):  # noqa: B007
        answer = solution + rates * (point - solution)
        if np.abs(answer - point).max() <= 1e-10:
            break
        point = mixing.next(point, answer)
    assert steps <= 10
    np.testing.assert_allclose(point, solution, rtol=0.0, atol=1e-9)


def test_mixing_stays_where_nothing_changes() -> None:
    mixing, point = Mixing(), np.ones(4)
    for _ in range(3):
        np.testing.assert_array_equal(mixing.next(point, point), point)
