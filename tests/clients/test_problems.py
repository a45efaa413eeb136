import math
import pickle

import httpx
import pytest

import stiction_client
from service.http.problems import PROBLEM_TYPES
from stiction_client import FrictionClient, ProblemError, problems


def client_of(kind: str, status: int, **facts: object) -> FrictionClient:
    """A client of a service that refuses whatever is asked."""

    def answer(_: httpx.Request) -> httpx.Response:
        body = {"type": kind, "title": "t", "detail": "d", "name": "n", "value": "v", "allowed": "a"} | facts
        return httpx.Response(status, json=body, headers={"Retry-After": "1000"})

    return FrictionClient("http://service", transport=httpx.MockTransport(answer))


def test_each_problem_of_the_service_has_its_exception_and_no_other_is_there() -> None:
    assert set(problems.BY_TYPE) == {entry.uri for entry in PROBLEM_TYPES.values()}


@pytest.mark.parametrize("entry", PROBLEM_TYPES.values(), ids=lambda entry: entry.name)
def test_a_problem_is_raised_as_its_exception(entry: object) -> None:
    kind, status = entry.uri, entry.status  # type: ignore[attr-defined]
    with client_of(kind, status) as client, pytest.raises(ProblemError) as caught:
        client.material("paper")
    assert type(caught.value) is problems.BY_TYPE[kind]
    again = pickle.loads(pickle.dumps(caught.value))
    assert (type(again), again.args) == (type(caught.value), (kind, status, "d", "n", "v", "a", {}))
    assert str(caught.value) == f"d ({status}, {kind})"


def test_a_problem_of_a_later_version_is_a_problem() -> None:
    with client_of("/problems/of-tomorrow", 418) as client, pytest.raises(ProblemError) as caught:
        client.material("paper")
    assert type(caught.value) is ProblemError


def test_a_service_without_a_model_is_met_like_a_material_without_one() -> None:
    assert issubclass(problems.NoModel, stiction_client.NoModel)


def test_what_else_a_problem_tells_is_with_it() -> None:
    with client_of("/problems/not-owner", 403, owners=["ann"]) as client, pytest.raises(problems.NotOwner) as caught:
        client.material("paper")
    assert caught.value.facts == {"owners": ["ann"]}


def test_the_services_planner_refuses_as_the_clients_does() -> None:
    """One concept, whether it is computed here or there: what catches the one catches the other, with its numbers."""
    facts = {
        "largest_load": 3.8,
        "normal_force": 5.0,
        "cause": "limit",
        "largest_observed": 0.05,
        "least_slip_probability": 0.02,
    }
    with (
        client_of("/problems/no-feasible-force", 409, **facts) as client,
        pytest.raises(stiction_client.NoFeasibleForce) as caught,
    ):
        client.material("paper")
    for error in (caught.value, pickle.loads(pickle.dumps(caught.value))):
        assert {name: getattr(error, name) for name in facts} == facts
        assert (str(error), error.reason) == ("d (409, /problems/no-feasible-force)", "d")


@pytest.mark.parametrize("told", [None, "3.8", [3.8], {}, True, 10**400])
def test_a_problem_whose_numbers_are_none_stays_that_problem(told: object) -> None:
    """It had ended in an error of Python's own, which nobody catches who catches this package's."""
    names = ("largest_load", "normal_force", "largest_observed", "least_slip_probability")
    with (
        client_of("/problems/no-feasible-force", 409, **dict.fromkeys(names, told)) as client,
        pytest.raises(problems.NoFeasibleForce) as caught,
    ):
        client.material("paper")
    assert math.isnan(caught.value.largest_load)
    assert math.isnan(caught.value.normal_force)
    assert (caught.value.largest_observed, caught.value.least_slip_probability) == (None, None)
