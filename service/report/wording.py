"""Sentences and tables that describe a model, the same on every page."""

from collections.abc import Iterable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from service.formatting import interval, number
from service.report.page import Fact, Table
from slipcore.finding import severity_of
from stiction_client.linear_friction import LinearFriction
from stiction_client.support import Support

COEFFICIENTS = (
    ("β₀", "friction at rest and without load", "no unit"),
    ("β₁", "change of friction with velocity", "per metre a second (s/m)"),
    ("β₂", "change of friction with the normal force on an element", "per newton (1/N)"),
)

LEVELS = (0.05, 0.95)
"""Quantiles between which 90 % of new observations are expected."""

NEWEST_LOGS = 100
"""Of a material listed in its report, at most."""

STICK_RATIO = (
    "The stick ratio is the share of the elements in contact that stick: 1 while all of them do, 0 in gross slip."
)

MODEL = (
    "μ = β₀ + β₁ v + β₂ fₙ + ε. β₀ is friction at rest and without load, β₁ [s/m] its change with the velocity v of "
    "the slip, β₂ [1/N] that with the normal force fₙ on an element, and σ the standard deviation of the scatter ε. "
    "† marks a coefficient that the data do not determine: outside of their range it means nothing."
)


class Probe(Protocol):
    """A grasp that is worth recording."""

    @property
    def normal_force(self) -> float:
        """N an element."""

    @property
    def slip_length(self) -> float:
        """In m."""

    @property
    def speed(self) -> float:
        """In m/s."""

    @property
    def uncertainty(self) -> float:
        """Half-width of the 95 % interval of friction now."""

    @property
    def after(self) -> float:
        """The same with this grasp."""

    @property
    def beyond(self) -> str | None:
        """A sentence where it presses harder than any grasp so far."""


def record_next(probe: Probe) -> str:
    """What to record next, and what that is good for."""
    return (
        f"Record next: press with {number(probe.normal_force)} N on an element and let it slip by "
        f"{number(probe.slip_length * 1e3)} mm at {number(probe.speed * 1e3)} mm/s. The expected friction, known to "
        f"± {number(probe.uncertainty)}, is then known to ± {number(probe.after)}."
        f"{f' Mind: {probe.beyond}.' if probe.beyond else ''}"
    )


def expected_friction(
    model: LinearFriction, tangential_velocity: ArrayLike, normal_force: ArrayLike
) -> NDArray[np.float64]:
    """The law's mean as a line or plane is drawn: 0 where it falls below, far outside of the data."""
    return np.maximum(model.predict(tangential_velocity, normal_force), 0.0)


def friction_facts(model: LinearFriction) -> tuple[list[Fact], Support]:
    """Friction of an element at rest, in the middle of the normal forces observed, and what that rests on."""
    force = 0.5 * sum(model.domain.normal_force)
    band = [float(model.predict(0.0, force, quantile=level)) for level in LEVELS]
    facts = [
        Fact(f"Friction coefficient μ, at {number(force)} N an element", number(float(model.predict(0.0, force)))),
        Fact("90 % of new observations", interval(band)),
    ]
    return facts, model.support_at(0.0, force)


def coefficient_table(models: Mapping[str, LinearFriction]) -> Table:
    """Coefficients and σ of each model with 95 % intervals; which velocities are unknown, what came from others."""
    rows = [[name, *estimates(model), str(model.n)] for name, model in models.items()]
    remarks = ("unknown_velocity", "scatter_prior")
    notes = {str(model.diagnostics.get(name) or "") for model in models.values() for name in remarks} - {""}
    notes |= {note for model in models.values() for note in model.notes}
    caption = "; ".join(["Estimates and 95 % intervals", *sorted(notes)])
    return Table(caption, ("method", "β₀ [-]", "β₁ [s/m]", "β₂ [1/N]", "σ [-]", "samples"), rows)


def findings_heading(names: Iterable[str]) -> str:
    """What findings of these names are about: only a warning makes friction doubtful."""
    is_doubtful = any(severity_of(name) == "warning" for name in names)
    return "What makes its friction doubtful" if is_doubtful else "What limits its friction"


def estimates(model: LinearFriction) -> list[str]:
    """Each coefficient and σ with its 95 % interval."""
    bounds = zip(model.coefficients, model.interval(0.95), model.identifiable, strict=True)
    cells = [f"{number(value)} ({interval(ends)}){'' if known else ' †'}" for value, ends, known in bounds]
    return [*cells, f"{number(model.scale)} ({interval(model.scale_interval(0.95))})"]
