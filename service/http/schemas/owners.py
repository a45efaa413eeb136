"""Owners of materials."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


class OwnersOut(BaseModel):
    """Whose a material is."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"owners": ["key:3f9c2a7b51de", "group:lab 1"]}]})

    owners: Annotated[list[str], Field(description="`key:ID` or `group:NAME`; none: the scope alone decides")]
