from collections.abc import Iterator

import pytest

from service.domain.errors import (
    DomainError,
    InsufficientScope,
    InvalidValue,
    JobEnded,
    NoFeasibleForce,
    NotOwner,
    QuotaExceeded,
)
from service.http.errors import OF_USE_CASES, _wrong_value, problem_of
from service.http.schemas.common import NAME_PATTERN, NAME_RULE


def below(kind: type[DomainError]) -> Iterator[type[DomainError]]:
    for each in kind.__subclasses__():
        yield each
        yield from below(each)


def test_each_error_of_a_use_case_has_its_problem_type() -> None:
    assert set(OF_USE_CASES) == set(below(DomainError))


def test_a_wrong_value_is_named_in_its_problem() -> None:
    problem = problem_of(InvalidValue("source", "a\ud800", "another material"))
    assert problem.detail == "source is a\\ud800; allowed: another material"
    assert (problem.name, problem.value, problem.allowed) == ("source", "a\\ud800", "another material")


def test_a_value_is_repeated_only_in_part() -> None:
    assert problem_of(InvalidValue("source", "a" * 1000, "less")).value == "a" * 200


@pytest.mark.parametrize(
    ("error", "header"),
    [
        (QuotaExceeded("queued jobs of this key are 9", 10), ("Retry-After", "10")),
        (
            InsufficientScope("read", "upload"),
            ("WWW-Authenticate", 'Bearer realm="stiction", error="insufficient_scope", scope="upload"'),
        ),
    ],
)
def test_what_a_client_can_do_stands_in_a_header(error: DomainError, header: tuple[str, str]) -> None:
    assert list(problem_of(error).headers.items()) == [header]


@pytest.mark.parametrize(
    ("error", "members"),
    [
        (NotOwner(["key:3f9c2a7b51de"]), {"owners": ["key:3f9c2a7b51de"]}),
        (NoFeasibleForce("none", facts={"largest_load": 3.8}), {"largest_load": 3.8}),
        (JobEnded("00", "done"), {}),
    ],
)
def test_further_facts_are_members_of_the_problem(error: DomainError, members: dict[str, object]) -> None:
    assert problem_of(error).more == members


@pytest.mark.parametrize(
    ("entry", "name", "value", "allowed"),
    [
        (
            {"type": "json_invalid", "loc": ("body", 3), "ctx": {"error": "Expecting value"}},
            "body",
            "not JSON (Expecting value)",
            "a JSON object",
        ),
        ({"type": "missing", "loc": ("query", "fn")}, "fn", "missing", "a value"),
        ({"type": "missing", "loc": ("body",)}, "body", "missing", "a JSON object"),
        (
            {
                "type": "less_than",
                "loc": ("body", "presses", 2, "force"),
                "input": 9,
                "msg": "Input should be less than 5",
            },
            "presses.2.force",
            "9",
            "less than 5",
        ),
        (
            {"type": "value_error", "loc": ("query", "v"), "input": "x", "msg": "Value error, a number"},
            "v",
            "x",
            "a number",
        ),
    ],
)
def test_what_the_framework_finds_wrong_is_told_as_any_wrong_value(
    entry: dict[str, object], name: str, value: str, allowed: str
) -> None:
    problem = _wrong_value(entry)
    assert (problem.kind.name, problem.name, problem.value, problem.allowed) == (
        "invalid-request",
        name,
        value,
        allowed,
    )
    assert problem.detail == f"{name} is {value}; allowed: {allowed}"


@pytest.mark.parametrize(
    ("kind", "value", "ctx", "msg", "allowed"),
    [
        ("extra_forbidden", 1, {}, "Extra inputs are not permitted", "no field of this name"),
        ("model_attributes_type", [], {}, "Input should be a valid dictionary or object to …", "a JSON object"),
        ("string_too_short", "", {"min_length": 1}, "String should have …", "text of at least 1 character(s)"),
        ("string_type", 5, {}, "Input should be a valid string", "text"),
        ("list_type", 5, {}, "Input should be a valid list", "a list"),
        ("too_short", [], {"min_length": 1}, "List should have at least 1 item …", "1 or more of them"),
        ("too_short", "", {"min_length": 1}, "Value should have at least …", "text of at least 1 character(s)"),
        ("too_long", "ab", {"max_length": 1}, "Value should have at most …", "text of at most 1 characters"),
        ("too_long", [], {"max_length": 64}, "List should have at most 64 items …", "at most 64 of them"),
        ("string_pattern_mismatch", "a/b", {"pattern": NAME_PATTERN}, "String …", NAME_RULE.removesuffix(".")),
        ("string_pattern_mismatch", "x", {"pattern": "^a$"}, "String should match …", "text that matches ^a$"),
        ("less_than_equal", "nan", {}, "Input should be less than or equal to 1", "a number less than or equal to 1"),
        (
            "float_parsing",
            "x",
            {},
            "Input should be a valid number, unable to parse string as a number",
            "a valid number",
        ),
        ("greater_than", -1, {}, "Input should be greater than 0.000000000001", "greater than 1e-12"),
    ],
)
def test_what_is_allowed_is_said_in_words_of_ours(
    kind: str, value: object, ctx: dict[str, object], msg: str, allowed: str
) -> None:
    entry = {"type": kind, "loc": ("body", "name"), "input": value, "ctx": ctx, "msg": msg}
    assert _wrong_value(entry).allowed == allowed


@pytest.mark.parametrize(
    ("kind", "place", "value", "shown"),
    [
        ("float_type", "body", "2", '"2"'),
        ("float_type", "body", True, "true"),
        ("string_type", "body", None, "null"),
        ("float_parsing", "query", "fast", "fast"),
        ("greater_than", "body", -1, "-1"),
        ("string_too_short", "body", "", '""'),
        ("value_error", "body", {"thickness": 0.004}, '{"thickness": 0.004}'),
        ("too_short", "body", [], "[]"),
    ],
)
def test_a_value_of_the_wrong_kind_is_shown_as_json_has_it(kind: str, place: str, value: object, shown: str) -> None:
    entry = {"type": kind, "loc": (place, "load"), "input": value, "ctx": {"min_length": 1}, "msg": "Input should be 1"}
    assert _wrong_value(entry).value == shown
