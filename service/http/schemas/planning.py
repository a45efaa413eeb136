"""What a planner asks beyond a look-up: how hard to grip, and which material it is."""

from typing import Annotated, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, model_validator

from estimators.method_names import FitMethod
from service.domain.planning.look_up import Averaged
from service.domain.planning.plan import GraspTask
from service.http.schemas.common import Area, Body, Force, Reference, Velocity
from service.http.schemas.models import CHOSEN_EXAMPLE, Advice, ChosenBecause, GraspingSensor, Notes, SupportKind
from service.http.schemas.results import SAMPLES_EXAMPLE


class NewGraspForce(Body):
    """A grasp that must hold."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"material": "paper", "tangential_load": 1.5, "contact_area": 6.0e-5}]},
    )

    material: Reference
    method: Annotated[FitMethod, Field(description="Whose current model answers; `auto`: the recommended one")] = "auto"
    tangential_load: Annotated[float, Field(ge=0.0, le=1e6, description="Of all fingers together, N")]
    torque: Annotated[float, Field(ge=0.0, le=1e6, description="Of all fingers together, N·m")] = 0.0
    contact_area: Annotated[float, Field(ge=1e-12, le=1.0, description="Of one finger, m²")]
    round_at: Annotated[
        float | None,
        Field(ge=1e-9, le=1e6, description="Of a round fingertip: normal force, N, under which it has that area"),
    ] = None
    fingers: Annotated[int, Field(ge=1, le=100, description="Equal contacts that share load and torque")] = 1
    object_radius: Annotated[
        float | None,
        Field(ge=1e-6, le=1e3, description="m; where the torque is about the axis of a round object, such as a lid"),
    ] = None
    safety_factor: Annotated[float, Field(ge=1.0, le=100.0, description="Multiplies load and torque")] = 1.0
    slip_probability: Annotated[float, Field(ge=1e-12, le=0.5, description="The largest that is accepted")] = 1e-3
    tangential_velocity: Annotated[Velocity, Field(description="m/s")] = 0.0
    normal_force_limit: Annotated[
        float | None, Field(gt=0.0, le=1e6, description="The most that object and gripper bear, N")
    ] = None
    of: Annotated[
        Averaged | None,
        Field(
            description="Whose scatter counts; without, the contact's where the model has `scales`, else an element's"
        ),
    ] = None
    elements: Annotated[
        float | None, Field(ge=1.0, le=1e12, description="Of a contact; without, as many as its area has")
    ] = None
    sensor: GraspingSensor = None

    def task(self) -> GraspTask:
        """The same as the planner takes it."""
        return GraspTask(**self.model_dump())


class GraspForceOut(BaseModel):
    """The normal force that holds, N."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "material": "paper",
                    "method": "hierarchical",
                    "version": 3,
                    "chosen_because": CHOSEN_EXAMPLE,
                    "normal_force": 4.9,
                    "feasible_interval": [4.9, 31.2],
                    "margin": 26.3,
                    "largest_load": 3.8,
                    "element_force": 0.081,
                    "friction_coefficient": 0.306,
                    "slip_probability": 0.001,
                    "within_domain": True,
                    "warning": None,
                    "of": "contact",
                    "elements": 60.0,
                    "support": "supported",
                    "advice": "the samples determine the expected friction to within ± 3.1%",
                    "notes": [],
                }
            ]
        }
    )

    material: str
    method: str
    version: int
    chosen_because: ChosenBecause = None
    normal_force: Annotated[float, Field(description="The smallest that holds, N")]
    feasible_interval: Annotated[
        list[float | None], Field(min_length=2, max_length=2, description="N; second null: no upper bound")
    ]
    margin: Annotated[float | None, Field(description="By how much the gripper may press too hard, N; null: any")]
    largest_load: Annotated[float | None, Field(description="The most that any force holds, N; null: any")]
    element_force: Annotated[float, Field(description="Normal force of one element then, N")]
    friction_coefficient: Annotated[float, Field(description="The cautious quantile there")]
    slip_probability: float
    within_domain: bool
    warning: str | None
    of: Annotated[Averaged, Field(description="Whose scatter is in the quantile")]
    elements: Annotated[float, Field(description="Over how many elements it averages out")]
    support: SupportKind
    advice: Advice
    notes: Notes


MOST_SAMPLES = 75_000
"""More than its body of 1 MiB can hold: seven columns of two bytes an entry."""

Item = TypeVar("Item")
Column = Annotated[list[Item], Field(max_length=MOST_SAMPLES, fail_fast=True)]
"""Of samples: the first that cannot be is named, and no more, for each would take its time."""


class SamplesIn(Body):
    """Friction samples of one grasp, as `GET /v1/grasp-logs/{id}/samples` gives them."""

    model_config = ConfigDict(json_schema_extra={"examples": [SAMPLES_EXAMPLE]})

    friction_coefficient: Column[Annotated[float, Field(ge=0.0, le=1e3, allow_inf_nan=False)]]
    tangential_velocity: Column[Velocity]
    normal_force: Column[Force]
    tangential_force: Column[Force]
    time: Column[Annotated[float, Field(ge=-1e9, le=1e9, allow_inf_nan=False)]]
    element: Column[Annotated[int, Field(ge=0, lt=2**31)]]
    weight: Column[Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]]
    kind: Annotated[Column[Literal["element", "contact"]] | None, Field(description="Without, all of elements")] = None
    velocity_is_relative: Annotated[Column[bool] | None, Field(description="Without, of none")] = None
    element_area: Area

    @model_validator(mode="after")
    def _alike(self) -> Self:
        lengths = {name: len(value) for name, value in self if isinstance(value, list)}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"lists of one length, not {lengths}")
        return self


class NewRecognition(Body):
    """A grasp whose material is to be recognised: of a stored log, or of samples that are sent."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"grasp_log": "7c9e6679742540de944be07fc1f90ae7"}, {"samples": SAMPLES_EXAMPLE}]
        },
    )

    grasp_log: Annotated[Reference | None, Field(max_length=32)] = None
    samples: SamplesIn | None = None
    materials: Annotated[
        list[Annotated[Reference, Field(max_length=100)]] | None,
        Field(min_length=1, max_length=100, description="Which it may be; without, all that have a model"),
    ] = None
    method: Annotated[
        FitMethod, Field(description="Whose current models are compared; `auto`: each material's recommended one")
    ] = "auto"
    unknown: Annotated[float, Field(ge=0.0, lt=1.0, description="Probability beforehand that it is none of them")] = (
        0.05
    )

    sensor: Annotated[
        Reference | None,
        Field(
            max_length=200,
            description="That grasped: its gain counts where a model knows it; without, a stored log's",
        ),
    ] = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.grasp_log is None) == (self.samples is None):
            raise ValueError("either grasp_log or samples")
        return self


class CandidateOut(BaseModel):
    """A material that it may be."""

    material: str
    method: Annotated[str, Field(description="Of the model that was compared")]
    version: Annotated[int, Field(description="Of the model that was compared")]
    probability: float
    support: SupportKind
    advice: Advice


class RecognitionOut(BaseModel):
    """How probable each material is, the likeliest first."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "method": "auto",
                    "candidates": [
                        {
                            "material": "paper",
                            "method": "hierarchical",
                            "version": 3,
                            "probability": 0.97,
                            "support": "supported",
                            "advice": "the samples determine the expected friction to within ± 3.1%",
                        }
                    ],
                    "unknown": 0.03,
                }
            ]
        }
    )

    method: str
    candidates: list[CandidateOut]
    unknown: Annotated[float, Field(description="Probability that it is none of them")]
