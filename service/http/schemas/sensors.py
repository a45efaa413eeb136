"""Sensors and the mechanics of their gels."""

from dataclasses import asdict
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.config import JsonDict

from db.records import Gel, Sensor
from service.http.schemas.common import Body

GEL_EXAMPLE: JsonDict = {"young_modulus": 2.5e5, "poisson_ratio": 0.48, "thickness": 4e-3, "marker_depth": 5e-4}
SENSOR_EXAMPLE: JsonDict = {"name": "GelSight Mini", "gel": GEL_EXAMPLE}


class GelIn(Body):
    """The mechanics of a sensor's gel."""

    model_config = ConfigDict(json_schema_extra={"examples": [GEL_EXAMPLE]})

    young_modulus: Annotated[float, Field(ge=1e2, le=1e12, allow_inf_nan=False, description="Pa")]
    poisson_ratio: Annotated[float, Field(ge=0.0, le=0.5)]
    thickness: Annotated[
        float | None,
        Field(ge=1e-6, le=1.0, description="m from the surface to the rigid base; null: thick against any contact"),
    ] = None
    marker_depth: Annotated[float, Field(ge=0.0, lt=1.0, description="m of the markers below the surface")] = 0.0

    @model_validator(mode="after")
    def _markers_lie_in_the_gel(self) -> "GelIn":
        if self.thickness is not None and self.marker_depth >= self.thickness:
            raise ValueError("marker_depth below the thickness")
        return self

    def record(self) -> Gel:
        """As it is stored."""
        return Gel(self.young_modulus, self.poisson_ratio, self.thickness, self.marker_depth)


class GelOut(BaseModel):
    """The mechanics of a sensor's gel."""

    model_config = ConfigDict(json_schema_extra={"examples": [GEL_EXAMPLE]})

    young_modulus: Annotated[float, Field(description="Pa")]
    poisson_ratio: float
    thickness: Annotated[float | None, Field(description="m from the surface to the rigid base; null: a half-space")]
    marker_depth: Annotated[float, Field(description="m of the markers below the surface")]


class SensorOut(BaseModel):
    """A sensor that logs come from, or that was described."""

    model_config = ConfigDict(json_schema_extra={"examples": [SENSOR_EXAMPLE]})

    name: str
    gel: Annotated[GelOut | None, Field(description="null where it was not described: no forces follow from it")]

    @classmethod
    def of(cls, sensor: Sensor) -> "SensorOut":
        """The stored sensor as an answer."""
        gel = None if sensor.gel is None else GelOut.model_validate(asdict(sensor.gel))
        return cls(name=sensor.name, gel=gel)


class SensorsOut(BaseModel):
    """All sensors, by name."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"items": [SENSOR_EXAMPLE]}]})

    items: list[SensorOut]
