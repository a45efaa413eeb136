"""Jobs."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic.config import JsonDict

from db.records import Job, JobKind, JobStatus
from service.http.schemas.common import MOMENT_EXAMPLE, Next

JOB_EXAMPLE: JsonDict = {
    "id": "0f8fad5bd9cb469fa16570867728950e",
    "kind": "ingest",
    "status": "done",
    "stage": None,
    "reason": None,
    "seconds": {"frames": 0.01, "slip_state": 0.06, "samples": 0.01, "friction_model": 0.02, "material": 0.01},
    "grasp_log": "7c9e6679742540de944be07fc1f90ae7",
    "material": "paper",
    "deaths": 0,
    "model_version": 3,
    "requested_by": "3f9c2a7b51de",
    "created_at": MOMENT_EXAMPLE,
    "finished_at": MOMENT_EXAMPLE,
}


class JobOut(BaseModel):
    """A job; `refused`: the data do not allow it, `failed`: the service could not do it, `cancelled`: by request.

    `reason` says why.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [JOB_EXAMPLE]})

    id: str
    kind: JobKind
    status: JobStatus
    stage: Annotated[str | None, Field(description="The stage it is in, or in which it ended")]
    reason: str | None
    seconds: Annotated[dict[str, float], Field(description="Of each stage that is done")]
    grasp_log: str | None
    material: str | None
    deaths: Annotated[int, Field(description="Worker processes that died under it")]
    model_version: Annotated[int | None, Field(description="The version of the model that it stored")]
    requested_by: Annotated[str | None, Field(description="Id of the access key with which it was asked for")]
    created_at: datetime
    finished_at: datetime | None

    @classmethod
    def of(cls, job: Job) -> "JobOut":
        """The stored job as an answer."""
        return cls(
            id=job.id,
            kind=job.kind,
            status=job.status,
            stage=job.stage,
            reason=job.reason,
            seconds=dict(job.seconds),
            grasp_log=job.grasp_log_id,
            material=job.material,
            deaths=job.deaths,
            model_version=job.model_version,
            requested_by=job.requested_by,
            created_at=job.created_at,
            finished_at=job.finished_at,
        )


class JobsOut(BaseModel):
    """Jobs in the order that was asked for."""

    items: list[JobOut]
    next: Next
