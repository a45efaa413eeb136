"""Every default of sensor calibrations, with unit, valid range and source.

"Trials": chosen on closed-form presses other than those of the tests.
"""

from dataclasses import dataclass
from typing import Annotated

from slipcore.options import Option, Options


@dataclass(frozen=True, slots=True, kw_only=True)
class PressDefaults(Options):
    """Where in a log nothing touches, where a body presses, and what makes a press impure."""

    free_share: Annotated[float, Option(0.0, 0.5, "-", "a ball touches with 1 % of its depth at 0.1 % of its load")] = (
        0.01
    )
    """Share of the greatest level, of indentation or else of force, below which nothing touches."""
    free_noise: Annotated[float, Option(0.0, 100.0, "standard deviations", "one frame in 16 000")] = 4.0
    """The same, above the noise of that level."""
    guard: Annotated[int, Option(0, 1000, "frames", "filters of sensors smear a touch")] = 1
    """Frames beside contact that count as neither."""
    core_share: Annotated[float, Option(0.0, 1.0, "-", "the noise of a tenth of 400 elements is a sixth")] = 0.1
    """Share of the elements, those that move most, of which the level is the mean."""
    pressed_share: Annotated[float, Option(0.0, 1.0, "-", "forces are least certain at touch and release")] = 0.3
    """Least share of the greatest normal force of a frame that is pressed."""
    held_share: Annotated[float, Option(0.0, 1.0, "-", "a ball on a half-space: 98.5 % of its force")] = 0.99
    """Least share of the greatest level of a frame that is held."""
    footprint_share: Annotated[float, Option(0.0, 1.0, "-", "the rim, and what lies above 5 % noise")] = 0.05
    """Share of the largest normal force of an element from which it belongs to the footprint."""
    least_force_to_noise: Annotated[float, Option(0.0, 1e6, "-", "a ratio to 5 %")] = 20.0
    """Least normal force of a press over its noise."""
    sideways: Annotated[float, Option(0.0, 10.0, "-", "a ball on a bonded gel, off its middle: 0.02")] = 0.1
    """Most that the markers of the footprint may go sideways, or turn at its rim, as a share of the indentation."""
    load_change: Annotated[float, Option(0.0, 10.0, "-", "less shifts a friction coefficient of 0.5 by 10 %")] = 0.05
    """Most by which tangential load may stray from being proportional to the normal load, as a share of its largest."""
    stray_noise: Annotated[float, Option(0.0, 100.0, "standard deviations", "one press in 1000 of 300 frames")] = 5.0
    """The same, above its noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimateDefaults(Options):
    """From when a quantity counts as known."""

    confidence: Annotated[float, Option(0.5, 0.9999, "-", "customary")] = 0.95
    """Of intervals."""
    force_tolerance: Annotated[float, Option(1e-6, 1.0, "-", "usual of force sensors")] = 0.01
    """Standard deviation of a force that a gripper reports over it, where the log states none."""
    free_frames: Annotated[int, Option(2, 10_000, "frames", "a third of a second at 30 fps")] = 10
    """Least frames without contact from which an offset is known."""
    sideways_stiffness: Annotated[float, Option(0.0, 10.0, "-", "2(1 − ν)/(2 − ν) at ν ≈ ½ (Mindlin)")] = 0.67
    """Tangential over normal stiffness: what load a marker's sideways motion may stand for."""
    kernel_frames: Annotated[int, Option(4, 10_000, "frames", "three parameters")] = 8
    """Least frames of a growing contact from which a kernel's width is known."""
    kernel_force_to_noise: Annotated[float, Option(0.0, 1e6, "-", "biases a moment by its square: 4 %")] = 5.0
    """Least normal force of these over its noise."""
    kernel_shape_error: Annotated[float, Option(0.0, 1.0, "-", "lattices in contacts of few elements: trials")] = 0.02
    """By how much a second moment strays from a power of the force beside noise, as a share of it."""
    kernel_reach: Annotated[float, Option(1.0, 100.0, "standard deviations", "cuts 0.3 % off a Gaussian")] = 4.0
    """How far from its middle a smoothed contact is summed up."""
    kernel_passes: Annotated[int, Option(1, 100, "passes", "a third changes the width by less than 1 %")] = 3
    """Each takes its reach from the moments of the one before."""
    kernel_exponent: Annotated[float, Option(0.1, 2.0, "-", "a ball on a half-space (Hertz)")] = 0.6667
    """Of the contact's area over force, by which reaches are found."""
    kernel_force_range: Annotated[float, Option(0.0, 1.0, "-", "a third: extrapolated by as much again")] = 0.33
    """Largest smallest force of these, as a share of the greatest."""
    kernel_growth: Annotated[float, Option(0.0, 10.0, "-", "an eighth of what a ball's contact grows by")] = 0.1
    """Least growth of the footprint's second moment over its value."""
    kernel_margin: Annotated[int, Option(0, 100, "elements", "three standard deviations of one element")] = 3
    """How far around the footprint smoothed forces are summed up."""
    kernel_exponents: Annotated[int, Option(2, 1000, "exponents", "steps of 0.025")] = 11
    """How many exponents are tried between these."""
    kernel_exponent_low: Annotated[float, Option(0.1, 2.0, "-", "a ball on a thin bonded layer: ½")] = 0.5
    """Of the contact's area over force, at least."""
    kernel_exponent_high: Annotated[float, Option(0.1, 2.0, "-", "a ball on a half-space: ⅔")] = 0.75
    """The same, at most."""
    noise_series: Annotated[int, Option(1, 10_000, "elements", "a variance to 10 %")] = 16
    """Least elements of which noise is estimated."""
    noise_lags: Annotated[int, Option(3, 1000, "frames", "a second at 30 fps")] = 30
    """Longest lag of the variogram."""
    noise_share_of_frames: Annotated[float, Option(0.1, 1.0, "-", "each lag has as many pairs as the lag again")] = 0.5
    """The same, as a share of the frames."""
    noise_blocks: Annotated[int, Option(4, 1000, "blocks", "a standard error to 18 %")] = 16
    """Groups of elements that are left out in turn: their scatter shows how sure the noise is."""

    wide_kernel: Annotated[float, Option(0.0, 100.0, "elements", "turns a pivot's friction by 2 %")] = 0.5
    """Least width of a kernel that a detection is given."""


PRESS = PressDefaults()
ESTIMATE = EstimateDefaults()

TABLES = (PRESS, ESTIMATE)
"""All tables of sensor calibrations."""
