"""Owners of materials."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

OWNER_PATTERN = r"^(key:[0-9a-f]{12}|group:[A-Za-z0-9][A-Za-z0-9 ._-]{0,99})$"
OWNER_RULE = "`key:` and the id of an access key, or `group:` and a group's name."


class OwnersOut(BaseModel):
    """Whose a material is."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"owners": ["key:3f9c2a7b51de", "group:lab 1"]}]})

    owners: Annotated[list[str], Field(description="`key:ID` or `group:NAME`; none: the scope alone decides")]
