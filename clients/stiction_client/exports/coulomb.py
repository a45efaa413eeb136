"""Friction as one conservative number, and as a cone."""

import math
from typing import TypedDict, Unpack

import numpy as np

from stiction_client.arguments import number, shown, whole
from stiction_client.contacts import AREAS
from stiction_client.elementwise import FloatArray
from stiction_client.errors import InvalidArgument
from stiction_client.linear_friction import FORCES, VELOCITIES, LinearFriction, check_model

QUANTILE = 0.05
"""Default: nineteen observations of twenty have more friction."""


FINGERTIP = 6e-5
"""m²; contact of a fingertip under some newtons."""

MOST_EDGES = 100_000
"""Of a linearised cone, which then lacks 5·10⁻¹⁰ of μ."""


class Terms(TypedDict, total=False):
    """On what terms friction is given: the ``contact_area`` m² over whose elements scatter averages out (a fingertip's
    unless given), and whether to ``allow_unidentified`` friction.
    """

    contact_area: float
    allow_unidentified: bool


def conservative_friction(
    model: LinearFriction,
    normal_force: float,
    quantile: float = QUANTILE,
    *,
    tangential_velocity: float = 0.0,
    contact_area: float = FINGERTIP,
    allow_unidentified: bool = False,
) -> float:
    """Quantile of a contact's μ at ``normal_force`` N an element and ``tangential_velocity`` m/s, as one number.

    It is that of the mean over the elements of ``contact_area`` m², where the model has ``scales``; without them
    all scatter counts as common to the elements. Raises ``InvalidArgument`` for a quantile above ½, where the quantile
    of μ isn't positive, and for friction that is not determined or implausible: pass
    ``allow_unidentified`` to have the quantile anyway.
    """
    check_model(model)
    v, f_n = (
        number("tangential_velocity", tangential_velocity, *VELOCITIES),
        number("normal_force", normal_force, *FORCES),
    )
    if isinstance(quantile, bool) or not isinstance(quantile, float | int | np.number) or not 0.0 < quantile <= 0.5:
        raise InvalidArgument("quantile", shown(quantile), "above 0, at most 0.5: a bound from below")
    elements = max(number("contact_area", contact_area, *AREAS, "m²") / model.element_area, 1.0)
    support = model.support_at(v, f_n)
    if not allow_unidentified and support.kind in ("not identified", "implausible"):
        allowed = "supported, or allow_unidentified=True"
        raise InvalidArgument(f"friction of {model.subject}", f"{support.kind} ({support.advice})", allowed)
    friction = float(model.predict(v, f_n, quantile, of="contact", elements=elements))
    if not 0.0 < friction < math.inf:
        where = f"quantile {quantile:g}, {f_n:g} N an element and {v:g} m/s"
        raise InvalidArgument(f"friction coefficient at {where}", f"{friction:.4g}", "above 0")
    return friction


def friction_cone(
    model: LinearFriction, normal_force: float, quantile: float = QUANTILE, *, edges: int = 8, **terms: Unpack[Terms]
) -> FloatArray:
    """Edges of a linearised friction cone, [edges, 3]: (f_x, f_y, f_z) with f_z = 1 along the contact normal.

    Their non-negative combinations lie inside the cone |f_t| ≤ μ f_n (an inner approximation, hence conservative);
    between two edges it loses at most the part 1 − cos(π/edges) of μ.
    """
    count = whole("edges", edges, 3, MOST_EDGES)
    friction = conservative_friction(model, normal_force, quantile, **terms)
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.stack([friction * np.cos(angle), friction * np.sin(angle), np.ones(count)], axis=-1)


def cone_half_angle(
    model: LinearFriction, normal_force: float, quantile: float = QUANTILE, **terms: Unpack[Terms]
) -> float:
    """Angle between the contact normal and the edge of the friction cone, rad; ``normal_force`` N an element."""
    return math.atan(conservative_friction(model, normal_force, quantile, **terms))
