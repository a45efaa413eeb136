"""The detection methods, one algorithm a file, by name."""

from typing import Any

from slipcore.detection.baselines import (
    deformation_gradient,
    force_ratio,
    local_deformation,
    rigid_fit,
    strain_threshold,
)
from slipcore.detection.coarse import method as coarse
from slipcore.detection.filter import method as probability_filter
from slipcore.detection.forces_only import method as forces_only
from slipcore.detection.shared.interface import CompiledMethod, Method
from slipcore.detection.strain_rate import literal
from slipcore.detection.strain_rate import method as strain_rate
from slipcore.errors import InvalidInput
from slipcore.finding import Finding
from slipcore.frames import FloatArray

METHODS: dict[str, Method[Any, Any] | CompiledMethod[Any]] = {
    "filter": probability_filter.METHOD,
    "strain_rate": strain_rate.METHOD,
    "strain_rate_literal": literal.METHOD,
    "rigid_fit": rigid_fit.METHOD,
    "local_deformation": local_deformation.METHOD,
    "deformation_gradient": deformation_gradient.METHOD,
    "force_ratio": force_ratio.METHOD,
    "strain_threshold": strain_threshold.METHOD,
    "forces_only": forces_only.METHOD,
    "coarse": coarse.METHOD,
}
"""A further method joins by a file of its own, or a room if it has several, and a line here."""


def findings_by(name: str, common: FloatArray, noise: float, of_method: Any = None) -> tuple[Finding, ...]:
    """What the method of that name found inconsistent, from its memory's ``common``, or from its own state.

    ``noise``: estimated standard deviation of one marker coordinate, m; NaN where it is unknown.
    """
    method = find_method(name)
    if method.findings is None:
        return ()
    return method.findings(common if isinstance(method, CompiledMethod) else of_method, noise)


def find_method(name: str) -> Method[Any, Any] | CompiledMethod[Any]:
    """The method of that name; raises ``InvalidInput`` listing those that exist."""
    try:
        return METHODS[name]
    except (KeyError, TypeError):
        raise InvalidInput("method", name, ", ".join(METHODS)) from None
