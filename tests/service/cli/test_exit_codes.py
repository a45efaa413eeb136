"""With which exit code and words a command ends by an error."""

from pathlib import Path

import pytest
from pydantic import ValidationError

from db.errors import DatabaseError, NotFound, StorageUnavailable
from estimators.errors import EstimatorError, TooFewSamples
from service import cli
from service.cli.exit_codes import (
    FAILURE,
    INPUT_REFUSED,
    INTERRUPTED,
    NOT_FEASIBLE,
    SERVICE_REFUSED,
    exit_code,
    message,
)
from service.domain.access.keys import NoKeys
from service.settings import Settings
from slipcore.errors import InvalidInput, NoForces
from stiction_client import ConnectionFailed, InvalidArgument, NoFeasibleForce
from stiction_client.errors import JobError, ProblemError


def refused_settings(folder: Path) -> ValidationError:
    with pytest.raises(ValidationError) as refused:
        Settings(data=folder, port=-1)
    return refused.value


def test_codes_differ_and_none_says_that_all_is_well() -> None:
    codes = {FAILURE, INPUT_REFUSED, SERVICE_REFUSED, NOT_FEASIBLE, INTERRUPTED}
    assert codes == {1, 3, 4, 5, 130}


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (NoFeasibleForce(3.0, 1.0, 2.0, "the limit"), NOT_FEASIBLE),
        (InvalidArgument("load", -1.0, "0 or more"), INPUT_REFUSED),
        (ConnectionFailed("nobody listens"), SERVICE_REFUSED),
        (JobError("1", "no slip"), SERVICE_REFUSED),
        (ProblemError("/problems/no-model", 404, "no model"), SERVICE_REFUSED),
        (NotFound("material", "paper"), INPUT_REFUSED),
        (StorageUnavailable("locked"), INPUT_REFUSED),
        (DatabaseError("none"), INPUT_REFUSED),
        (NoKeys("none"), INPUT_REFUSED),
        (TooFewSamples("samples", 0, "30 or more"), INPUT_REFUSED),
        (EstimatorError("none"), INPUT_REFUSED),
        (InvalidInput("time", -1.0, "0 or more"), INPUT_REFUSED),
        (NoForces("none"), INPUT_REFUSED),
        (FileNotFoundError("log.npz"), INPUT_REFUSED),
        (MemoryError("Unable to allocate 3.64 TiB"), FAILURE),
        (ZeroDivisionError(), None),
        (ValueError("ours"), None),
        (KeyError("ours"), None),
    ],
)
def test_an_error_that_a_user_can_act_upon_has_a_code_and_ours_has_none(error: Exception, code: int | None) -> None:
    assert exit_code(error) == code


def test_a_setting_out_of_its_range_is_an_input(tmp_path: Path) -> None:
    refused = refused_settings(tmp_path)
    assert exit_code(refused) == INPUT_REFUSED
    assert "port" in message(refused).lower()
    assert "pydantic" not in message(refused)


def test_what_is_said_of_an_error_is_its_text_and_its_notes_line_by_line() -> None:
    error = InvalidInput("time", -1.0, "0 or more")
    assert message(error) == "time is -1.0; allowed: 0 or more"
    error.add_note("in frame 3")
    error.add_note("of log.npz")
    assert message(error) == "time is -1.0; allowed: 0 or more\nin frame 3\nof log.npz"


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (InvalidArgument("tangential_load", -1.0, "0 or more"), "--load is -1.0; allowed: 0 or more"),
        (InvalidArgument("slip_probability", 0, "1e-12 to 0.5"), "--slip-probability is 0; allowed: 1e-12 to 0.5"),
        (InvalidArgument("at_force", 0.0, "above 0"), "--round-at is 0.0; allowed: above 0"),
        (InvalidArgument("of", "x", "element or contact"), "of is x; allowed: element or contact"),
        (
            ProblemError("/problems/invalid-request", 422, "fn is -1; allowed: 0 to 10", "fn", "-1", "0 to 10"),
            "--normal-force is -1; allowed: 0 to 10 (422, /problems/invalid-request)",
        ),
        (ProblemError("/problems/no-model", 409, "nothing at v", "v", "1"), "nothing at v (409, /problems/no-model)"),
    ],
)
def test_a_wrong_value_is_called_as_the_option_is(error: Exception, told: str) -> None:
    assert message(error) == told


@pytest.mark.parametrize(
    ("arguments", "garbled"),
    [
        (["a", "é\U0001f600"], None),
        (["a", "b\udcff", "\ud800"], "b\udcff"),
        (["\ud800"], "\ud800"),
        (["\ud7ff", "\ue000"], None),
        ([], None),
    ],
)
def test_the_first_argument_that_is_no_text_is_named(arguments: list[str], garbled: str | None) -> None:
    assert cli._garbled(arguments) == garbled


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (FileNotFoundError(2, "No such file or directory", "a\udcff.npz"), r"'a\udcff.npz': No such file or directory"),
        (OSError(21, "Is a directory", "/tmp/.stiction-1.part/logs", None, "logs"), "'logs': Is a directory"),
        (OSError(28, "No space left on device"), "No space left on device"),
        (FileExistsError("logs is there"), "logs is there"),
    ],
)
def test_what_a_system_says_of_a_file_is_said_of_the_one_that_a_user_knows(error: OSError, said: str) -> None:
    assert message(error) == said


def test_memory_that_is_not_there_is_named_without_a_traceback() -> None:
    told = message(MemoryError("Unable to allocate 3.64 TiB"))
    assert told == "not enough memory for what was asked (Unable to allocate 3.64 TiB)"
    assert message(MemoryError()) == "not enough memory for what was asked (no more is free)"
