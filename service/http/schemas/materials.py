"""Materials, what may be changed of them, and merges."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic.config import JsonDict

from db.records import Material
from service.domain.models.recommended import Recommended, recommended
from service.http.schemas.common import MOMENT_EXAMPLE, Body, Name, Next, Reason, Reference, Text
from service.http.schemas.jobs import JOB_EXAMPLE, JobOut
from service.http.schemas.models import MODEL_EXAMPLE, FrictionModelOut

MATERIAL_EXAMPLE: JsonDict = {
    "name": "paper",
    "aliases": ["80 g paper"],
    "description": "80 g/m²",
    "created_at": MOMENT_EXAMPLE,
    "grasp_logs": 12,
    "withdrawn_grasp_logs": 0,
    "models": {"ols": MODEL_EXAMPLE},
    "recommended": {
        "method": "ols",
        "because": "ols: the material has no hierarchical model yet; ask for a fit by auto",
    },
}


class NewMaterial(Body):
    """A material to be made known."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"name": "paper", "description": "80 g/m²"}]})

    name: Name
    description: Text = ""


class MaterialChange(Body):
    """What is to be different about a material; what is left out stays."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"name": "cardboard brown"}]})

    name: Annotated[Name | None, Field(description="Its new name; the old one becomes an alias")] = None
    description: Text | None = None


class NewMerge(Body):
    """A merge that is asked for."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"source": "papre"}]})

    source: Annotated[Reference, Field(max_length=100, description="The material whose logs and names move here")]


class NewEpoch(Body):
    """An epoch that is to begin: what was recorded before counts in no fit."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"reason": "new lot, coated", "first_grasp_log": "7c9e6679742540de944be07fc1f90ae7"}]
        }
    )

    reason: Reason
    first_grasp_log: Annotated[
        Reference | None, Field(description="Id of the first log of the epoch; null: the next that comes")
    ] = None


class RecommendedOut(BaseModel):
    """The recommended one of a material's models."""

    method: str
    because: str

    @classmethod
    def of(cls, found: Recommended | None) -> "RecommendedOut | None":
        """The recommendation as an answer, if there is one."""
        return None if found is None else cls(method=found.stored.model.method, because=found.because)


class MaterialOut(BaseModel):
    """A material with its current models."""

    model_config = ConfigDict(json_schema_extra={"examples": [MATERIAL_EXAMPLE]})

    name: str
    aliases: Annotated[list[str], Field(description="Other names under which it is found")]
    description: str
    created_at: datetime
    grasp_logs: Annotated[int, Field(description="How many logs of it are stored")]
    withdrawn_grasp_logs: Annotated[int, Field(description="How many of them count in no fit")]
    models: Annotated[dict[str, FrictionModelOut], Field(description="The current model of each method")]
    recommended: Annotated[
        RecommendedOut | None, Field(description="Which of them answers who names no method; null: none may be")
    ] = None

    @classmethod
    def of(cls, material: Material) -> "MaterialOut":
        """The stored material as an answer."""
        return cls(
            name=material.name,
            aliases=list(material.aliases),
            description=material.description,
            created_at=material.created_at,
            grasp_logs=material.grasp_logs,
            withdrawn_grasp_logs=material.withdrawn_grasp_logs,
            models={stored.model.method: FrictionModelOut.of(stored) for stored in material.models},
            recommended=RecommendedOut.of(recommended(material.models)),
        )


class MaterialsOut(BaseModel):
    """Materials in the order that was asked for."""

    items: list[MaterialOut]
    next: Next


class EpochOut(BaseModel):
    """A material whose epoch began: how many of its logs were withdrawn, and the fits that follow from it."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"material": MATERIAL_EXAMPLE, "withdrawn": 12, "jobs": [JOB_EXAMPLE]}]}
    )

    material: MaterialOut
    withdrawn: int
    jobs: list[JobOut]


class MergedOut(BaseModel):
    """A material after a merge, and the fits that follow from it."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"material": MATERIAL_EXAMPLE, "jobs": [JOB_EXAMPLE]}]})

    material: MaterialOut
    jobs: list[JobOut]
