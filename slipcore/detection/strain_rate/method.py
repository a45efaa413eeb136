"""The paper's method, corrected: extreme events of the signed strain rate, in physical time."""

import numpy as np

from slipcore.defaults import StrainRateOptions
from slipcore.detection.shared.interface import CompiledMethod, Start
from slipcore.detection.strain_rate.run import run_strain_rate
from slipcore.detection.strain_rate.step import NOISE, ROWS, StrainRateSettings
from slipcore.surface.strain import Lattice


def start(lattice: Lattice, options: StrainRateOptions) -> Start:
    """At rest."""
    elements = np.zeros((ROWS, *lattice.position.shape[:2]))
    elements[NOISE] = lattice.strain_noise
    values = [getattr(options, name) for name in StrainRateSettings._fields[:-1]]
    return Start(np.array([*values, lattice.strain_noise.mean()]), elements, np.zeros(0))


METHOD = CompiledMethod(StrainRateOptions, start, run_strain_rate)
