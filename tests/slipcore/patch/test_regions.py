"""Connected regions keep their numbers."""

import itertools

import numpy as np

from slipcore.patch.regions import NOWHERE, follow_regions, widened


def frames(*pictures: str) -> np.ndarray:
    return np.array([[[sign == "#" for sign in row] for row in picture.split()] for picture in pictures])


def test_regions_are_told_apart_and_keep_their_numbers() -> None:
    labels, count = follow_regions(frames("##..#", ".##.#", "..##."))
    x = NOWHERE
    assert (count, labels[:, 0].tolist()) == (2, [[0, 0, x, x, 1], [x, 0, 0, x, 1], [x, x, 0, 0, x]])


def test_corners_connect() -> None:
    _, count = follow_regions(frames("#. .#"))
    assert count == 1


def test_after_a_split_the_larger_part_keeps_the_number() -> None:
    labels, count = follow_regions(frames("######", "#.####"))
    assert (count, labels[1, 0].tolist()) == (2, [1, NOWHERE, 0, 0, 0, 0])


def test_a_merged_region_has_the_number_of_the_larger_part() -> None:
    labels, count = follow_regions(frames("#.####", "######"))
    assert (count, labels[1, 0].tolist()) == (2, [1] * 6)


def test_what_comes_back_is_new() -> None:
    labels, count = follow_regions(frames("##", "..", "##"))
    assert (count, labels[2, 0].tolist()) == (2, [1, 1])


def test_without_contact_there_is_no_region() -> None:
    labels, count = follow_regions(frames("..", ".."))
    assert count == 0
    assert (labels == NOWHERE).all()


def test_regions_grow_to_all_sides_but_not_into_each_other() -> None:
    labels, _ = follow_regions(frames("#.....# ....... ......."))
    wide = widened(labels, 2)[0]
    assert wide.tolist() == [[0, 0, 0, NOWHERE, 1, 1, 1]] * 3
    assert widened(labels, 0).tolist() == labels.tolist()


def test_a_region_grows_alike_upwards_and_downwards() -> None:
    labels, _ = follow_regions(frames("....... ....... ....... ...#... ....... ....... ......."))
    for margin in (1, 2):
        square = np.pad(np.zeros((1 + 2 * margin,) * 2, int), 3 - margin, constant_values=NOWHERE)
        assert widened(labels, margin)[0].tolist() == square.tolist()


def test_numbers_go_by_the_largest_common_part_in_any_case() -> None:
    """Against the rule itself, on noise that drifts."""
    rng = np.random.default_rng(8)
    field = rng.standard_normal((60, 9, 11))
    for k in range(1, 60):
        field[k] = 0.9 * field[k - 1] + 0.44 * field[k] if k % 5 else field[k - 1]
    labels, count = follow_regions(field > 0.6)
    assert count == labels.max() + 1
    for before, now in itertools.pairwise(labels):
        names = follow_regions((now != NOWHERE)[None])[0][0]
        shared = np.zeros((names.max() + 1, count), int)
        both = (now != NOWHERE) & (before != NOWHERE)
        np.add.at(shared, (names[both], before[both]), 1)
        while shared.any():
            name, number = np.unravel_index(shared.argmax(), shared.shape)
            assert (now[names == name] == number).all()
            shared[name], shared[:, number] = 0, 0
