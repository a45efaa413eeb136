"""The fitted friction model as the planner's side sees it; evaluated here, without the network."""

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction_client import json_values
from stiction_client.arguments import of_kind
from stiction_client.elementwise import FloatArray
from stiction_client.errors import InvalidArgument
from stiction_client.linear_friction import (
    LinearFriction,
    Scales,
    check_model,
    degrees_to_json,
)
from stiction_client.support import CHOSEN_BECAUSE, OUTDATED, SUPERSEDED, Domain

FILE_FORMAT, FILE_VERSION = "stiction-friction-model", 1


@dataclass(frozen=True, slots=True)
class Cost:
    """What a fit cost: ``seconds``, and the Monte-Carlo error it left, in posterior standard deviations (0: exact)."""

    seconds: float
    monte_carlo_error: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class FrictionModel(LinearFriction):
    """Friction ``μ = β₀ + β₁ v + β₂ f_n + ε`` of one material as fitted, with its uncertainty.

    ``coefficients`` [3]: β₀ [-], β₁ [s/m], β₂ [1/N]; ``covariance`` [3, 3] of them; ``scale``: standard deviation of
    ε [-]; ``n`` samples of elements of ``element_area`` m²; ``degrees_of_freedom`` of the Student-t distribution that
    the coefficients follow, ``scatter_degrees_of_freedom`` of that which ε/σ follows; ``identifiable`` [3] bool;
    ``scales`` of the scatter where the method separates them, when σ is all of it, as one element in a new grasp
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
    def of(cls, fitted: LinearFriction, material: str, version: int = 1) -> "FrictionModel":
        """What ``estimators.fit`` gave, as a model of a ``material``, which can be saved and has its name.

        Diagnostics that are no finite numbers, which JSON does not have, are None.
        """
        check_model(fitted, "fitted")
        of_kind("material", material, str)
        shared = {each.name: getattr(fitted, each.name) for each in fields(cls) if hasattr(fitted, each.name)}
        finite = {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in fitted.diagnostics.items()
        }
        return cls(**shared | {"diagnostics": finite, "material": material, "version": version})

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "FrictionModel":
        """The model in the service's answer; degrees of freedom of null mean a normal distribution.

        Raises ``ValueError`` for what no fit gives: text or ``true`` for a number, a negative variance, a part missing.
        """
        try:
            return cls._read(record)
        except (KeyError, TypeError, AttributeError) as error:
            shown = f"one that lacks or garbles {error}"
            raise InvalidArgument("record", shown, "what to_json and the service give of a model") from error

    @classmethod
    def _read(cls, record: Mapping[str, Any]) -> "FrictionModel":
        domain, cost = record["domain"], record["cost"]
        identifiable = [json_values.truth("identifiable", each) for each in record["identifiable"]]
        return cls(
            material=json_values.text("material", record["material"]),
            method=json_values.text("method", record["method"]),
            version=json_values.whole("version", record["version"], least=1),
            coefficients=json_values.coefficients(record["coefficients"]),
            covariance=json_values.covariance(record["covariance"]),
            scale=json_values.number("scale", record["scale"], least=0.0),
            n=json_values.whole("n", record["n"], least=1),
            degrees_of_freedom=json_values.degrees_of_freedom(record["degrees_of_freedom"]),
            scatter_degrees_of_freedom=json_values.degrees_of_freedom(record["scatter_degrees_of_freedom"]),
            domain=Domain(*(json_values.span(name, domain[name]) for name in ("tangential_velocity", "normal_force"))),
            identifiable=np.array(identifiable).reshape(3),
            element_area=json_values.number("element_area", record["element_area"], above=0.0),
            cost=Cost(*(json_values.number(name, cost[name], least=0.0) for name in ("seconds", "monte_carlo_error"))),
            current=json_values.truth("current", record["current"]),
            diagnostics=dict(record["diagnostics"]),
            created_at=json_values.text("created_at", record["created_at"]),
            scales=None if record.get("scales") is None else Scales.from_json(record["scales"]),
            outdated=json_values.truth("outdated", record.get("outdated", False)),
        )

    def to_json(self) -> dict[str, Any]:
        """The model as the service gives it: what ``from_json`` reads."""
        return {
            "material": self.material,
            "method": self.method,
            "version": self.version,
            "coefficients": self.coefficients.tolist(),
            "covariance": self.covariance.tolist(),
            "scale": self.scale,
            "n": self.n,
            "degrees_of_freedom": degrees_to_json(self.degrees_of_freedom),
            "scatter_degrees_of_freedom": degrees_to_json(self.scatter_degrees_of_freedom),
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
        try:
            beside.write_text(content, encoding="utf-8")
            beside.replace(target)
        finally:  # of what could not be put in place nothing stays
            beside.unlink(missing_ok=True)

    @classmethod
    def load(cls, path: Path | str) -> "FrictionModel":
        """The model in a file that ``save`` wrote; raises ``InvalidArgument`` for any other."""
        try:
            record = json.loads(Path(path).read_text(encoding="utf-8"), object_pairs_hook=json_values.members)
            kind, version = record["format"], record["version"]
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise InvalidArgument("file", path, f"one that FrictionModel.save wrote ({error})") from error
        if kind != FILE_FORMAT or isinstance(version, bool) or version != FILE_VERSION:
            allowed = f"{FILE_FORMAT} of version {FILE_VERSION}; save it anew, or upgrade stiction-client"
            raise InvalidArgument("file", f"{path}, of {kind} version {version}", allowed)
        try:
            return cls._read(record["model"])
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InvalidArgument("file", path, f"a whole model (it lacks or garbles {error})") from error

    @property
    def subject(self) -> str:
        """The material's name, quoted."""
        return repr(self.material)

    @property
    def chosen_because(self) -> str | None:
        """Why this model answers who names no method, in a sentence; None where it is not known."""
        told = self.diagnostics.get(CHOSEN_BECAUSE)
        return None if told is None else str(told)

    @property
    def stale(self) -> str | None:
        """Why this is not the material's model any more; None while it is."""
        return OUTDATED if self.outdated else None if self.current else SUPERSEDED
