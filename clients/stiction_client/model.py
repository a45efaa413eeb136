"""The fitted friction model as the planner's side sees it; evaluated here, without the network."""

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stiction_client.errors import InvalidArgument
from stiction_client.support import OUTDATED, SUPERSEDED, Kind, Support, extrapolation, support, widening

FloatArray = NDArray[np.float64]

Number = float | FloatArray
"""One float, or an array of any shape that broadcasts with the others."""

KINDS = ("element", "contact")
"""Whose friction a quantile may be of."""

FILE_FORMAT, FILE_VERSION = "stiction-friction-model", 1


@dataclass(frozen=True, slots=True)
class Domain:
    """Range of the data behind a model: tangential velocity, m/s, and normal force of an element, N."""

    tangential_velocity: tuple[float, float]
    normal_force: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Scale:
    """A standard deviation as data tell it: ``value`` times a Student-t on ``degrees_of_freedom`` is what it draws."""

    value: float
    degrees_of_freedom: float

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "Scale":
        """The scale in the service's answer."""
        return cls(float(record["value"]), _freedom(record["degrees_of_freedom"]))

    def to_json(self) -> dict[str, float | None]:
        """What ``from_json`` reads."""
        return {"value": self.value, "degrees_of_freedom": _finite(self.degrees_of_freedom)}

    def quantile(self, level: Number) -> Number:
        """Quantile of one draw, in the shape of ``level``."""
        from scipy import special  # takes longer to import than all else of this package

        return cast(Number, self.value * special.stdtrit(self.degrees_of_freedom, level))


@dataclass(frozen=True, slots=True)
class Scales:
    """How friction scatters: ``between_grasps`` τ, as a part of friction itself; ``between_places`` ω of a grasp and
    ``within`` a place σ, as friction [-].
    """

    between_grasps: Scale
    between_places: Scale
    within: Scale

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "Scales":
        """The scales in the service's answer."""
        return cls(*(Scale.from_json(record[each.name]) for each in fields(cls)))

    def to_json(self) -> dict[str, dict[str, float | None]]:
        """What ``from_json`` reads."""
        return {each.name: getattr(self, each.name).to_json() for each in fields(self)}


@dataclass(frozen=True, slots=True)
class Cost:
    """What a fit cost: ``seconds``, and the Monte-Carlo error it left, in posterior standard deviations (0: exact)."""

    seconds: float
    monte_carlo_error: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class FrictionModel:
    """Friction ``μ = β₀ + β₁ v + β₂ f_n + ε`` of one material as fitted, with its uncertainty.

    ``coefficients`` [3]: β₀ [-], β₁ [s/m], β₂ [1/N]; ``covariance`` [3, 3] of them; ``scale``: standard deviation of
    ε [-]; ``n`` samples of elements of ``element_area`` m²; ``degrees_of_freedom`` of the Student-t distribution that
    the coefficients follow, ``scatter_degrees_of_freedom`` of that which ε/σ follows; ``identifiable`` [3] bool;
    ``scales`` of the scatter where the method tells them apart, when σ is all of it, as one element in a new grasp
    shows it; None also of a model that an older version stored; ``outdated``: the material's logs are others since.
    """

    material: str
    method: str
    version: int
    coefficients: FloatArray
    covariance: FloatArray
    scale: float
    n: int
    degrees_of_freedom: float
    scatter_degrees_of_freedom: float
    domain: Domain
    identifiable: NDArray[np.bool_]
    element_area: float
    cost: Cost
    current: bool = True
    diagnostics: Mapping[str, float | str | None] = field(default_factory=dict)
    created_at: str = ""
    scales: Scales | None = None
    outdated: bool = False

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "FrictionModel":
        """The model in the service's answer; degrees of freedom of null mean a normal distribution."""
        domain, cost = record["domain"], record["cost"]
        return cls(
            material=record["material"],
            method=record["method"],
            version=record["version"],
            coefficients=np.array(record["coefficients"], dtype=np.float64).reshape(3),
            covariance=np.array(record["covariance"], dtype=np.float64).reshape(3, 3),
            scale=float(record["scale"]),
            n=int(record["n"]),
            degrees_of_freedom=_freedom(record["degrees_of_freedom"]),
            scatter_degrees_of_freedom=_freedom(record["scatter_degrees_of_freedom"]),
            domain=Domain(_pair(domain["tangential_velocity"]), _pair(domain["normal_force"])),
            identifiable=np.array(record["identifiable"], dtype=np.bool_).reshape(3),
            element_area=float(record["element_area"]),
            cost=Cost(float(cost["seconds"]), float(cost["monte_carlo_error"])),
            current=bool(record["current"]),
            diagnostics=dict(record["diagnostics"]),
            created_at=record["created_at"],
            scales=None if record.get("scales") is None else Scales.from_json(record["scales"]),
            outdated=bool(record.get("outdated", False)),
        )

    def to_json(self) -> dict[str, Any]:
        """The model as the service tells it: what ``from_json`` reads."""
        return {
            "material": self.material,
            "method": self.method,
            "version": self.version,
            "coefficients": self.coefficients.tolist(),
            "covariance": self.covariance.tolist(),
            "scale": self.scale,
            "n": self.n,
            "degrees_of_freedom": _finite(self.degrees_of_freedom),
            "scatter_degrees_of_freedom": _finite(self.scatter_degrees_of_freedom),
            "domain": {
                "tangential_velocity": list(self.domain.tangential_velocity),
                "normal_force": list(self.domain.normal_force),
            },
            "identifiable": self.identifiable.tolist(),
            "element_area": self.element_area,
            "cost": {"seconds": self.cost.seconds, "monte_carlo_error": self.cost.monte_carlo_error},
            "current": self.current,
            "diagnostics": dict(self.diagnostics),
            "created_at": self.created_at,
            "scales": None if self.scales is None else self.scales.to_json(),
            "outdated": self.outdated,
        }

    def save(self, path: Path | str) -> None:
        """Write the model to a file, as a whole or not at all (docs/client.md has the schema)."""
        content = json.dumps({"format": FILE_FORMAT, "version": FILE_VERSION, "model": self.to_json()}, indent=1)
        target = Path(path)
        beside = target.with_name(f"{target.name}.{os.getpid()}.part")
        beside.write_text(content, encoding="utf-8")
        beside.replace(target)

    @classmethod
    def load(cls, path: Path | str) -> "FrictionModel":
        """The model in a file that ``save`` wrote; raises ``InvalidArgument`` for any other."""
        try:
            record = json.loads(Path(path).read_text(encoding="utf-8"))
            kind, version = record["format"], record["version"]
        except (ValueError, KeyError, TypeError) as error:
            raise InvalidArgument("file", path, f"one that FrictionModel.save wrote ({error})") from error
        if kind != FILE_FORMAT or version != FILE_VERSION:
            allowed = f"{FILE_FORMAT} of version {FILE_VERSION}; save it anew, or upgrade stiction-client"
            raise InvalidArgument("file", f"{path}, of {kind} version {version}", allowed)
        try:
            return cls.from_json(record["model"])
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InvalidArgument("file", path, f"a whole model (it lacks or garbles {error})") from error

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors of the coefficients, [3]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def interval(self, level: float = 0.95) -> FloatArray:
        """Central interval of each coefficient at ``level``: [3, 2]."""
        from scipy import special  # takes longer to import than all else of this package

        check_probability("level", level)
        half = special.stdtrit(self.degrees_of_freedom, 0.5 * (1.0 + level)) * self.standard_errors
        return np.stack([self.coefficients - half, self.coefficients + half], axis=1)

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
        stays, that between places and within them averages out. A model without ``scales`` takes all of its scatter
        as shared.

        The quantile includes the scatter and the uncertainty of the coefficients, whose distances from the mean add
        as root of squares (Graybill & Wang 1980), as in the service. Outside the data the ``widening`` adds in the same
        way (``support.BEND``). No quantile is below 0. Shapes broadcast. Raises ``InvalidArgument`` for a quantile
        outside (0, 1) and for a contact of no elements.
        """
        from scipy import special

        count = averaged_elements(of, elements)
        v, f_n = np.broadcast_arrays(np.asarray(tangential_velocity, float), np.asarray(normal_force, float))
        x = np.stack([np.ones_like(v), v, f_n], axis=-1)
        mean = x @ self.coefficients
        if quantile is None:
            return mean
        check_probability("quantile", quantile)
        error = np.sqrt(np.maximum(np.einsum("...i,ij,...j->...", x, self.covariance, x), 0.0))
        shared, own = self.scatter(quantile, count)
        scatter = np.hypot(shared * mean, own)
        uncertain = special.stdtrit(self.degrees_of_freedom, quantile) * error
        distance = np.hypot(np.hypot(scatter, uncertain), special.ndtri(quantile) * widening(self, v, f_n))
        return np.asarray(np.maximum(mean + np.sign(quantile - 0.5) * distance, 0.0))

    def scatter(self, quantile: Number, elements: Number = 1.0) -> tuple[Number, Number]:
        """How far scatter takes the mean over so many elements of a new grasp: a part of friction, and what adds [-].

        The two add as root of squares. Shapes broadcast.
        """
        from scipy import special

        if self.scales is None:
            return 0.0, cast(Number, special.stdtrit(self.scatter_degrees_of_freedom, quantile) * self.scale)
        place, within = self.scales.between_places.quantile(quantile), self.scales.within.quantile(quantile)
        own = ((place * place + within * within) / elements) ** 0.5
        return self.scales.between_grasps.quantile(quantile), own

    def extrapolation(self, tangential_velocity: float, normal_force: float) -> str | None:
        """Which of v (m/s) and f_n (N an element) lies outside the data behind the model; None where neither does.

        Slower than the data is not outside: slip is never observed at rest, and a grasp that holds is the limit v → 0.
        """
        return extrapolation(self.domain, tangential_velocity, normal_force)

    def support_at(self, tangential_velocity: float, normal_force: float) -> Support:
        """What the answer at v (m/s) and f_n (N an element) rests on, and what to do about it."""
        return support(self, tangential_velocity, normal_force, self.stale)

    @property
    def stale(self) -> str | None:
        """Why this is not the material's model any more; None while it is."""
        return OUTDATED if self.outdated else None if self.current else SUPERSEDED

    @property
    def support(self) -> Kind:
        """What answers rest on at rest and in the middle of the normal forces observed (``support_at``)."""
        return self.support_at(0.0, 0.5 * sum(self.domain.normal_force)).kind

    @property
    def advice(self) -> str:
        """What to do about it."""
        return self.support_at(0.0, 0.5 * sum(self.domain.normal_force)).advice


def check_probability(name: str, value: float) -> None:
    """Refuse what is not a probability strictly between 0 and 1."""
    if not 0.0 < value < 1.0:
        raise InvalidArgument(name, value, "above 0 and below 1")


def averaged_elements(of: str, elements: float | None) -> float:
    """Over how many elements the scatter of places averages out."""
    if of not in KINDS:
        raise InvalidArgument("of", of, " or ".join(KINDS))
    if of == "element":
        return 1.0
    if elements is None or not 1.0 <= elements < math.inf:
        raise InvalidArgument("elements", elements, "the number of elements of the contact, at least 1")
    return float(elements)


def _freedom(value: float | None) -> float:
    return math.inf if value is None else float(value)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _pair(values: Any) -> tuple[float, float]:
    low, high = values
    return float(low), float(high)
