"""Sensors, the mechanics of their gels, and their calibrations."""

from dataclasses import asdict
from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.config import JsonDict

from db.records import Calibration, CalibrationPress, Gel, Sensor
from service.http.schemas.common import MOMENT_EXAMPLE, Body, Next, Reference
from slipcore.defaults import LIMITS

GEL_EXAMPLE: JsonDict = {
    "young_modulus": 2.5e5,
    "poisson_ratio": 0.48,
    "thickness": 4e-3,
    "marker_depth": 5e-4,
    "relative_thickness": None,
}
SENSOR_EXAMPLE: JsonDict = {"name": "GelSight Mini", "gel": GEL_EXAMPLE, "calibration": None}
PRESS_EXAMPLE: JsonDict = {"grasp_log": "7c9e6679742540de944be07fc1f90ae7", "known_force": 2.0}
ESTIMATE_EXAMPLE: JsonDict = {
    "name": "crosstalk_x",
    "unit": "-",
    "value": 0.08,
    "low": 0.077,
    "high": 0.083,
    "not_identified": None,
}
CALIBRATION_EXAMPLE: JsonDict = {
    "version": 1,
    "created_at": MOMENT_EXAMPLE,
    "created_by": None,
    "presses": [PRESS_EXAMPLE],
    "grid": [20, 20],
    "element_area": 1e-6,
    "frame_interval": 0.033,
    "estimates": [ESTIMATE_EXAMPLE],
}


ThicknessRow = Annotated[list[Annotated[float, Field(ge=0.25, le=4.0)]], Field(min_length=2, max_length=64)]
UNEVEN = "Of a gel that is not alike thick everywhere: at each marker, row by row, over `thickness`; null: alike"


class GelIn(Body):
    """The mechanics of a sensor's gel."""

    model_config = ConfigDict(json_schema_extra={"examples": [GEL_EXAMPLE]})

    young_modulus: Annotated[float, Field(ge=1e2, le=1e12, allow_inf_nan=False, description="Pa")]
    poisson_ratio: Annotated[float, Field(ge=0.0, le=0.5)]
    thickness: Annotated[
        float | None,
        Field(
            ge=1e-6,
            le=1.0,
            description="m from the surface to the rigid base, at least a tenth of the distance between markers "
            "(checked here where the sensor has logs, and else with its first log); null: thick against any contact",
        ),
    ] = None
    marker_depth: Annotated[float, Field(ge=0.0, lt=1.0, description="m of the markers below the surface")] = 0.0
    relative_thickness: Annotated[
        list[ThicknessRow] | None,
        Field(min_length=2, max_length=64, description=UNEVEN),
    ] = None

    @model_validator(mode="after")
    def _map_is_a_lattice(self) -> "GelIn":
        if self.relative_thickness is None:
            return self
        if self.thickness is None or len({len(row) for row in self.relative_thickness}) > 1:
            raise ValueError("relative_thickness of rows alike, and a thickness beside it")
        if self.marker_depth >= self.thickness * min(map(min, self.relative_thickness)):
            raise ValueError("marker_depth below the thickness everywhere")
        return self

    @model_validator(mode="after")
    def _markers_lie_in_the_gel(self) -> "GelIn":
        if self.thickness is not None and self.marker_depth >= self.thickness:
            raise ValueError("marker_depth below the thickness")
        return self

    def record(self) -> Gel:
        """As it is stored."""
        return Gel(self.young_modulus, self.poisson_ratio, self.thickness, self.marker_depth, self.relative_thickness)


class GelOut(BaseModel):
    """The mechanics of a sensor's gel."""

    model_config = ConfigDict(json_schema_extra={"examples": [GEL_EXAMPLE]})

    young_modulus: Annotated[float, Field(description="Pa")]
    poisson_ratio: float
    thickness: Annotated[float | None, Field(description="m from the surface to the rigid base; null: a half-space")]
    marker_depth: Annotated[float, Field(description="m of the markers below the surface")]
    relative_thickness: Annotated[list[list[float]] | None, Field(description=UNEVEN)]


class SensorOut(BaseModel):
    """A sensor that logs come from, or that was described."""

    model_config = ConfigDict(json_schema_extra={"examples": [SENSOR_EXAMPLE]})

    name: str
    gel: Annotated[GelOut | None, Field(description="null where it was not described: no forces follow from it")]
    calibration: Annotated[int | None, Field(description="Newest version; null where it was never calibrated")]

    @classmethod
    def of(cls, sensor: Sensor) -> "SensorOut":
        """The stored sensor as an answer."""
        gel = None if sensor.gel is None else GelOut.model_validate(asdict(sensor.gel))
        return cls(name=sensor.name, gel=gel, calibration=sensor.calibration)


class SensorsOut(BaseModel):
    """Sensors, by name."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"items": [SENSOR_EXAMPLE], "next": None}]})

    items: list[SensorOut]
    next: Next


class PressIn(Body):
    """A stored log of a body that was pressed straight down on the sensor, and lifted."""

    model_config = ConfigDict(json_schema_extra={"examples": [PRESS_EXAMPLE]})

    grasp_log: Annotated[Reference, Field(max_length=100, description="Its id; it is of this sensor")]
    known_force: Annotated[
        float | None,
        Field(ge=LIMITS.press[0], le=LIMITS.press[1], allow_inf_nan=False, description="Normal force of the press, N"),
    ] = None

    def record(self) -> CalibrationPress:
        """As it is stored."""
        return CalibrationPress(self.grasp_log, self.known_force)


class NewCalibrationIn(Body):
    """By which presses a sensor is to be calibrated."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"presses": [PRESS_EXAMPLE]}]})

    presses: Annotated[list[PressIn], Field(min_length=1, max_length=32)]


class PressOut(BaseModel):
    """A log that a sensor was calibrated by."""

    model_config = ConfigDict(json_schema_extra={"examples": [PRESS_EXAMPLE]})

    grasp_log: str
    known_force: Annotated[float | None, Field(description="N")]


class EstimateOut(BaseModel):
    """A quantity of a sensor with its 95 % interval; all null where it is not identified."""

    model_config = ConfigDict(json_schema_extra={"examples": [ESTIMATE_EXAMPLE]})

    name: Annotated[str, Field(description="As docs/sensors.md explains it")]
    unit: str
    value: float | None
    low: float | None
    high: float | None
    not_identified: Annotated[
        str | None, Field(description="Why it does not follow from these presses; null where it does")
    ]


class CalibrationOut(BaseModel):
    """A version of what is known of a sensor's faults."""

    model_config = ConfigDict(json_schema_extra={"examples": [CALIBRATION_EXAMPLE]})

    version: int
    created_at: datetime
    created_by: Annotated[str | None, Field(description="Id of the access key with which it was asked for")]
    presses: list[PressOut]
    grid: Annotated[tuple[int, int], Field(description="Elements along the two axes")]
    element_area: Annotated[float, Field(description="m²")]
    frame_interval: Annotated[float, Field(description="s, to which the noise's correlation belongs")]
    estimates: list[EstimateOut]

    @classmethod
    def of(cls, stored: Calibration) -> "CalibrationOut":
        """The stored version as an answer."""
        model = stored.new.model
        return cls(
            version=stored.version,
            created_at=stored.created_at,
            created_by=stored.new.created_by,
            presses=[PressOut(**asdict(press)) for press in stored.new.presses],
            estimates=[EstimateOut(**each) for each in model["estimates"]],
            **{name: model[name] for name in ("grid", "element_area", "frame_interval")},
        )


class CalibrationsOut(BaseModel):
    """Versions of a sensor's calibration, newest first."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"items": [CALIBRATION_EXAMPLE], "next": None}]})

    items: list[CalibrationOut]
    next: Next
