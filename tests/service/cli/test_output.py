"""What commands print, without what made it."""

import json

import numpy as np
import pytest

from service.cli.output import LINE_WIDTH, plain, print_json, print_lines, print_table, printable

Capture = pytest.CaptureFixture[str]


def test_lines_stand_below_each_other_and_those_that_are_not_known_are_left_out(capsys: Capture) -> None:
    print_lines("a log", [("frames", "3"), ("of a longer name than all", None), ("sensor", "left\x1b[2J")])
    assert capsys.readouterr().out == "a log\n  frames  3\n  sensor  left\ufffd[2J\n"


def test_a_table_is_as_wide_as_a_line_may_be_and_empty_where_nothing_is_known(capsys: Capture) -> None:
    print_table("Logs", ("id", "μ [-]"), [(1, None), ("[bold]", "x" * 300)])
    title, head, _, first, *others = capsys.readouterr().out.splitlines()
    assert (title, head.split(), first.split()) == ("Logs", ["id", "μ", "[-]"], ["1"])
    assert "[bold]" in others[0]
    assert max(map(len, others)) <= LINE_WIDTH < len("".join(others))
    print_table("Logs", ("id",), [("x" * 50,)], width=20)
    assert all(len(line) <= 20 for line in capsys.readouterr().out.splitlines())


def test_letters_that_are_not_seen_are_shown_as_such() -> None:
    assert printable("a\x00b\u202ec\u00add é\n") == "a\ufffdb\ufffdc\ufffdd é\ufffd"


def test_json_holds_arrays_as_lists_and_no_nan(capsys: Capture) -> None:
    assert plain({1: np.array([1.0, np.nan]), "b": (np.int64(3), [np.inf])}) == {"1": [1.0, None], "b": [3, [None]]}
    print_json({"name": "β", "found": None, "true": True})
    out = capsys.readouterr().out
    assert json.loads(out) == {"name": "β", "found": None, "true": True}
    assert out == '{\n  "name": "β",\n  "found": null,\n  "true": true\n}\n'


def test_a_table_is_of_no_use_where_nothing_can_be_printed_and_no_failure(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    with monkeypatch.context() as without:
        without.setattr("sys.stdout", None)
        print_table("Logs", ("id",), [("1",)])
    assert tuple(capsys.readouterr()) == ("", "")
    print_table("Logs", ("id",), [("2",)])
    assert "2" in capsys.readouterr().out
