"""Whether the service lives, and can take work."""

from typing import Literal

from pydantic import BaseModel, Field


class HealthOut(BaseModel):
    """The process lives; its stores may be in trouble, which a restart does not always mend."""

    status: Literal["ok", "degraded"] = "ok"
    trouble: str | None = Field(default=None, description="What is wrong with database or files, since seconds ago")


class ReadyOut(BaseModel):
    """The service can take work."""

    status: Literal["ready"] = "ready"
    database: Literal["ok"] = "ok"
    blobs: Literal["ok"] = "ok"
