"""Errors as problem details, RFC 9457."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


class WrongValue(BaseModel):
    """One of several things that were wrong."""

    name: str
    value: str | None
    allowed: str | None


class ProblemOut(BaseModel):
    """Problem details, RFC 9457."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "type": "/problems/invalid-request",
                    "title": "A value in the request is not allowed",
                    "status": 422,
                    "detail": "quantile is 1.5; allowed: less than 1",
                    "instance": "/v1/materials/paper/friction",
                    "request_id": "3f1c9a0e6d2b4a5c8e7f0a1b2c3d4e5f",
                    "name": "quantile",
                    "value": "1.5",
                    "allowed": "less than 1",
                }
            ]
        }
    )

    type: Annotated[str, Field(description="Stable; docs/problems.md has them all")]
    title: str
    status: int
    detail: str
    instance: str
    request_id: Annotated[str | None, Field(description="As in the header `X-Request-ID` and in the server's log")] = (
        None
    )
    name: Annotated[str | None, Field(description="What was wrong")] = None
    value: str | None = None
    allowed: str | None = None
    errors: list[WrongValue] | None = None
    largest_load: Annotated[float | None, Field(description="Where no force holds: the most that is held, N")] = None
    normal_force: Annotated[float | None, Field(description="Where no force holds: that which holds it, N")] = None
    largest_observed: Annotated[
        float | None, Field(description="Where no force holds: greatest normal force of an element in the data, N")
    ] = None
    least_slip_probability: Annotated[
        float | None, Field(description="Where no force holds: the least with which one does; null: none by 0.1")
    ] = None
