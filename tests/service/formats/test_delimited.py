"""Lines, cells and numbers of tables, and what is no such."""

import math
from pathlib import Path

import pytest

from service.formats import delimited
from service.formats.json_text import parse, parse_object
from service.formats.ros_types import MAX_DEFINITION_CHARACTERS, check_type_name, deserializer
from slipcore.errors import InvalidInput


def test_lines_are_utf8_and_another_one_is_named_by_its_number(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes("µ,1\nb\n".encode() + b"\xff\n")
    lines = delimited.text_lines(path)
    assert [next(lines), next(lines)] == ["µ,1\n", "b\n"]
    with pytest.raises(InvalidInput, match=r"line 3 is not UTF-8 \(invalid start byte\); allowed: UTF-8 text"):
        next(lines)


def test_a_file_may_be_as_large_as_the_bound_and_no_larger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delimited, "MAX_ARRAY_BYTES", 4)
    (tmp_path / "4").write_text("a,b\n")
    (tmp_path / "5").write_text("a,bc\n")
    assert list(delimited.text_lines(tmp_path / "4")) == ["a,b\n"]
    with pytest.raises(InvalidInput, match="file is 5 bytes; allowed: at most 4 bytes"):
        list(delimited.text_lines(tmp_path / "5"))


@pytest.mark.parametrize(
    ("header", "delimiter"), [("a,b,c d", ","), ('"a"; b ;c, d', ";"), ("a\tb\tc,;d", "\t"), ("alone", ",")]
)
def test_a_header_is_parted_by_what_it_has_most_of(header: str, delimiter: str) -> None:
    names, found = delimited.split_header(header)
    assert found == delimiter
    assert names[0].strip() in {"a", "alone"}
    assert len(names) == 1 + header.count(delimiter)


def test_rows_are_numbered_by_their_lines_without_comments_and_empty_ones() -> None:
    lines = iter(["1,2\n", "\n", " # 3,4\n", '5,"a\nb"\n', "7,8\n"])
    assert list(delimited.rows(lines, ",", 2, 10, 3)) == [(11, ["1", "2"]), (14, ["5", "a\nb"]), (15, ["7", "8"])]


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (["1,2\n", "1\n"], "line 12 is of 1 cells; allowed: 2, as in the header"),
        (["1,2\n"] * 4, "file is more than 3 rows; allowed: at most 3 rows"),
        (["1,2\n", "1,\0\n"], r"line 12"),
    ],
)
def test_a_row_that_is_none_is_named_by_its_line(lines: list[str], told: str) -> None:
    with pytest.raises(InvalidInput, match=told):
        [
            delimited.parse_number(cell, line, "x")
            for line, row in delimited.rows(iter(lines), ",", 2, 10, 3)
            for cell in row
        ]


@pytest.mark.parametrize(("text", "value"), [("1e-3", 1e-3), (" -2 ", -2.0), ("", math.nan), ("nan", math.nan)])
def test_a_cell_is_a_number_or_lost(text: str, value: float) -> None:
    assert delimited.parse_number(text, 3, "x") == pytest.approx(value, nan_ok=True)


@pytest.mark.parametrize("text", ["inf", "-inf", "1e999", "1_0", "٣", "1,5", "x", " "])
def test_what_is_no_finite_number_is_named_by_line_and_column(text: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        delimited.parse_number(text, 3, "x", "a number")
    assert str(refusal.value) == f"line 3, x is {text!r}; allowed: a number"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('{"a": 1, "a": 2}', "mapping is with .*a.*; allowed: each key of an object once"),
        ("{", r"mapping is not JSON \(Expecting property name.*; allowed: a JSON object"),
        ("[" * 100_000, "mapping is not JSON"),
        ("[1]", "mapping is JSON of a list; allowed: a JSON object"),
    ],
)
def test_json_that_is_no_object_is_named(text: str, told: str) -> None:
    with pytest.raises(InvalidInput, match=told):
        parse_object("mapping", text)
    assert parse("mapping", "[1]") == [1]
    assert parse_object("mapping", b'{"a": {"b": 1}}') == {"a": {"b": 1}}


@pytest.mark.parametrize("name", ["a/B", "a_1/msg/B2", f"{'a' * 100}/{'B' * 100}"])
def test_a_ros_type_has_a_package_and_a_plain_name(name: str) -> None:
    assert check_type_name(name) == (name if "/msg/" in name else name.replace("/", "/msg/"))


@pytest.mark.parametrize("name", ["B", "a/b/C", "1a/B", "a/msg/", "a/B\n", f"{'a' * 101}/B", "a/B()"])
def test_what_could_be_code_is_no_type(name: str) -> None:
    with pytest.raises(InvalidInput, match="allowed: package/msg/Name, of letters, digits and _"):
        check_type_name(name)


@pytest.mark.parametrize(
    "definition", ["# " + "x" * MAX_DEFINITION_CHARACTERS, "float64[10000001] x", "float64[<=99999999] x"]
)
def test_a_definition_that_is_too_long_or_claims_too_much_is_refused(definition: str) -> None:
    with pytest.raises(InvalidInput, match=f"definition of a/msg/B is {len(definition)} characters; allowed: at most"):
        deserializer("a/B", definition, ros1=False)
    assert callable(deserializer("a/B", "float64[9999999] x\n#" + "x" * 100, ros1=False))


@pytest.mark.parametrize(
    ("delimiter", "cell", "read"),
    [
        (";", "1,5", "1.5"),
        (";", " -12,25e-3", " -12.25e-3"),
        (";", "1,234,5", "1,234,5"),
        (";", "a,b", "a,b"),
        (";", "1.5", "1.5"),
        ("\t", "1,5", "1,5"),
    ],
)
def test_between_semicolons_numbers_may_have_a_decimal_comma(delimiter: str, cell: str, read: str) -> None:
    ((_, cells),) = delimited.rows(iter([f"0{delimiter}{cell}\n"]), delimiter, 2, 0, 1)
    assert cells == ["0", read]
