"""The mathematics of ``μ = β₀ + β₁ v + β₂ f_n + ε``: one home for whoever has fitted it and whoever plans with it."""

import difflib
import math
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stiction_client import json_values
from stiction_client.arguments import number, shown, within
from stiction_client.elementwise import FloatArray, Number, special, student_quantile
from stiction_client.errors import InvalidArgument
from stiction_client.support import (
    ONLY_SENSOR,
    UNKNOWN_SENSOR,
    UNNAMED_SENSOR,
    Domain,
    Kind,
    Support,
    extrapolation,
    notes,
    support,
    widening,
)

if TYPE_CHECKING:
    from stiction_client.labelled import DataFrame, Dataset, Row

VELOCITIES, FORCES = (0.0, 1e3, "m/s, as a magnitude"), (0.0, 1e300, "N an element")
"""At which velocities and normal forces a model may be asked: least, greatest, unit."""

KINDS = ("element", "contact")
"""Whose friction a quantile may be of."""


@dataclass(frozen=True, slots=True)
class Scale:
    """A standard deviation as estimated: ``value`` times a Student-t on ``degrees_of_freedom`` is what it draws."""

    value: float
    degrees_of_freedom: float

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "Scale":
        """The scale in the service's answer."""
        return cls(
            json_values.number("value", record["value"], least=0.0),
            json_values.degrees_of_freedom(record["degrees_of_freedom"]),
        )

    def to_json(self) -> dict[str, float | None]:
        """What ``from_json`` reads."""
        return {"value": self.value, "degrees_of_freedom": degrees_to_json(self.degrees_of_freedom)}

    def quantile(self, level: Number) -> Number:
        """Quantile of one draw, in the shape of ``level``."""
        return self.value * student_quantile(self.degrees_of_freedom, level)


@dataclass(frozen=True, slots=True)
class SensorFriction:
    """Friction as one known sensor shows it: by which part its ratio of forces exceeds the sensors' average, ``gain``
    with its ``standard_error``; the other fields are those of a model of this sensor alone, new grasps of it.
    ``element_area``: m² of its own elements, whatever those of the model are; None where an older version fitted it.
    """

    gain: float
    standard_error: float
    coefficients: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    degrees_of_freedom: float
    scale: float
    scatter_degrees_of_freedom: float
    element_area: float | None = None

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "SensorFriction":
        """The sensor in the service's answer."""
        area = record.get("element_area")
        return cls(
            json_values.number("gain", record["gain"]),
            json_values.number("standard_error", record["standard_error"], least=0.0),
            tuple(json_values.coefficients(record["coefficients"]).tolist()),
            tuple(tuple(row) for row in json_values.covariance(record["covariance"]).tolist()),
            json_values.degrees_of_freedom(record["degrees_of_freedom"]),
            json_values.number("scale", record["scale"], least=0.0),
            json_values.degrees_of_freedom(record["scatter_degrees_of_freedom"]),
            None if area is None else json_values.number("element_area", area, above=0.0),
        )

    def enlarged(self, part: float) -> "SensorFriction":
        """The same for an element ``part`` times as large."""
        coefficients, covariance = _rescaled(np.array(self.coefficients), np.array(self.covariance), part)
        return replace(
            self,
            coefficients=tuple(coefficients.tolist()),
            covariance=tuple(map(tuple, covariance.tolist())),
            scale=self.scale / math.sqrt(part),
        )

    def to_json(self) -> dict[str, Any]:
        """What ``from_json`` reads."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        if self.element_area is None:
            del values["element_area"]
        degrees = ("degrees_of_freedom", "scatter_degrees_of_freedom")
        lists = {"coefficients": list(self.coefficients), "covariance": [list(row) for row in self.covariance]}
        return values | lists | {name: degrees_to_json(values[name]) for name in degrees}


@dataclass(frozen=True, slots=True)
class SensorScale:
    """How much sensors differ in the friction that they show, as a part of it, and what each known one of the
    ``sensors`` shows, by name.
    """

    scale: Scale
    sensors: Mapping[str, SensorFriction]

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "SensorScale":
        """The scale and the sensors in the service's answer."""
        sensors = {name: SensorFriction.from_json(each) for name, each in record["sensors"].items()}
        return cls(Scale.from_json(record), sensors)

    def to_json(self) -> dict[str, Any]:
        """What ``from_json`` reads."""
        return {**self.scale.to_json(), "sensors": {name: each.to_json() for name, each in self.sensors.items()}}


@dataclass(frozen=True, slots=True)
class Scales:
    """How friction scatters: ``between_grasps`` τ, as a part of friction itself; ``between_places`` ω of a grasp and
    ``within`` a place σ, as friction [-]; ``between_sensors``, as a part of friction, where grasps are of several.
    """

    between_grasps: Scale
    between_places: Scale
    within: Scale
    between_sensors: SensorScale | None = None

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "Scales":
        """The scales in the service's answer."""
        sensors = record.get("between_sensors")
        each = (Scale.from_json(record[name]) for name in ("between_grasps", "between_places", "within"))
        grasps, places, within = each
        return cls(grasps, places, within, None if sensors is None else SensorScale.from_json(sensors))

    def enlarged(self, part: float) -> "Scales":
        """The same for an element ``part`` times as large, over which what differs from place to place averages out."""
        places, within = (
            replace(each, value=each.value / math.sqrt(part)) for each in (self.between_places, self.within)
        )
        known = self.between_sensors
        if known is not None:
            sensors = {name: sensor.enlarged(part) for name, sensor in known.sensors.items()}
            known = replace(known, sensors=sensors)
        return Scales(self.between_grasps, places, within, known)

    def to_json(self) -> dict[str, Any]:
        """What ``from_json`` reads; without ``between_sensors`` where grasps are of one."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: scale.to_json() for name, scale in values.items() if scale is not None}


class LinearFriction:
    """What a fitted model answers, from fields that the records of it have, each with more of its own.

    Bad arguments raise ``refusal``, which takes the thing's name, its value and what is allowed.
    """

    __slots__ = ()

    refusal: ClassVar[type[ValueError]] = InvalidArgument
    velocities: ClassVar[tuple[float, float, str]] = VELOCITIES

    method: str
    n: int
    coefficients: FloatArray
    covariance: FloatArray
    scale: float
    degrees_of_freedom: float
    scatter_degrees_of_freedom: float
    domain: Domain
    element_area: float
    identifiable: NDArray[np.bool_]
    diagnostics: Mapping[str, Any]
    scales: Scales | None

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors of the coefficients, [3]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def interval(self, level: float = 0.95) -> FloatArray:
        """Central interval of each coefficient at ``level``: [3, 2]."""
        self._check_probability("level", level)
        half = student_quantile(self.degrees_of_freedom, 0.5 * (1.0 + level)) * self.standard_errors
        return np.stack([self.coefficients - half, self.coefficients + half], axis=1)

    def scale_interval(self, level: float = 0.95) -> tuple[float, float]:
        """Central interval of σ at ``level``, by the χ² distribution of its estimate."""
        self._check_probability("level", level)
        freedom = self.scatter_degrees_of_freedom
        if math.isinf(freedom):
            return self.scale, self.scale
        tails = 0.5 * (1.0 - level), 0.5 * (1.0 + level)
        low, high = (self.scale * math.sqrt(freedom / special().chdtri(freedom, tail)) for tail in tails)
        return low, high

    def predict(
        self,
        tangential_velocity: ArrayLike,
        normal_force: ArrayLike,
        quantile: float | None = None,
        of: str = "element",
        elements: float | None = None,
    ) -> FloatArray:
        """Friction coefficient expected at v (m/s) and f_n (N an element), or a quantile of what a new grasp shows.

        ``of``: one "element", or a "contact", whose friction is the mean over its ``elements``: scatter between grasps
        stays, and that between sensors where grasps are of several (``of_sensor``: of one that is known); that between
        places and within them averages out. A model without ``scales`` takes all of its scatter
        as shared.

        The quantile includes the scatter and the uncertainty of the coefficients, whose distances from the mean add
        as root of squares (Graybill & Wang 1980): exact where all have the same degrees of freedom, and not too narrow
        in the tails where some have less. Outside the data the ``widening`` adds in the same way (``support.BEND``). No
        quantile is below 0. Shapes broadcast. Raises ``refusal`` for what is no velocity or force, a quantile outside
        (0, 1) and a contact of no elements.
        """
        count = self._averaged_elements(of, elements)
        v, f_n = np.broadcast_arrays(*self._point(tangential_velocity, normal_force))
        x = np.stack([np.ones_like(v), v, f_n], axis=-1)
        mean = x @ self.coefficients
        if quantile is None:
            return mean
        self._check_probability("quantile", quantile)
        error = np.sqrt(np.maximum(np.einsum("...i,ij,...j->...", x, self.covariance, x), 0.0))
        shared, own = self.scatter(quantile, count)
        scatter = np.hypot(shared * mean, own)
        uncertain = student_quantile(self.degrees_of_freedom, quantile) * error
        distance = np.hypot(np.hypot(scatter, uncertain), student_quantile(math.inf, quantile) * widening(self, v, f_n))
        return np.asarray(np.maximum(mean + np.sign(quantile - 0.5) * distance, 0.0))

    def scatter(self, quantile: Number, elements: Number = 1.0) -> tuple[Number, Number]:
        """How far scatter takes the mean over so many elements of a new grasp: a part of friction, and what adds [-].

        The two add as root of squares. Shapes broadcast.
        """
        if self.scales is None:
            return 0.0, student_quantile(self.scatter_degrees_of_freedom, quantile) * self.scale
        place, within = self.scales.between_places.quantile(quantile), self.scales.within.quantile(quantile)
        own = ((place * place + within * within) / elements) ** 0.5
        shared, sensors = self.scales.between_grasps.quantile(quantile), self.scales.between_sensors
        if sensors is not None:
            gain = sensors.scale.quantile(quantile)
            shared = cast(Number, (shared * shared + gain * gain) ** 0.5)
        return shared, own

    def of_sensor(self, name: str) -> Self:
        """The model of friction as the sensor of this name shows it, its own gain in the coefficients.

        Where all grasps are of this sensor, the model itself. Of a sensor of which it has no grasp too, but for a note
        that says whether its quantiles allow for the gain of any sensor; and where nobody noted which sensors its
        grasps are of, or its method does not separate them.
        """
        if not isinstance(name, str):
            raise self.refusal("name", shown(name), "the name of a sensor")
        scales = self.scales
        if scales is None or scales.between_sensors is None:
            return self if name == self.diagnostics.get(ONLY_SENSOR) else self._of_no_known_gain(name)
        if name not in scales.between_sensors.sensors:
            known = f"no grasp of it is by a sensor {name!r}{_near(name, scales.between_sensors.sensors)}"
            return self._noting(f"{known}: the answer allows for the gain of any sensor")
        sensor = scales.between_sensors.sensors[name]
        return replace(  # type: ignore[type-var]  # every model is a record
            self,
            coefficients=np.array(sensor.coefficients),
            covariance=np.array(sensor.covariance),
            degrees_of_freedom=sensor.degrees_of_freedom,
            scale=sensor.scale,
            scatter_degrees_of_freedom=sensor.scatter_degrees_of_freedom,
            scales=replace(scales, between_sensors=None),
        )

    def on_sensor(self, name: str) -> Self:
        """What ``of_sensor`` gives, with forces on an element of that sensor's own, where its area is known."""
        known = None if self.scales is None or self.scales.between_sensors is None else self.scales.between_sensors
        own = None if known is None or name not in known.sensors else known.sensors[name].element_area
        model = self.of_sensor(name)
        return model if own is None or own == model.element_area else model.at_element_area(own)

    def at_element_area(self, area: float) -> Self:
        """The same friction with forces on an element of ``area`` m²: under the same pressure it bears in proportion
        to its area, and what scatters from place to place averages out over it.

        Raises ``refusal`` for an area that is not finite and above 0.
        """
        area = self._number("area", area, sys.float_info.min, "above 0 m²")
        part, (low, high) = area / self.element_area, self.domain.normal_force
        coefficients, covariance = _rescaled(self.coefficients, self.covariance, part)
        return replace(  # type: ignore[type-var]  # every model is a record
            self,
            coefficients=coefficients,
            covariance=covariance,
            scale=self.scale / math.sqrt(part),
            domain=replace(self.domain, normal_force=(low * part, high * part)),
            scales=None if self.scales is None else self.scales.enlarged(part),
            element_area=area,
        )

    def _of_no_known_gain(self, name: str) -> Self:
        """Of a model that separates no sensors, as another sensor than its own shows it."""
        only = self.diagnostics.get(ONLY_SENSOR)
        if only is None:
            known = "this fit does not separate the sensors of its grasps"
        elif only == UNNAMED_SENSOR:
            known = f"no grasp of it names its sensor, so that none is known to be by {name!r}"
        else:
            known = f"all grasps of it are by a sensor {only!r}, none by {name!r}{_near(name, [str(only)])}"
        return self._noting(f"{known}: the answer does not allow for the gain of another sensor")

    def _noting(self, note: str) -> Self:
        return replace(self, diagnostics={**self.diagnostics, UNKNOWN_SENSOR: note})  # type: ignore[type-var]

    def extrapolation(self, tangential_velocity: float, normal_force: float) -> str | None:
        """Which of v (m/s) and f_n (N an element) lies outside the data behind the model; None where neither does.

        Slower than the data is not outside where these show how velocity changes friction: slip is never observed at
        rest, and a grasp that holds is the limit v → 0.
        """
        self._point(tangential_velocity, normal_force, number)
        return extrapolation(self, tangential_velocity, normal_force)

    @property
    def subject(self) -> str:
        """Whose friction it is, as messages name it."""
        return "the surface"

    @property
    def stale(self) -> str | None:
        """Why this is not its material's model any more; None while it is, and where nobody can know."""
        return None

    def support_at(self, tangential_velocity: float, normal_force: float, stale: str | None = None) -> Support:
        """What the answer at v (m/s) and f_n (N an element) rests on, and what to do about it.

        ``stale``: why the model is not its material's any more, where the caller knows it and the model does not.
        """
        self._point(tangential_velocity, normal_force, number)
        return support(self, tangential_velocity, normal_force, stale or self.stale)

    @property
    def support(self) -> Kind:
        """What answers rest on at rest and in the middle of the normal forces observed (``support_at``)."""
        return self.support_at(0.0, 0.5 * sum(self.domain.normal_force)).kind

    @property
    def advice(self) -> str:
        """What to do about it."""
        return self.support_at(0.0, 0.5 * sum(self.domain.normal_force)).advice

    @property
    def notes(self) -> tuple[str, ...]:
        """What else is to be known of the model, in sentences: such as whether its sensors differ."""
        return notes(self.diagnostics)

    def to_dataframe(self) -> "DataFrame":
        """A row for each coefficient and σ: unit, estimate, standard error, 95 % interval, if the data show it.

        Raises ``ModuleNotFoundError`` where pandas is not installed.
        """
        from stiction_client.labelled import coefficient_table

        return coefficient_table(self._rows(), method=self.method, samples=self.n)

    def to_xarray(self) -> "Dataset":
        """Coefficients and covariance with their names; raises ``ModuleNotFoundError`` where xarray is missing."""
        from stiction_client.labelled import coefficient_dataset

        shown = self.coefficients, self.covariance, self.identifiable, self.scale
        return coefficient_dataset(*shown, method=self.method, samples=self.n)

    def _repr_html_(self) -> str:
        from stiction_client.labelled import coefficient_html

        title = f"Friction model by {self.method}, of {self.n} samples"
        return coefficient_html(title, self._rows(), f"{self.support}: {self.advice}")

    def _rows(self) -> "list[Row]":
        """What a table shows of each coefficient and of σ."""
        bounds = [*self.interval(0.95).tolist(), list(self.scale_interval(0.95))]
        values, identifiable = [*self.coefficients.tolist(), self.scale], [*self.identifiable.tolist(), True]
        errors = [*self.standard_errors.tolist(), self.scale / math.sqrt(2.0 * self.scatter_degrees_of_freedom)]
        return [(*each[:2], *each[2], each[3]) for each in zip(values, errors, bounds, identifiable, strict=True)]

    def _point(
        self, tangential_velocity: ArrayLike, normal_force: ArrayLike, check: Callable[..., Number] = within
    ) -> tuple[Number, Number]:
        """Velocity, m/s, and normal force, N an element, at which friction is asked for.

        ``check``: ``within`` takes arrays, ``number`` only one number of each. Raises ``refusal`` outside their ranges.
        """
        try:
            velocity = check("tangential_velocity", tangential_velocity, *self.velocities)
            return velocity, check("normal_force", normal_force, *FORCES)
        except InvalidArgument as error:
            raise self.refusal(error.name, error.value, error.allowed) from None

    def _check_probability(self, name: str, value: float) -> None:
        if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not 0.0 < value < 1.0:
            raise self.refusal(name, value, "above 0 and below 1")

    def _averaged_elements(self, of: str, elements: float | None) -> float:
        """Over how many elements the scatter of places averages out."""
        if not isinstance(of, str) or of not in KINDS:
            raise self.refusal("of", of, " or ".join(KINDS))
        if of == "element":
            return 1.0
        return self._number("elements", elements, 1.0, "the number of elements of the contact, at least 1")

    def _number(self, name: str, value: object, least: float, allowed: str) -> float:
        """A finite number of ``least`` or more; raises ``refusal`` for any other value."""
        try:
            return number(name, value, least, sys.float_info.max)
        except InvalidArgument as error:
            raise self.refusal(name, error.value, allowed) from None


def check_model(model: object, name: str = "model") -> None:
    """Raises ``InvalidArgument``, with the argument's ``name``, for a value that is no fitted model."""
    if not isinstance(model, LinearFriction):
        allowed = "a FrictionModel, as FrictionClient.model(name) gives it, FrictionModel.load, or estimators.fit"
        raise InvalidArgument(name, shown(model), allowed)


def _near(name: str, known: Iterable[str]) -> str:
    """A question after the known name that this one may be meant for, if it is like any."""
    return "".join(f" (did you mean {each!r}?)" for each in difflib.get_close_matches(name, known, n=1))


def degrees_to_json(value: float) -> float | None:
    """What ``json_values.degrees_of_freedom`` reads."""
    return value if math.isfinite(value) else None


def _rescaled(coefficients: FloatArray, covariance: FloatArray, part: float) -> tuple[FloatArray, FloatArray]:
    """β [3] and its covariance [3, 3] with forces on an element ``part`` times as large."""
    unit = np.array([1.0, 1.0, 1.0 / part])
    return coefficients * unit, covariance * np.outer(unit, unit)
