"""Westergaard: a surface with one sine wave pressed on a half-space, and partial slip on it (plane strain).

Source: Westergaard, J. Appl. Mech. 6 (1939) 49; Johnson, Contact Mechanics (1985), §13.2; partial slip by the theorem
of Ciavarella, J. Mech. Phys. Solids 46 (1998) 973 and Jäger: q = μ(p(p̄) − p(p̄ − q̄/μ)).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from slipcore.contact.reference.checks import check_range
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class WavyContact:
    """Wave of ``amplitude`` Δ and ``wavelength`` λ (m) on E* = ``contact_modulus`` (Pa), under ``mean_pressure`` (Pa).

    The undeformed gap is Δ(1 − cos 2πx/λ), with a crest at x = 0. ``friction`` μ > 0 and ``mean_traction`` Pa along +x,
    0 ≤ q̄ ≤ μp̄. At p* = πE*Δ/λ the surfaces touch everywhere. Raises ``InvalidInput``.
    """

    amplitude: float
    wavelength: float
    contact_modulus: float
    mean_pressure: float
    friction: float = 1.0
    mean_traction: float = 0.0

    def __post_init__(self) -> None:
        check_range("amplitude", self.amplitude, above=0.0, unit="m")
        check_range("wavelength", self.wavelength, above=0.0, unit="m")
        check_range("contact_modulus", self.contact_modulus, above=0.0, unit="Pa")
        check_range("mean_pressure", self.mean_pressure, at_least=0.0, unit="Pa")
        check_range("friction", self.friction, above=0.0)
        limit = self.friction * self.mean_pressure
        check_range("mean_traction", self.mean_traction, at_least=0.0, at_most=limit, unit="Pa")

    @property
    def full_contact_pressure(self) -> float:
        """Mean pressure p* that closes the last gap, πE*Δ/λ."""
        return np.pi * self.contact_modulus * self.amplitude / self.wavelength

    @property
    def half_width(self) -> float:
        """Half width a of each contact strip, sin²(πa/λ) = p̄/p*; λ/2 in full contact."""
        share = min(self.mean_pressure / self.full_contact_pressure, 1.0)
        return self.wavelength / np.pi * float(np.arcsin(np.sqrt(share)))

    @property
    def stick_half_width(self) -> float:
        """Half width c of the sticking strip: the contact's at the mean pressure p̄ − q̄/μ."""
        return self._stuck.half_width

    def pressure(self, x: ArrayLike) -> FloatArray:
        """Pressure in Pa: 2p* cos(πx/λ) √(p̄/p* − sin²(πx/λ)), and p̄ + p* cos(2πx/λ) from full contact on."""
        x, peak = np.asarray(x, float), self.full_contact_pressure
        phase = np.pi * x / self.wavelength
        if self.mean_pressure >= peak:
            return self.mean_pressure + peak * np.cos(2.0 * phase)
        root = np.sqrt(np.maximum(self.mean_pressure / peak - np.sin(phase) ** 2, 0.0))
        pressure: FloatArray = 2.0 * peak * np.abs(np.cos(phase)) * root
        return pressure

    def traction(self, x: ArrayLike) -> FloatArray:
        """Traction in Pa along +x: μp in slip, less in stick."""
        return self.friction * (self.pressure(x) - self._stuck.pressure(x))

    @property
    def _stuck(self) -> "WavyContact":
        rest = max(self.mean_pressure - self.mean_traction / self.friction, 0.0)
        return replace(self, mean_pressure=rest, mean_traction=0.0)
