"""Connected regions keep their numbers."""

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
