"""What a detector found in a grasp log, over time."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic.config import JsonDict

SAMPLES_EXAMPLE: JsonDict = {
    "friction_coefficient": [0.41],
    "tangential_velocity": [0.0012],
    "normal_force": [0.05],
    "tangential_force": [0.0205],
    "time": [2.133],
    "element": [190],
    "weight": [0.97],
    "kind": ["element"],
    "velocity_is_relative": [False],
    "element_area": 1.0e-6,
}


class StickRatioOut(BaseModel):
    """Stick area over contact area, over time."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"time": [0.0, 0.033, 0.067], "stick_ratio": [None, 1.0, 0.93]}]}
    )

    time: Annotated[list[float], Field(description="s")]
    stick_ratio: Annotated[list[float | None], Field(description="null without contact")]


class EventsOfOneKind(BaseModel):
    """Events in order of time."""

    element: Annotated[list[int], Field(description="Row-major index on the lattice")]
    time: Annotated[list[float], Field(description="s")]


class EventsOut(BaseModel):
    """Slip onset and end, contact touch and release."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "onset": {"element": [189, 190], "time": [2.1, 2.133]},
                    "end": {"element": [], "time": []},
                    "touch": {"element": [189, 190], "time": [0.5, 0.5]},
                    "release": {"element": [], "time": []},
                }
            ]
        }
    )

    onset: EventsOfOneKind
    end: EventsOfOneKind
    touch: EventsOfOneKind
    release: EventsOfOneKind


class SamplesOut(BaseModel):
    """Friction samples of a log, one entry an element and frame."""

    model_config = ConfigDict(json_schema_extra={"examples": [SAMPLES_EXAMPLE]})

    friction_coefficient: list[float]
    tangential_velocity: Annotated[list[float], Field(description="m/s")]
    normal_force: Annotated[list[float], Field(description="N on the element")]
    tangential_force: Annotated[list[float], Field(description="N on the element")]
    time: Annotated[list[float], Field(description="s")]
    element: Annotated[list[int], Field(description="Row-major index on the lattice")]
    weight: Annotated[list[float], Field(description="Probability that the element did slip")]
    kind: Annotated[list[str], Field(description="`element`, or `contact` of a patch that slid or pivoted as a whole")]
    velocity_is_relative: Annotated[
        list[bool],
        Field(description="Whether the velocity is relative to what seems to stick: the object's is unknown"),
    ]
    element_area: Annotated[float, Field(description="m²")]
