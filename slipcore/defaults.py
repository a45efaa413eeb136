"""Every default of slipcore, with unit, source and valid range."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """What a tactile recording in SI units can plausibly be; outside, the units are almost surely wrong."""

    min_frames: int = 2
    """A rate needs two frames."""
    position: float = 1.0
    """m; a fingertip sensor's frame lies within the sensor."""
    extent: tuple[float, float] = (1e-4, 0.5)
    """m; from a MEMS array to a tactile floor tile. Millimetres taken for metres fall outside."""
    displacement: float = 0.1
    """m; no gel moves further."""
    force: float = 1e4
    """N on one element."""
    element_area: tuple[float, float] = (1e-12, 1e-2)
    """m²; 1 µm to 100 mm pitch."""
    median_interval: tuple[float, float] = (1e-6, 60.0)
    """s; 1 MHz down to one frame a minute. A longer single gap is allowed."""
    yaw: float = 1e3
    """rad, cumulative."""
    normal_length: float = 1e-3
    """Largest deviation of a unit normal's length from 1; float32 and rounding in files stay below."""


LIMITS = Limits()
