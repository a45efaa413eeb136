"""Which error ends a command with which exit code."""

from service.formatting import renamed

INPUT_REFUSED = 3
FAILURE = 1
SERVICE_REFUSED = 4
NOT_FEASIBLE = 5
INTERRUPTED = 130
"""As shells have it of what SIGINT ended; typer leaves with it, too."""

CODE_OF_STATUS = {
    "failed": FAILURE,
    "refused": INPUT_REFUSED,
    "rejected": SERVICE_REFUSED,
    "cancelled": SERVICE_REFUSED,
}
"""How an upload ended, as an exit code: our fault, data that allow no fit, not wanted, a file that is not taken."""


OPTIONS = {
    "fn": "--normal-force",
    "v": "--velocity",
    "tangential_velocity": "--velocity",
    "tangential_load": "--load",
    "slip_probability": "--slip-probability",
    "safety_factor": "--safety-factor",
    "object_radius": "--object-radius",
    "area": "--contact-area",
    "at_force": "--round-at",
    "normal_force_limit": "--limit",
}
"""What commands call a value that services and the planner know by another name."""


def message(error: Exception) -> str:
    """What is said of an error before the command ends."""
    from pydantic import ValidationError

    from service.settings import complaints

    if isinstance(error, ValidationError):
        text = complaints(error)
    elif isinstance(error, MemoryError):
        text = f"not enough memory for what was asked ({str(error) or 'no more is free'})"
    else:
        text = _by_option(error, _of_system(error) if isinstance(error, OSError) else str(error))
    return "\n".join([text, *getattr(error, "__notes__", ())])


def _by_option(error: Exception, text: str) -> str:
    """What is said of a wrong value, called as the command does."""
    name = getattr(error, "name", None)
    return renamed(text, name, OPTIONS[name]) if name in OPTIONS else text


def _of_system(error: OSError) -> str:
    """What a system says of a file, without its number of the error; of two files, that which was to be written."""
    name = error.filename if error.filename2 is None else error.filename2
    if error.strerror is None:
        return str(error)
    return error.strerror if name is None else f"{name!r}: {error.strerror}"


def exit_code(error: Exception) -> int | None:
    """Exit code of an error that a user can act upon; None for one that is ours (a traceback is due)."""
    from pydantic import ValidationError

    from db.errors import DatabaseError
    from estimators.errors import EstimatorError
    from service.domain.access.keys import NoKeys
    from slipcore.errors import SlipcoreError
    from stiction_client.errors import InvalidArgument, NoFeasibleForce, StictionError

    codes: list[tuple[type[Exception], int]] = [
        (NoFeasibleForce, NOT_FEASIBLE),
        (InvalidArgument, INPUT_REFUSED),
        (StictionError, SERVICE_REFUSED),
        (ValidationError, INPUT_REFUSED),  # a setting outside its range
        (DatabaseError, INPUT_REFUSED),
        (NoKeys, INPUT_REFUSED),
        (EstimatorError, INPUT_REFUSED),
        (SlipcoreError, INPUT_REFUSED),
        (OSError, INPUT_REFUSED),
        (MemoryError, FAILURE),
    ]
    return next((code for kind, code in codes if isinstance(error, kind)), None)
