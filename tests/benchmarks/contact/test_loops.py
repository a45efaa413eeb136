"""Loops in even steps of the force, and in equal steps of the stick zone's radius."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from benchmarks.contact.accuracy import hertz_grid, relative
from benchmarks.contact.loops import WIDTH, by_front, ends, even, scene_rows, scene_table, scenes, table


def test_parts_of_a_pull_are_of_equal_radius() -> None:
    parts = by_front(5, 0.9)
    assert parts[0] == 0.0
    assert parts[-1] == pytest.approx(1.0)
    np.testing.assert_allclose(np.diff(np.cbrt(1.0 - 0.9 * parts)), (np.cbrt(0.1) - 1.0) / 5, rtol=1e-12)


def test_a_loop_close_to_sliding_is_of_higher_order_where_the_front_goes_evenly() -> None:
    run = partial(ends, hertz_grid(16, WIDTH), 0.9)
    exact = run(by_front(96, 0.9))[-1]

    def errors(parts: np.ndarray) -> list[float]:
        return [relative(found, truth) for found, truth in zip(run(parts)[-1], exact, strict=True)]

    coarse, fine, by_force = (np.array(errors(parts)) for parts in (by_front(8, 0.9), by_front(32, 0.9), even(32, 0.9)))
    assert (np.log(coarse / fine) / np.log(4.0) >= 1.5).all()
    assert (by_force >= 1.8 * fine).all()


def test_orders_are_those_from_one_row_to_the_next() -> None:
    lines = table([(0.9, "of equal force", 6, 4e-3, 2e-2), (0.9, "of equal force", 12, 1e-3, 1e-2)]).splitlines()
    assert lines[2] == "| 0.9 μF_N | of equal force | 6 | 4.0e-03 |  | 2.0e-02 |  |"
    assert lines[3] == "| 0.9 μF_N | of equal force | 12 | 1.0e-03 | 2.00 | 1.0e-02 | 1.00 |"


def test_scenes_are_measured_in_the_steps_of_the_library() -> None:
    loop = next(case for case in scenes() if case.name.startswith("loop"))
    rows = list(scene_rows(loop, 16))
    assert [row[0] for row in rows] == [loop.name] * 3
    assert all(after[1] > before[1] and after[2] < before[2] for before, after in pairwise(rows))
    lines = scene_table([("press", 10, 4e-3, 2e-2), ("press", 20, 1e-3, 1e-2), ("loop", 40, 1e-4, 1e-3)]).splitlines()
    assert lines[2:] == [
        "| press | 10 | 4.0e-03 |  | 2.0e-02 |  |",
        "| press | 20 | 1.0e-03 | 2.00 | 1.0e-02 | 1.00 |",
        "| loop | 40 | 1.0e-04 |  | 1.0e-03 |  |",
    ]
