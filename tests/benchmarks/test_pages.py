"""What benchmarks put on pages."""

import json
from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from benchmarks.pages import merged, picture_folder, renew, save, table, write

PAGE = "# Title\n\n<!-- table one -->\nold\n<!-- end -->\n\nText.\n\n<!-- table two -->\n<!-- end -->\n"


def test_numbers_have_three_digits_and_what_is_not_known_a_dash() -> None:
    assert table(("a", "b"), [(1.23456, "text"), (12345.6, 7), (np.nan, np.float64(0.00012345))]) == (
        "| a | b |\n| --- | --- |\n| 1.23 | text |\n| 12346 | 7 |\n| – | 0.000123 |"
    )


def test_only_the_named_table_of_a_page_is_renewed(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    renew(page, {"one": r"| new \1 |"})
    assert page.read_text() == PAGE.replace("old", r"| new \1 |")


def test_a_part_of_a_table_leaves_the_rest_as_it_is(tmp_path: Path) -> None:
    old = table(("name", "x", "y"), [("one", 1, 2), ("two", 3, "4, 5")])
    assert merged(old, table(("name", "x", "y"), [("two", 6, 7)])) == old.replace("| 3 | 4, 5 |", "| 6 | 7 |")
    assert merged(old, table(("name", "y"), [("one", 8), ("two", 9)])) == old.replace("2", "8").replace("4, 5", "9")
    assert merged(old, old) == old
    page = tmp_path / "page.md"
    page.write_text(PAGE.replace("old", old))
    renew(page, {"one": table(("name", "x", "y"), [("two", 6, 7)])}, partly=True)
    assert page.read_text() == PAGE.replace("old", old.replace("| 3 | 4, 5 |", "| 6 | 7 |"))


@pytest.mark.parametrize(
    ("part", "named"), [(("name", "x"), "three"), (("name", "z"), "three, z"), (("other", "x"), "three, other")]
)
def test_a_part_that_a_table_does_not_have_is_refused_by_name(part: tuple[str, ...], named: str) -> None:
    old = table(("name", "x", "y"), [("one", 1, 2), ("two", 3, 4)])
    with pytest.raises(SystemExit, match=f"has no {named}; make it anew"):
        merged(old, table(part, [("three", 6)]))


@pytest.mark.parametrize(("text", "places"), [("# Title", 0), (PAGE + PAGE, 2)])
def test_a_page_without_one_place_for_a_table_is_refused(tmp_path: Path, text: str, places: int) -> None:
    page = tmp_path / "page.md"
    page.write_text(text)
    with pytest.raises(SystemExit, match=f"{places} places for the table one"):
        renew(page, {"one": "| new |"})
    assert page.read_text() == text


def test_results_go_to_their_folder_and_pictures_beside_the_page(tmp_path: Path) -> None:
    page = tmp_path / "docs" / "page.md"
    arguments = Namespace(output=tmp_path / "results", page=page)
    assert picture_folder(arguments) == tmp_path / "docs" / "images"
    page.write_text(PAGE)
    write({"a": 1.5}, {"two": "| x |"}, arguments, "numbers.json")
    assert json.loads((tmp_path / "results" / "numbers.json").read_text()) == {"a": 1.5}
    assert "<!-- table two -->\n| x |\n<!-- end -->" in page.read_text()
    assert picture_folder(Namespace(output=tmp_path / "other", page=None)) == tmp_path / "other"
    write({}, {}, Namespace(output=tmp_path / "no" / "picture", page=None), "numbers.json")
    assert (tmp_path / "no" / "picture" / "numbers.json").exists()


def test_a_picture_has_few_colours(tmp_path: Path) -> None:
    figure = Figure(figsize=(2.0, 1.0))
    figure.subplots().imshow(np.random.default_rng(0).random((40, 40)))
    save(figure, tmp_path / "picture.png")
    with Image.open(tmp_path / "picture.png") as image:
        assert image.mode == "P"
        assert image.width > 100
