"""How the problems that routes answer with are described."""

from typing import Any

from service.http.problems import ProblemType
from service.http.schemas.problems import ProblemOut


def problems(*kinds: ProblemType) -> dict[int | str, dict[str, Any]]:
    """Description of the problems that a route may answer with, by status, as the framework takes it."""
    return {status: {"description": text, "model": ProblemOut} for status, text in description_of(*kinds).items()}


def description_of(*kinds: ProblemType) -> dict[int, str]:
    """What is said of problems, by status."""
    by_status: dict[int, list[str]] = {}
    for kind in sorted(kinds, key=lambda kind: kind.status):
        by_status.setdefault(kind.status, []).append(f"{kind.title} (`{kind.uri}`)")
    return {status: "; ".join(texts) for status, texts in by_status.items()}
