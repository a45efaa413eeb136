"""Entries of the audit trail."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from db.records import AuditEntry
from service.http.schemas.common import MOMENT_EXAMPLE, Next


class AuditEntryOut(BaseModel):
    """Who changed what, when, and from where."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "id": 812,
                    "at": MOMENT_EXAMPLE,
                    "actor": "key:3f9c2a7b51de",
                    "address": "10.0.0.9",
                    "request_id": "3f1c9a0e6d2b4a5c8e7f0a1b2c3d4e5f",
                    "action": "grasp_log.withdrawn",
                    "subject": "7c9e6679742540de944be07fc1f90ae7",
                    "details": {"reason": "the sensor was wet"},
                }
            ]
        }
    )

    id: int
    at: datetime
    actor: Annotated[str, Field(description="`key:ID`, `anybody` without a key, `command:USER` or `service`")]
    address: Annotated[str | None, Field(description="Network address of the caller")]
    request_id: str | None
    action: Annotated[str, Field(description="docs/api.md has them all; more may be added")]
    subject: Annotated[str, Field(description="Name of a material, or id of a log, a job or a key")]
    details: dict[str, Any]

    @classmethod
    def of(cls, entry: AuditEntry) -> "AuditEntryOut":
        """The stored entry as an answer."""
        return cls(
            id=entry.id,
            at=entry.at,
            actor=entry.actor.name,
            address=entry.actor.address,
            request_id=entry.actor.request_id,
            action=entry.action,
            subject=entry.subject,
            details=dict(entry.details),
        )


class AuditOut(BaseModel):
    """Entries of the audit trail, newest first."""

    items: list[AuditEntryOut]
    next: Next
