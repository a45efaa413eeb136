"""Friction models, and the fits and look-ups that are asked of them."""

from datetime import datetime
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.config import JsonDict

from db.records import StoredModel
from estimators.method_names import FitMethod
from service.domain.models.stored_results import to_client_model
from service.domain.planning.look_up import Averaged, Friction, FrictionQuery
from service.http.schemas.common import MOMENT_EXAMPLE, Area, Body, Force, Next, Reference, Velocity

ChosenBecause = Annotated[str | None, Field(description="Why this model answers; null where a method was named")]

SupportKind = Annotated[
    Literal["supported", "extrapolated", "not identified", "stale", "implausible"],
    Field(description="What the answer rests on: the last of these that applies"),
]
Advice = Annotated[str, Field(description="What to do about it, in one sentence")]
GraspingSensor = Annotated[
    Reference | None,
    Field(
        min_length=1,
        max_length=200,
        description="That grasps: its own gain counts where the model knows it, else that of any",
    ),
]
Notes = Annotated[list[str], Field(description="What else is to be known of the model, in sentences")]

CHOSEN_EXAMPLE = "hierarchical: friction may scatter between grasps, between places and within them"

MODEL_EXAMPLE: JsonDict = {
    "material": "paper",
    "method": "ols",
    "version": 3,
    "current": True,
    "outdated": False,
    "coefficients": [0.41, -0.8, -0.35],
    "covariance": [[1.0e-5, 0.0, 0.0], [0.0, 1.0e-2, 0.0], [0.0, 0.0, 4.0e-3]],
    "scale": 0.021,
    "n": 5120,
    "degrees_of_freedom": 11.0,
    "scatter_degrees_of_freedom": 5117.0,
    "domain": {"tangential_velocity": [0.0, 0.004], "normal_force": [0.002, 0.11]},
    "identifiable": [True, True, False],
    "element_area": 1.0e-6,
    "diagnostics": {"r_squared": 0.31, "cluster_kind": "grasp"},
    "cost": {"seconds": 0.012, "monte_carlo_error": 0.0},
    "created_at": MOMENT_EXAMPLE,
    "scales": None,
    "support": "supported",
    "advice": "the samples determine the expected friction to within ± 2.3%",
    "notes": [],
}


class NewFit(Body):
    """A fit that is asked for."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"method": "bayes", "seed": 0}]})

    method: Annotated[FitMethod, Field(description="`auto` takes the one that the data call for")] = "auto"
    seed: Annotated[int, Field(ge=0, lt=2**32, description="Of the sampler: the same seed gives the same fit.")] = 0


class DomainOut(BaseModel):
    """Range of the samples behind a model."""

    tangential_velocity: Annotated[tuple[float, float], Field(description="m/s")]
    normal_force: Annotated[tuple[float, float], Field(description="N on an element")]


class CostOut(BaseModel):
    """What a fit cost."""

    seconds: float
    monte_carlo_error: Annotated[float, Field(description="In posterior standard deviations; 0 for an exact method.")]


class ScaleOut(BaseModel):
    """A standard deviation as the data determine it."""

    value: float
    degrees_of_freedom: Annotated[float | None, Field(description="Of the Student-t that it scales; null: normal")]


class SensorFrictionOut(BaseModel):
    """Friction as one sensor shows it: what differs from the model of all of them."""

    gain: Annotated[float, Field(description="By which part its friction exceeds the sensors' average")]
    standard_error: Annotated[float, Field(description="Of the gain")]
    coefficients: Annotated[list[float], Field(description="β₀ [-], β₁ [s/m], β₂ [1/N]")]
    covariance: Annotated[list[list[float]], Field(description="Of the coefficients, 3×3")]
    degrees_of_freedom: Annotated[float | None, Field(description="Of the coefficients' Student-t; null: normal")]
    scale: Annotated[float, Field(description="σ, standard deviation of ε [-]")]
    scatter_degrees_of_freedom: Annotated[float | None, Field(description="Of the scatter's Student-t; null: normal")]
    element_area: Annotated[
        float | None, Field(description="m² of its own elements, of which look-ups with `sensor` are; null: not known")
    ] = None


class SensorScaleOut(ScaleOut):
    """How much sensors differ, and what each of them shows."""

    sensors: Annotated[dict[str, SensorFrictionOut], Field(description="By name")]


class ScalesOut(BaseModel):
    """How friction scatters."""

    between_grasps: Annotated[ScaleOut, Field(description="As a part of friction itself")]
    between_places: Annotated[ScaleOut, Field(description="Of one grasp, as friction [-]")]
    within: Annotated[ScaleOut, Field(description="A place, as friction [-]")]
    between_sensors: Annotated[
        SensorScaleOut | None, Field(description="As a part of friction itself; null: all grasps are of one sensor")
    ] = None


class FrictionModelOut(BaseModel):
    """One version of a material's model μ = β₀ + β₁ v + β₂ f_n + ε."""

    model_config = ConfigDict(json_schema_extra={"examples": [MODEL_EXAMPLE]})

    material: str
    method: str
    version: int
    current: bool
    outdated: Annotated[bool, Field(description="The material's logs are others since, and it is not fitted to them")]
    coefficients: Annotated[list[float], Field(description="β₀ [-], β₁ [s/m], β₂ [1/N]")]
    covariance: Annotated[list[list[float]], Field(description="Of the coefficients, 3×3")]
    scale: Annotated[float, Field(description="σ, standard deviation of ε [-]")]
    n: Annotated[int, Field(description="Samples behind the model")]
    degrees_of_freedom: Annotated[float | None, Field(description="Of the coefficients' Student-t; null: normal")]
    scatter_degrees_of_freedom: Annotated[float | None, Field(description="Of the scatter's Student-t; null: normal")]
    domain: DomainOut
    identifiable: Annotated[list[bool], Field(description="Whether the data determine β₀, β₁, β₂")]
    element_area: Annotated[float, Field(description="m²")]
    diagnostics: dict[str, float | str | None]
    cost: CostOut
    created_at: datetime
    scales: Annotated[
        ScalesOut | None,
        Field(description="Of the scatter; null: the method does not separate them, or it was stored without them"),
    ] = None
    support: SupportKind = "supported"
    advice: Advice = ""
    notes: Notes = []

    @classmethod
    def of(cls, stored: StoredModel) -> "FrictionModelOut":
        """The stored model as an answer, with what it rests on at rest and in the middle of its normal forces."""
        model = to_client_model(stored)
        derived = {"support": model.support, "advice": model.advice, "notes": list(model.notes)}
        return cls.model_validate(model.to_json() | derived)


class FrictionModelsOut(BaseModel):
    """Versions of a material's models, newest first."""

    items: list[FrictionModelOut]
    next: Next


SMALLEST_TAIL = 1e-12
"""As the planner's smallest slip probability; a Student-t quantile further out says nothing of friction."""


class LookUpQuery(BaseModel):
    """What a look-up asks: the parameters of its address."""

    fn: Annotated[Force, Field(description="Normal force on an element, N", examples=[0.05])]
    v: Annotated[Velocity, Field(description="Tangential velocity, m/s", examples=[0.0])] = 0.0
    quantile: Annotated[
        float | None,
        Field(
            ge=SMALLEST_TAIL,
            le=1.0 - SMALLEST_TAIL,
            description="Of a new observation of μ; the mean without",
            examples=[0.05],
        ),
    ] = None
    method: Annotated[FitMethod, Field(description="Whose current model answers; `auto`: the recommended one")] = "auto"
    of: Annotated[
        Averaged | None,
        Field(description="Whose friction the quantile is of; the contact's where `elements` is given, else one's"),
    ] = None
    elements: Annotated[
        int | None, Field(ge=1, le=10**9, description="Elements of the contact, over which scatter averages out")
    ] = None
    sensor: GraspingSensor = None
    element_area: Annotated[
        Area | None, Field(description="m² of the element that `fn` and `elements` are of; without, the model's")
    ] = None

    @model_validator(mode="after")
    def _counted(self) -> Self:
        if self.of == "contact" and self.elements is None:
            raise ValueError("of=contact with the number of its elements")
        return self

    def averaged(self) -> tuple[Averaged, int]:
        """Whose friction is asked for, and over how many elements."""
        if self.elements is None or self.of == "element":
            return "element", 1
        return "contact", self.elements

    def question(self) -> FrictionQuery:
        """What the use case is asked."""
        return FrictionQuery(self.v, self.fn, self.quantile, *self.averaged(), self.sensor, self.element_area)


class NextGraspQuery(BaseModel):
    """Where friction is to be known, and what a probe bears: the parameters of the address."""

    fn: Annotated[Force | None, Field(gt=0.0, description="N on an element; without, the middle of the data")] = None
    v: Annotated[Velocity, Field(description="Tangential velocity, m/s")] = 0.0
    quantile: Annotated[float, Field(ge=SMALLEST_TAIL, lt=0.5, description="Of friction that a planner asks for")] = (
        1e-2
    )
    elements: Annotated[int, Field(ge=1, le=10**9, description="Elements of the planner's contact")] = 60
    method: Annotated[FitMethod, Field(description="Whose current model answers; `auto`: the recommended one")] = "auto"
    load: Annotated[float, Field(ge=0.0, le=1e6, description="N that the contact bears while it is probed")] = 0.0
    drop_probability: Annotated[float, Field(ge=1e-12, le=0.5, description="With which it may drop that load")] = 1e-3
    sensor: GraspingSensor = None


class NextGraspOut(BaseModel):
    """The grasp to record next."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "material": "paper",
                    "method": "hierarchical",
                    "version": 3,
                    "normal_force": 0.05,
                    "slip_length": 0.001,
                    "speed": 0.002,
                    "direction": 0.92,
                    "seconds": 4.5,
                    "uncertainty": 0.061,
                    "after": 0.043,
                    "conservative_friction": 0.31,
                    "beyond": None,
                    "support": "not identified",
                    "advice": "the expected friction is known to within ± 15% only: record more grasps",
                    "notes": [],
                }
            ]
        }
    )

    material: str
    method: str
    version: int
    normal_force: Annotated[float, Field(description="Mean of the contact's elements, N")]
    slip_length: Annotated[float, Field(description="m")]
    speed: Annotated[float, Field(description="Of the slip, m/s")]
    direction: Annotated[float, Field(description="Of the slip, rad; directions are spread evenly")]
    seconds: Annotated[float, Field(description="That the grasp takes")]
    uncertainty: Annotated[float, Field(description="Half-width of the 95 % interval of the expected friction now")]
    after: Annotated[float, Field(description="The same as it is expected after the grasp")]
    conservative_friction: Annotated[float, Field(description="The quantile at the working point now")]
    beyond: Annotated[str | None, Field(description="That it presses harder than any grasp so far; null where not")]
    support: SupportKind
    advice: Advice
    notes: Notes


class FrictionOut(BaseModel):
    """Friction coefficient of a material at a tangential velocity and an element's normal force."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "material": "paper",
                    "method": "hierarchical",
                    "version": 3,
                    "chosen_because": CHOSEN_EXAMPLE,
                    "tangential_velocity": 0.0,
                    "normal_force": 0.05,
                    "element_area": 1e-6,
                    "quantile": 0.05,
                    "of": "element",
                    "elements": 1,
                    "friction_coefficient": 0.36,
                    "mean": 0.39,
                    "within_domain": True,
                    "warning": None,
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
    tangential_velocity: Annotated[float, Field(description="m/s")]
    normal_force: Annotated[float, Field(description="N on an element")]
    element_area: Annotated[float, Field(description="Of that element, m²")]
    quantile: float | None
    of: Annotated[Averaged, Field(description="Whose friction the quantile is of")] = "element"
    elements: Annotated[int, Field(description="Over how many elements its scatter averages out")] = 1
    friction_coefficient: Annotated[
        float, Field(description="The quantile that was asked for; without one, the mean, or 0")
    ]
    mean: Annotated[
        float,
        Field(description="Of the linear law, which falls below 0, where no friction is, far outside of the data"),
    ]
    within_domain: Annotated[bool, Field(description="Whether the model's samples reach there")]
    warning: str | None
    support: SupportKind
    advice: Advice
    notes: Notes

    @classmethod
    def json_of(cls, friction: Friction) -> str:
        """What was looked up as an answer's body."""
        return cls(**friction._asdict()).model_dump_json()
