"""What errors say, and that they come whole out of another process."""

import pickle

import pytest

from stiction_client import InvalidArgument, NoFeasibleForce, ProblemError, errors


@pytest.mark.parametrize(
    ("cause", "observed", "told"),
    [
        ("physics", None, "; even the friction that is expected holds less"),
        ("limit", 0.05, "; a normal force above the limit would hold it"),
        ("range", 0.05, "; only normal forces beyond those observed, 0.05 N an element, would hold it: record grasps"),
        ("range", None, "; only normal forces beyond those observed would hold it: record grasps that press harder"),
        ("ignorance", 1.0, "; the friction that is expected would hold it, but is too uncertain: record more grasps"),
        ("", 1.0, ""),
    ],
)
def test_why_no_force_holds_is_told_with_what_to_do(cause: str, observed: float | None, told: str) -> None:
    error = NoFeasibleForce(50.0, 6.25, 30.0, "slip probability 0.01", cause, observed)
    begin = (
        "no normal force holds 50 N (slip probability 0.01); the largest load held so is 6.25 N, at a normal force of "
    )
    assert str(error).startswith(f"{begin}30 N{told}")
    assert str(error).endswith(told) or told in str(error)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.cause, again.largest_observed) == (str(error), cause, observed)


def test_with_which_slip_probability_it_would_be_held_is_told() -> None:
    error = NoFeasibleForce(50.0, 6.25, 30.0, "slip probability 0.01", "limit", None, 0.0123)
    assert str(error).endswith("above the limit would hold it; with a slip probability of 0.0123 it would be held")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.least_slip_probability) == (str(error), 0.0123)


def test_a_load_that_nothing_holds_has_no_largest_one() -> None:
    assert "; no load is held so at any force" in str(NoFeasibleForce(1.0, 0.0, 0.0, "none"))
    assert "; the largest load held so is 1e-09 N" in str(NoFeasibleForce(1.0, 1e-9, 0.0, "none"))


def test_a_problem_says_its_type_and_keeps_its_facts() -> None:
    error = ProblemError("/problems/not-owner", 403, "another's", facts={"owners": ["key:a"]})
    assert str(error) == "another's (403, /problems/not-owner)"
    again = pickle.loads(pickle.dumps(error))
    assert (again.type, again.status, again.facts, again.name) == (error.type, 403, {"owners": ["key:a"]}, None)
    assert ProblemError("x", 400, "y").facts == {}


def test_a_wrong_argument_keeps_its_three_parts() -> None:
    error = pickle.loads(pickle.dumps(InvalidArgument("load", 3, "less")))
    assert (str(error), error.name, error.value, error.allowed) == ("load is 3; allowed: less", "load", "3", "less")
    assert isinstance(error, ValueError)


@pytest.mark.parametrize("kind", [errors.JobRefused, errors.JobFailed, errors.JobCancelled, errors.JobTimedOut])
def test_a_job_s_error_names_it(kind: type[errors.JobError]) -> None:
    error = pickle.loads(pickle.dumps(kind("7f", "no slip")))
    assert (type(error), str(error), error.job_id, error.reason) == (kind, "job 7f: no slip", "7f", "no slip")
