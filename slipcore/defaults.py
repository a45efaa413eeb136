"""Every default of slipcore, with unit, source and valid range."""

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, TypeVar

from slipcore.errors import InvalidInput
from slipcore.options import Option, Options, describe_options


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
    gripper_force: float = 1e4
    """N in all."""
    gripper_deviation: float = 1e-6
    """N; no gripper knows its force any better, nor reports a smaller one."""
    gripper_pull: float = 0.1
    """N; a gripper's zero is no further off. A larger pull than any press has a turned sign."""
    press: tuple[float, float] = (1e-6, 1e4)
    """N in all with which a body is pressed on a sensor to calibrate it."""
    element_area: tuple[float, float] = (1e-12, 1e-2)
    """m²; 1 µm to 100 mm pitch."""
    median_interval: tuple[float, float] = (1e-6, 60.0)
    """s; 1 MHz down to one frame a minute. A longer single gap is allowed."""
    span: float = 1e9
    """s from the first frame to the last; thirty years. A clock that was set meanwhile shows more."""
    clock: float = 1e12
    """s; times in ms or µs since 1970 lie within, but have the wrong interval."""
    yaw: float = 1e3
    """rad, cumulative."""
    normal_length: float = 1e-3
    """Largest deviation of a unit normal's length from 1; float32 and rounding in files stay below."""
    coincidence: float = 1e-6
    """Rows and columns of markers that enclose less than this angle, rad, are in one line."""
    inclination: float = 10.0
    """Largest factor 1/(ẑ·n): a face steeper than 84° is not measured by markers seen along z."""


LIMITS = Limits()


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseDefaults(Options):
    """The online estimate of measurement noise."""

    memory: Annotated[int, Option(1, 10_000, "frames", "a second at 30 fps: a burst of motion is outvoted")] = 31
    """Whose estimates are kept."""
    series: Annotated[int, Option(4, 100_000, "elements", "a frame then errs by 10 %, the median by 2 %")] = 64
    """That are looked at at most, evenly chosen."""
    least_series: Annotated[int, Option(2, 1000, "elements", "a median of fewer is one of them")] = 4
    """That must have changed for a frame to count as evidence."""
    least_inner: Annotated[int, Option(1, 1_000_000, "elements", "fields bend from marker to marker on 10 × 10")] = 225
    """With neighbours all around, from which these show noise that lasts."""
    least_step: Annotated[float, Option(0.0, 1e-3, "m", "digits of files, and rounding of floats")] = 1e-9
    """By so much a place may miss a multiple of the step in which places are given."""
    finest_step: Annotated[float, Option(0.0, 1e-3, "m", "a third of it is less than any camera's noise")] = 2e-8
    """No finer one is distinguished from none."""
    field_bend: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes: 0.003 around the rim of a cup")] = 0.004
    """How much of its size a field of displacement may bend by without noise."""
    stale_time: Annotated[float, Option(0.0, 1e3, "s", "forces at 3 Hz beside markers at 30 fps repeat for 0.3 s")] = (
        0.5
    )
    """From which on noisy forces are not believed that stay the same to the last bit while markers move."""
    stale_deviations: Annotated[float, Option(0.0, 100.0, "standard deviations", "one in 10⁶ of white noise")] = 5.0
    """By which a sum over all markers must have changed meanwhile for these to have moved."""
    lasting_told: Annotated[
        float, Option(0.0, 1e-3, "m", "fields of tuning scenes without noise bend by up to 1.7 µm")
    ] = 2e-6
    """Noise that lasts from frame to frame from which a finding reports it; less may be the field's own bends."""
    lags: Annotated[int, Option(3, 1000, "lags", "half of the last one more each")] = 8
    """Numbers of frames over which noise is compared to see how long it lasts."""
    memories: Annotated[int, Option(10, 10_000, "values", "steps of 5 %, refined")] = 19
    """Correlations from frame to frame that are tried between 0 and 1."""
    least_memory: Annotated[float, Option(0.0, 1.0, "-", "shorter noise is seen as well in three frames")] = 0.3
    """Correlation of noise from frame to frame above which it counts as lasting."""
    longest_memory: Annotated[float, Option(0.1, 100.0, "-", "of noise that lasts longer too few values are seen")] = (
        1.0
    )
    """Longest time constant of noise, over the time within which it is looked at."""
    step_levels: Annotated[int, Option(2, 1000, "-", "two are multiples of their distance, by chance")] = 3
    """Different places from which they may be multiples of a step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SmoothingDefaults(Options):
    """How widely a sensor smooths its fields (``surface/smoothing.py``)."""

    reach: Annotated[float, Option(1.0, 100.0, "standard deviations", "beyond it a Gaussian is 3e-4 of its peak")] = 4.0
    """To which the kernel is reckoned."""
    frequencies: Annotated[int, Option(8, 1_000_000, "-", "integrals to 1e-6")] = 513
    """At which integrals are taken."""
    frames: Annotated[int, Option(1, 1_000_000, "frames", "the median then errs by 2 %")] = 64
    """Looked at, evenly chosen."""
    least_frames: Annotated[int, Option(3, 1_000_000, "frames", "a median of ten")] = 12
    """Of a recording whose smoothing is estimated."""
    least_elements: Annotated[int, Option(1, 1_000_000, "elements", "as many as noise is estimated from")] = 64
    """With neighbours all around."""
    least_noise: Annotated[float, Option(0.0, 1e-3, "m", "motion that changes its speed bends as little")] = 1e-7
    """Of markers, from which it shows how they are smoothed."""
    least_force_noise: Annotated[float, Option(0.0, 1.0, "N", "as above, of forces")] = 1e-4
    """The same of forces."""
    largest_still: Annotated[float, Option(0.0, 1.0, "-", "5 % of markers may freeze")] = 0.1
    """Share of readings that may lie on the line through their neighbours in time: others are rounded."""
    whole: Annotated[float, Option(0.0, 1.0, "-", "white noise: 0.97 to 1.03")] = 0.85
    """Bend of noise, over that of white noise, from which it is not smoothed."""
    widest: Annotated[float, Option(0.1, 100.0, "elements", "0.2 % of a field's finest waves is left")] = 1.6
    """No wider kernel is made undone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ContradictionDefaults(Options):
    """When forces of a whole log do not go with its displacement (``detection/contradicting_forces.py``)."""

    least_frames: Annotated[int, Option(3, 1_000_000, "frames", "fewer hold no press")] = 12
    """Of a log that is looked at."""
    least_step: Annotated[float, Option(1e-6, 1.0, "s", "finer than any lag that matters")] = 1.0 / 60.0
    """In which sums are compared, whatever the frame rate."""
    most_steps: Annotated[float, Option(1.0, 1e3, "-", "half of the frames dropped, and a little")] = 4.0
    """For each frame; a log with more is mostly gaps."""
    longest_lag: Annotated[float, Option(0.0, 60.0, "s", "two clocks are further apart, or not at all")] = 1.0
    """By which forces may be late."""
    largest_noise: Annotated[float, Option(0.0, 1.0, "-", "stiffness comes out smaller by as much")] = 0.1
    """Share of the change of displacement that is noise, in steps by which crosstalk is sought."""
    largest_likeness: Annotated[float, Option(0.0, 1.0, "-", "above 0.9 in a press at a slant")] = 0.5
    """Squared correlation of displacement along the surface with normal force, above which it is not sought."""
    as_good: Annotated[float, Option(0.0, 1.0, "-", "0.17 on a scene with late forces; under a periodic load 0")] = 0.1
    """Of forces' change, by which what another lag leaves unexplained must be more."""
    coarsening: Annotated[float, Option(1.01, 10.0, "-", "a few tries from a frame to a second")] = 1.5
    """By which steps become longer until it is no more."""
    largest_rim: Annotated[float, Option(0.0, 1.0, "-", "a contact cut to half bears 0.2 there")] = 0.1
    """Share of normal forces on the outer elements from which on the contact leaves the lattice."""
    largest_left: Annotated[float, Option(0.0, 1.0, "-", "0.21 at most on tuning scenes with late forces")] = 0.3
    """Share of the change of forces that displacement may leave unexplained once a lag is taken out."""
    clearly: Annotated[float, Option(0.0, 1.0, "-", "0.3 at most with a fault on tuning scenes, 0.95 without")] = 0.5
    """Of what is unexplained, the most that taking out a lag or crosstalk may leave."""
    least_explained: Annotated[float, Option(0.0, 1.0, "-", "0.12 at least with a fault on tuning scenes")] = 0.05
    """Of the change of forces, the least that taking out a lag or crosstalk must explain."""
    least_crosstalk: Annotated[float, Option(0.0, 1.0, "-", "normals that err by 3°; less costs nothing")] = 0.05
    """From which on it is taken out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TurningDefaults(Options):
    """When forces without normals turn with the surface (``surface/turning.py``)."""

    least_share: Annotated[float, Option(0.0, 1.0, "-", "0.6 in presses on a half-space with ν = 0.4, of friction")] = (
        0.7
    )
    """λ from which on they turn."""
    band: Annotated[float, Option(0.0, 1.0, "-", "about what λ changes by in a grasp")] = 0.1
    """By which it must fall below that before a stream takes them not to turn any more."""
    coupling: Annotated[float, Option(0.0, 10.0, "-", "ν of 0.3 to 0.49, layers from 2.5 mm: 0.8 to 1.9 do")] = 1.5
    """By how much of what a load changes in λ this is carried on."""
    least_load: Annotated[float, Option(1e-3, 1.0, "-", "well below friction, well above noise of sums")] = 0.1
    """Tangential load over normal force, about which λ under load becomes known."""
    deviations: Annotated[float, Option(0.0, 100.0, "-", "recordings, whose forces ring; 10 is 3 σ")] = 20.0
    """Of noise of the forces, by which λ must lie above the least share."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReconstructedForcesDefaults(Options):
    """How method "filter" takes forces that follow from displacement (``detection/reconstructed_forces.py``)."""

    ratio_weight: Annotated[
        float, Option(0.0, 10.0, "-", "5 loads, 3 gels, 2 lattices, 0 to 10 µm; errors of frames are not independent")
    ] = 0.5
    """Weight of the log-odds from their ratio."""
    heading_length: Annotated[float, Option(0.0, 1.0, "m", "as above: 2 to 10 µm")] = 5e-6
    """Motion of the object within which it is known which way it moves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NumericsDefaults(Options):
    """What keeps the filter's numbers finite (``detection/filter``)."""

    least_spread: Annotated[float, Option(0.0, 1e-12, "m²", "far below a marker's variance")] = 1e-30
    """Weighted spread of points about their centre."""
    least_element_force: Annotated[float, Option(1e-15, 1e-3, "N", "far below what any sensor resolves")] = 1e-9
    """By which forces are divided (``detection/forces_only``)."""
    least_lever: Annotated[float, Option(1e-12, 1e-3, "m", "far below a pitch")] = 1e-9
    """Of the moment of a contact's forces."""
    slip_limits: Annotated[int, Option(2, 32, "-", "steps of 65 %; with twelve F1 differs by 0.001")] = 8
    """How many limits of slip are considered (``detection/filter/slip_limit.py``)."""
    surest_limit: Annotated[float, Option(0.1, 10.0, "log-odds", "2 %: more is bounded anyhow")] = 4.0
    """Most that one of them says of an element."""
    least_ratio: Annotated[float, Option(1e-12, 1e-3, "-", "far below any of them")] = 1e-6
    """Of motion to depth, of which a logarithm is taken."""
    stretch_variance: Annotated[float, Option(0.0, 1e-4, "-", "rounding of a fit of many points")] = 1e-14
    """Allowed beside what linear theory of a rotation makes."""
    yaw_variance: Annotated[float, Option(0.0, 1e-4, "rad²", "rounding of a fit of many points")] = 1e-16
    """The same of a given pose's yaw."""
    open_yaw: Annotated[float, Option(1.0, 1e3, "-", "what sticks is a third as wide as the contact")] = 10.0
    """Variance by yaw over that by place, from which on a fit leaves the yaw open; 1 where all sticks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerDefaults(Options):
    """How markers that lie anywhere are laid onto a lattice (``markers.py``)."""

    reach: Annotated[float, Option(1.0, 10.0, "pitches", "about twelve markers")] = 2.0
    """A lost marker moves on as those do that lie within so many mean distances."""
    neighbours: Annotated[int, Option(1, 100, "markers", "all within that reach on a square lattice")] = 12
    candidates: Annotated[int, Option(1, 100, "markers", "more would lie farther than a cell's diagonal")] = 8
    """Nearest markers among which an element finds its own."""
    farthest: Annotated[float, Option(0.5, 2.0, "pitches", "half a cell's diagonal, and a little")] = 0.75
    """An element's own marker from its place."""
    sparsest: Annotated[int, Option(1, 10_000, "places", "a disk in its box has 1.3, a ring a few")] = 16
    """Of the bounding box to one marker, at most."""
    narrowest: Annotated[float, Option(1e-3, 1.0, "-", "6°: strain is ten times as noisy")] = 0.1
    """Sine of the angle between rows and columns; where markers cross them more narrowly, one is left out."""
    touching_share: Annotated[float, Option(0.1, 0.95, "-", "tuning scenes: best F1 that loses 0.03 inside")] = 0.65
    """Of the frame's largest motion, above which a marker that is seen in the plane only is taken to touch."""
    touching_quantile: Annotated[float, Option(0.5, 1.0, "-", "8 of 400 markers may be tracked wrongly")] = 0.98
    """Of the markers' motion, which stands for the largest."""
    touching_noise: Annotated[float, Option(0.0, 100.0, "noises", "one of 400 markers in 10⁵ frames")] = 5.0
    """Least of that motion, for any contact."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SaturationDefaults(Options):
    """When the largest of all readings is the end of a sensor's range (``saturation.py``)."""

    elements: Annotated[int, Option(2, 1000, "elements", "tuning presses")] = 3
    """That must show the largest reading at once."""
    equal: Annotated[float, Option(0.0, 1e-3, "-", "rounding, where a place at rest was taken from each reading")] = (
        1e-9
    )
    """By which share readings of the same digits may differ."""
    compared: Annotated[float, Option(0.0, 1.0, "-", "noise about 0 says nothing of the digits")] = 0.1
    """Of the largest reading, above which others show whether readings repeat anyhow."""
    least_others: Annotated[int, Option(2, 1000, "readings", "fewer may be distinct by chance")] = 10
    """Of them, to say so."""
    distinct: Annotated[float, Option(0.0, 1.0, "-", "by symmetry at least half are equal")] = 0.9
    """Share of them that differ from each other, from which readings never repeat by rounding or symmetry."""
    ring: Annotated[int, Option(1, 100, "elements", "beside the plateau, where the gel moves as under it")] = 1
    """Around a plateau of rounded readings, which must move on while the plateau stays."""
    growth: Annotated[float, Option(0.0, 1.0, "-", "tuning presses")] = 0.15
    """Share of its largest by which that must change."""
    steps: Annotated[float, Option(1.0, 100.0, "steps", "tuning presses")] = 3.0
    """Of rounding, by which the plateau's readings would have changed as well."""
    kept: Annotated[int, Option(2, 10_000, "frames", "half a second at 30 frames a second, and ever fewer before")] = 32
    """Of a stream, by which rounded readings are judged."""
    stride: Annotated[int, Option(1, 1000, "frames", "it takes 1 ms of CPU")] = 4
    """Of a stream that is judged so."""
    again: Annotated[int, Option(1, 1000, "frames", "three of 400 readings are equal once by chance")] = 3
    """Of a stream, not the same, in which so many elements reach its largest reading, before it is judged."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GrossSlipDefaults(Options):
    """When a contact slips as a whole, though some of its elements are taken to stick (``gross_slip.py``)."""

    sticking: Annotated[float, Option(0.0, 1.0, "-", "as `together`; in a sphere's contact 91 % of the load")] = 0.2
    """Of the elements in contact, the largest share that may seem to stick."""
    together: Annotated[
        float,
        Option(0.0, 1.0, "-", "160 scenes of another phrase; in a sphere's contact 99 % of the load that it bears"),
    ] = 0.05
    """Of the elements in contact, the largest share that may seem to stick beside another one that does."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchDefaults(Options):
    """What no user needs to choose of contact patches (``patch/``)."""

    least_load_share: Annotated[float, Option(0.0, 1.0, "-", "elements that flicker bear less")] = 0.05
    """Of the largest load of all patches together, that a patch must once bear."""
    least_frames: Annotated[int, Option(1, 1000, "frames", "a rate needs as many")] = 4
    """That a patch must last."""
    rate_frames: Annotated[int, Option(3, 1000, "frames", "a line takes two, its error one more and one spare")] = 4
    """In a window, for a rate with an error of its own."""
    significant: Annotated[float, Option(0.0, 100.0, "standard errors", "3 σ")] = 3.0
    """Of a rate, above which it is motion."""
    aligned: Annotated[float, Option(0.0, 1.0, "-", "noise turns either by less than 37°")] = 0.8
    """Least cosine between tangential force and motion of a patch that slides."""
    least_spin: Annotated[float, Option(0.0, 10.0, "-", "what rolls turns less")] = 0.5
    """Of a patch that pivots: rotation times radius of gyration, over the speed of its centre."""
    least_square_arm: Annotated[
        float, Option(0.0, 1.0, "-", "a patch no larger than the sensor's kernel shows no more")
    ] = 0.25
    """Mean square arm of the forces that act, as a share of that of the smoothed ones, at least."""
    descents: Annotated[int, Option(1, 100_000, "steps", "bound")] = 100
    """Of the search for the load ratio."""
    settled: Annotated[float, Option(0.0, 0.1, "-", "0.1 %: far below what forces are known to")] = 1e-4
    """Relative descent at which that search ends."""
    still: Annotated[float, Option(1e-15, 1e-3, "-", "a weight must not overflow")] = 1e-9
    """Share of the fastest motion below which an element counts as the motion's centre."""
    rank: Annotated[float, Option(1e-16, 1e-3, "-", "rounding")] = 1e-14
    """Least polar moment of the friction's weights about their centre, as a share of that about the origin."""
    free_motion: Annotated[float, Option(0.0, 0.1, "-", "far above rounding, far below any load")] = 1e-6
    """Share of a load that may be missed before some motion is taken to meet no friction."""
    rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding of times")] = 1e-9
    """By which a window is widened, so that frames at its ends count."""
    free_frames: Annotated[int, Option(1, 10_000, "frames", "half a second at 30 fps; a median errs by 30 %")] = 15
    """In which elements without load show noise, for it to count."""
    least_known: Annotated[float, Option(0.0, 1.0, "-", "below half, more may be noise than load")] = 0.5
    """Share of a ratio that was held, below which a bound says that the rest may be noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectionDefaults(Options):
    """When the friction of elements contradicts that of their contact (``collection.py``)."""

    agreement: Annotated[
        float, Option(0.0, 10.0, "-", "slopes that are real make a few per cent of it, smoothed forces 40 to 100")
    ] = 0.15
    """Share by which the friction of elements, weakly or strongly pressed, may lie beyond the contact's interval."""
    least_samples: Annotated[int, Option(4, 1_000_000, "samples", "quarters of ten samples")] = 40
    """Of elements, from which quarters of them are compared."""


DEVIATION_TO_SIGMA = 1.4826022185056018
"""1/Φ⁻¹(¾): median absolute deviation of a normal distribution to its standard deviation."""
NORMAL_95 = 1.959963984540054
"""Φ⁻¹(0.975): half-width of the 95 % interval of a normal distribution in standard deviations."""
NOISE = NoiseDefaults()
SMOOTHING = SmoothingDefaults()
CONTRADICTION = ContradictionDefaults()
TURNING = TurningDefaults()
NUMERICS = NumericsDefaults()
RECONSTRUCTED_FORCES = ReconstructedForcesDefaults()
MARKERS = MarkerDefaults()
SATURATION = SaturationDefaults()
GROSS_SLIP = GrossSlipDefaults()
PATCHES = PatchDefaults()
COLLECTION = CollectionDefaults()
TABLES = (
    NOISE,
    SMOOTHING,
    CONTRADICTION,
    TURNING,
    RECONSTRUCTED_FORCES,
    NUMERICS,
    MARKERS,
    SATURATION,
    GROSS_SLIP,
    PATCHES,
    COLLECTION,
)
"""What is not an option of a method."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactOptions(Options):
    """How any method finds which elements touch: from forces where there are any, from the pressed shape otherwise."""

    contact_pressure: Annotated[float, Option(0.0, 1e6, "Pa", "well under the ~100 kPa of a fingertip's grasp")] = 500.0
    """Least normal force over element area."""
    contact_force_share: Annotated[
        float, Option(0.0, 0.9, "-", "forces reconstructed by a sensor ring with 2 % of their peak; tuning scenes")
    ] = 0.08
    """Least share of the frame's largest normal force."""
    contact_depth: Annotated[float, Option(0.0, 0.05, "m", "above the drift of a sensor at rest")] = 3e-5
    """Least indentation, without forces."""
    contact_depth_share: Annotated[
        float, Option(0.0, 0.99, "-", "½ on a half-space (Hertz), less on a bonded gel; 0.2 to 0.3 agrees with forces")
    ] = 0.3
    """Least share of the frame's deepest indentation, without forces."""
    rim_curvature: Annotated[float, Option(0.0, 1.0, "-", "1: not looked at")] = 1.0
    """Without forces, elements where the indentation is hollow by more than this share of its peak (Laplacian times
    pitch squared) lie beyond the contact's rim."""
    rim_noise: Annotated[float, Option(0.0, 100.0, "standard deviations", "tuning scenes")] = 2.0
    """Least hollow at the rim over the noise of the curvature."""
    contact_reach: Annotated[float, Option(0.0, 0.99, "-", "bonded gels of 4.5 to 8 mm among the tuning scenes")] = 0.15
    """Least share of the frame's deepest indentation on a bonded gel, without forces, where the rim is looked at."""
    contact_widening: Annotated[
        float, Option(0.0, 100.0, "-", "up to 3.1 on the bonded gels of the tuning scenes, 7 on a half-space (Hertz)")
    ] = 4.0
    """A gel is taken for bonded where fewer than so many times the elements above ``contact_depth_share`` of the
    deepest indentation lie above ``contact_reach`` of it."""
    contact_edge: Annotated[float, Option(0.0, 1.0, "-", "0 on these gels, 1 on half-spaces seen in part")] = 0.25
    """Least share of the lattice's edge that lies so deep where that cannot be told."""
    contact_noise: Annotated[float, Option(0.0, 100.0, "standard deviations", "one false touch in 10⁶ frames")] = 5.0
    """Least multiple of the estimated noise of force or indentation."""
    release_share: Annotated[float, Option(0.0, 1.0, "-", "hysteresis against flicker at the edge")] = 0.7
    """An element in contact is released under this share of what it takes to touch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StrainRateOptions(ContactOptions):
    """Method ``strain_rate``: extreme events of the signed strain rate, in physical time."""

    smoothing_time: Annotated[float, Option(0.0, 10.0, "s", "three frames at 30 fps; slip fronts last longer")] = 0.1
    """Least time constant of the low-pass on the strain rate; 0 takes the rate of the last interval alone."""
    longest_smoothing_time: Annotated[float, Option(0.0, 100.0, "s", "a grasp's load changes within a second")] = 1.0
    """Greatest time constant: noise lengthens it until the rate is known to ``rate_floor``."""
    memory_time: Annotated[float, Option(1e-3, 1e3, "s", "closed-form ramps of 1.5 to 6 s")] = 10.0
    """Time constant of the running mean and deviation; a short one learns from the slip that it should find."""
    threshold: Annotated[float, Option(0.5, 100.0, "standard deviations", "3 σ")] = 3.0
    """How far an extreme event lies from the running mean."""
    influence: Annotated[float, Option(0.0, 1.0, "-", "closed-form ramps; hardly matters")] = 0.3
    """Weight with which an extreme value is learnt from."""
    rate_floor: Annotated[float, Option(1e-9, 1e3, "1/s", "1 % strain in 2 s is no slip front")] = 5e-3
    """Least standard deviation of the strain rate; estimated marker noise raises it."""
    growth_rate: Annotated[float, Option(0.0, 1e3, "1/s", "excludes slow growth by normal contact")] = 0.3
    """Least rate over strain of a slip onset: the paper's "0.1 × strain / Δt", at no particular frame rate."""
    settling_time: Annotated[float, Option(0.0, 10.0, "s", "the transient of a touch dissipates in 30 ms")] = 0.1
    """After a touch, strain changes count as pressing for so long."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterOptions(ContactOptions):
    """Method ``filter``: chosen on simulated scenes (benchmarks/detector/scenes.py, set ``tuning``)."""

    contact_depth_share: Annotated[
        float, Option(0.0, 0.99, "-", "½ on a half-space (Hertz), less on a bonded gel; tuning scenes")
    ] = 0.45
    """Least share of the frame's deepest indentation, without forces."""
    rim_curvature: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes")] = 0.022
    """Without forces, elements where the indentation is hollow by more than this share of its peak (Laplacian times
    pitch squared) lie beyond the contact's rim."""
    noise_margin: Annotated[float, Option(1.0, 10.0, "-", "half the true noise costs more than twice of it")] = 1.05
    """Factor on the estimated marker noise."""
    unknown_noise: Annotated[float, Option(0.0, 1e-2, "m", "the noisiest of the scenes; never underestimate")] = 1e-5
    """Marker noise while it cannot be estimated yet."""
    displacement_floor: Annotated[float, Option(1e-12, 1e-3, "m", "no camera tracks a marker better")] = 3.5e-08
    """Least standard deviation of a marker coordinate."""
    lasting_ratio: Annotated[float, Option(1.0, 100.0, "-", "white noise up to 1.6, correlated by 0.9 over 2")] = 1.7
    """Noise by neighbours over that by three frames, beyond which it lasts from frame to frame."""
    lasting_least: Annotated[float, Option(0.0, 1e-3, "m", "bends of fields without noise, tuning scenes")] = 3e-7
    """Such noise that is none."""
    lasting_share: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes; errors of frames are not independent")] = 2.0
    """Factor on its variance; 0: no noise is taken to last."""
    pooling_length: Annotated[float, Option(0.0, 1.0, "m", "tuning scenes: 3 to 10 µm differ by 0.01")] = 6e-6
    """So much neighbours part in slip: the more lasting noise exceeds it, the more a place is taken from theirs."""
    pooling_outlier: Annotated[float, Option(0.1, 1e6, "-", "tuning scenes")] = 4.4
    """Squared difference over its variance at which a neighbour's weight falls to a quarter."""
    marker_kernel: Annotated[float, Option(0.0, 0.1, "m", "0: not smoothed; of whole logs estimated")] = 0.0
    """Standard deviation of the kernel that the sensor smooths displacement with, which is then undone."""
    force_kernel: Annotated[float, Option(0.0, 0.1, "m", "0: not smoothed; of whole logs estimated")] = 0.0
    """The same of forces."""
    smoothing_noise: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes")] = 1e-4
    """Power of noise that came after the smoothing, over that of the field."""
    rigidity: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes")] = 0.012
    """How far a stuck element may stray from the object's motion, as a share of it."""
    rigidity_of_fit: Annotated[float, Option(0.0, 10.0, "-", "fits are of many elements")] = 0.5
    """The same of an element's marker in one step, as a share of ``rigidity``."""
    rigidity_of_anchor: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes")] = 0.1
    """Random walk of a stuck element's anchor under motion, as a share of ``rigidity``."""
    slip_share: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes; between 0 at the front and 1 at the rim")] = 0.37
    """Mean slip of a slipping element as a share of the object's motion."""
    slip_share_spread: Annotated[float, Option(0.01, 10.0, "-", "tuning scenes")] = 0.2
    """Standard deviation of that share."""
    creep: Annotated[float, Option(0.0, 1e-3, "m/√s", "tuning scenes")] = 3e-07
    """Random walk of an element's place on the object."""
    onset_length: Annotated[float, Option(1e-9, 1.0, "m", "tuning scenes")] = 0.0001
    """Motion of the object within which an element at the front begins to slip."""
    onset_inside: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes")] = 0.005
    """Onset rate amid sticking neighbours, relative to these."""
    onset_at_front: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes")] = 3.8
    """Onset rate that slipping neighbours, or the rim, add to it."""
    end_length: Annotated[float, Option(1e-9, 1.0, "m", "tuning scenes")] = 0.0001
    """Motion of the object within which slip ends."""
    hold_time: Annotated[float, Option(0.0, 1e6, "s", "tuning scenes")] = 0.5
    """Without motion or change of load for so long, frames say nothing more of slip."""
    hold_deviations: Annotated[float, Option(0.0, 100.0, "standard deviations", "one in 10⁶ frames of white noise")] = (
        5.0
    )
    """How far pose or load must part from their means since something last happened, for something to happen."""
    least_weight: Annotated[float, Option(0.0, 1.0, "-", "slipping points still show that all stand still")] = 0.003
    """Weight of a surely slipping element in the fit of the object's motion."""
    outlier: Annotated[float, Option(0.1, 100.0, "-", "tuning scenes")] = 4.4
    """Squared misfit over its variance at which an element's weight falls to a quarter."""
    outlier_gate: Annotated[float, Option(1.0, 1000000.0, "-", "5 σ: a marker lost and found elsewhere")] = 25.0
    """Squared distance over its variance from both predictions beyond which a marker says nothing."""
    outlier_spread: Annotated[float, Option(0.0, 10.0, "-", "half of the distance")] = 0.25
    """Share of that squared distance by which the variance of both predictions then grows."""
    motion_play: Annotated[
        float, Option(0.0, 100.0, "standard deviations", "tuning scenes: 3 to 6 differ by 0.001")
    ] = 4.0
    """How far the fitted pose may stray before it counts as motion."""
    surroundings_reach: Annotated[
        float, Option(0.0, 100.0, "contact radii", "½ of the motion on a half-space; 30 scenes of other phrases")
    ] = 0.5
    """So far from all that touches, markers show how the camera shakes."""
    surroundings_least: Annotated[int, Option(1, 1_000_000, "markers", "their mean is to be surer than one marker")] = 8
    """With fewer the camera is taken to stand still."""
    surroundings_memory: Annotated[float, Option(1.0, 1e6, "frames", "a second at 30 fps")] = 30.0
    """Over so many frames it is estimated how much of their motion is jitter."""
    surroundings_jitter: Annotated[float, Option(0.0, 1.0, "-", "a camera that stands still is left out of it")] = 0.5
    """Least share of jitter in their motion at which this is the camera's."""
    surroundings_noise: Annotated[float, Option(0.0, 1e6, "variances of their mean", "tuning scenes")] = 2.0
    """Least jitter of their mean, over what their own noise makes of it, at which it is the camera's."""
    surroundings_outlier: Annotated[float, Option(1.0, 1e6, "median absolute deviations", "4 σ")] = 6.0
    """Such a marker says nothing in that step."""
    following_weight: Annotated[float, Option(0.0, 1000000.0, "-", "all of the motion, ± 0.2")] = 30.0
    """Prior weight of a surface that follows all of a given motion."""
    following_variance: Annotated[float, Option(0.0, 1.0, "-", "5 % of the motion")] = 0.0025
    """Squared error of a step's share of the motion."""
    following_learning: Annotated[float, Option(0.0, 1000000.0, "-", "tuning scenes")] = 50.0
    """Prior weights within which the share is learnt from every step."""
    following_stick: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes")] = 0.7
    """Mean probability of stick above which the share is learnt later on."""
    following_whole: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes")] = 0.9
    """Share above which the surface follows all of the motion."""
    following_deviations: Annotated[float, Option(0.0, 100.0, "standard deviations", "3 σ")] = 3.0
    """Least distance of a share from 1 that counts."""
    pose_noise_least: Annotated[float, Option(0.0, 1e6, "-", "less may be the fit's own")] = 2.0
    """Least variance of that noise over that of the pose fitted to the markers."""
    force_noise_margin: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes")] = 1.1
    """Factor on the estimated noise of element forces."""
    force_floor: Annotated[float, Option(0.0, 1e4, "N", "0: none; of reconstructed forces their own deviation")] = 0.0
    """Noise of element forces that lasts, which no change from frame to frame shows."""
    force_smoothing: Annotated[float, Option(0.0, 10.0, "s", "tuning scenes")] = 0.036
    """Time constant of the low-pass on element forces."""
    ratio_spread: Annotated[float, Option(1e-4, 10.0, "-", "tuning scenes")] = 0.082
    """Scatter of the force ratio in slip, as a share of it."""
    ratio_difference: Annotated[float, Option(1e-4, 10.0, "-", "tuning scenes")] = 0.22
    """How much elements differ in it."""
    ratio_memory: Annotated[float, Option(1e-3, 1e4, "s", "tuning scenes")] = 1.5
    """Time constant of what is learnt about it."""
    ratio_weight: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes")] = 1.2
    """Weight of the log-odds from the force ratio; 0 leaves them out."""
    ratio_motion: Annotated[float, Option(0.0, 1.0, "m", "tuning scenes: 30 to 300 nm differ by 0.0003")] = 1e-7
    """Motion of the object within the memory of forces by which their ratio counts; 0: it counts in each frame."""
    ratio_limit: Annotated[float, Option(0.0, 100.0, "log-odds", "tuning scenes")] = 6.0
    """Largest log-odds from one force ratio."""
    ratio_slip: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes")] = 0.85
    """Least slip probability of an element whose ratio is learnt for all."""
    ratio_slip_of_element: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes")] = 0.9
    """The same for its own."""
    ratio_variance: Annotated[float, Option(1e-12, 10.0, "-", "ratios scatter by 0.03 without noise")] = 0.001
    """Least variance of a ratio that is learnt for all."""
    ratio_variance_of_element: Annotated[float, Option(1e-12, 10.0, "-", "an element's own scatter by 0.01")] = 0.0001
    """The same for its own."""
    ratio_least_force: Annotated[float, Option(0.0, 1.0, "N", "resolution of force sensors")] = 0.0001
    """Least normal force for a ratio."""
    force_to_noise: Annotated[float, Option(0.0, 1e3, "-", "tuning scenes")] = 10.0
    """Least normal force over its noise, for a ratio."""
    heading_length: Annotated[float, Option(0.0, 1.0, "m", "0: not looked at; of reconstructed forces 5 µm")] = 0.0
    """Motion of the object within which it is known which way it moves: forces against it then speak for stick."""
    loading_smoothing: Annotated[float, Option(0.0, 10.0, "s", "tuning scenes")] = 0.01
    """Time constant of the load's rates."""
    pressing_share: Annotated[float, Option(0.01, 10.0, "-", "Mindlin–Deresiewicz: all stick below 1")] = 1.2
    """All stick while the tangential load grows by less than this share of friction times the normal load's growth."""
    pressing_slope: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes")] = 0.58
    """Without forces, all stick while the tangential load (by stiffness) grows less than this share of the normal."""
    pressing_floor: Annotated[float, Option(0.0, 1.0, "m/s", "drift of a gel")] = 1e-5
    """Least rate of indentation that counts."""
    pressing_force_floor: Annotated[float, Option(0.0, 1000.0, "N/s", "drift of a force sensor")] = 0.001
    """Least standard deviation of the rate of forces."""
    pressing_rate: Annotated[float, Option(0.0, 1e6, "1/s", "within a frame at 30 fps")] = 100.0
    """Rate at which slip then ends."""
    pressing_deviations: Annotated[float, Option(0.0, 100.0, "standard deviations", "3 σ")] = 3.0
    """Least rate of indentation over its noise."""
    pressing_force_deviations: Annotated[float, Option(0.0, 100.0, "standard deviations", "tuning scenes")] = 4.0
    """Least rate of the normal force over its noise."""
    stiffness_ratio: Annotated[float, Option(0.0, 10.0, "-", "2(1 − ν)/(2 − ν) at ν ≈ ½ (Mindlin)")] = 0.67
    """Tangential over normal stiffness of a stuck contact."""
    slip_limit_usual: Annotated[float, Option(1e-3, 100.0, "-", "friction of 0.37 on a half-space; tuning scenes")] = (
        0.55
    )
    """Median motion of the object over an element before it slips, over the depth that it was pressed in."""
    slip_limit_spread: Annotated[float, Option(0.01, 100.0, "-", "95 % between 0.17 and 1.8: friction 0.1 to 1.2")] = (
        0.6
    )
    """Standard deviation of its logarithm before anything is seen."""
    slip_limit_doubt: Annotated[float, Option(0.0, 0.999, "-", "bonded gels, soft objects, spots")] = 0.25
    """How probable it is beforehand that no such limit holds."""
    slip_limit_width: Annotated[float, Option(0.01, 10.0, "-", "tuning scenes")] = 0.2
    """Scale of the logistic function of the logarithm by which elements differ in it."""
    slip_limit_lag: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes")] = 0.3
    """Slip shows late in markers, so that limits look greater by this logarithm."""
    slip_limit_trust: Annotated[float, Option(0.5, 1.0, "-", "tuning scenes")] = 0.8
    """Largest probability that is believed of what an element's marker shows of slip, and of stick."""
    slip_limit_evidence: Annotated[float, Option(0.0, 1e4, "elements", "tuning scenes: 10 to 40 differ by 0.001")] = (
        20.0
    )
    """So many are independent in each motion that equals the mean depth."""
    slip_limit_memory: Annotated[float, Option(1e-3, 1e6, "-", "tuning scenes: 2 to 1000 differ by 0.001")] = 2.0
    """Motion over depth in which what is known of the limit fades."""
    slip_limit_depth: Annotated[float, Option(0.0, 1e3, "standard deviations", "3 σ")] = 3.0
    """Least mean depth at which it says anything."""
    slip_limit_odds: Annotated[float, Option(0.0, 30.0, "log-odds", "tuning scenes: 1.5 to 4 differ by 0.001")] = 2.0
    """Most that it says of an element; 0 leaves it out."""
    slip_limit_least: Annotated[float, Option(1e-3, 1.0, "-", "friction of 0.08 on a half-space")] = 0.12
    """Least limit that is considered."""
    slip_limit_largest: Annotated[float, Option(0.1, 100.0, "-", "friction of 0.9 on a thin gel")] = 4.0
    """Largest limit that is considered."""
    least_transition: Annotated[float, Option(1e-15, 0.1, "-", "numerics")] = 1e-06
    """Least probability of slip and of stick that is predicted."""
    largest_log_odds: Annotated[
        float, Option(1.0, 30.0, "log-odds", "the way back takes too long from further out")
    ] = 12.0
    """Most that one frame can bring and that is held."""
    threshold: Annotated[float, Option(0.01, 0.99, "-", "tuning scenes; the reported probability is ½ there")] = 0.4
    """Least posterior of slip."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StrainRateLiteralOptions(ContactOptions):
    """Method ``strain_rate_literal``: as printed in the paper, for comparison; its lag is counted in frames."""

    lag: Annotated[int, Option(2, 1000, "frames", "did best at 30 fps")] = 10
    """Frames in the running mean and standard deviation."""
    threshold: Annotated[float, Option(0.5, 100.0, "standard deviations", "van Brakel's example")] = 3.5
    """How far an extreme event lies from the running mean."""
    influence: Annotated[float, Option(0.0, 1.0, "-", "van Brakel's example")] = 0.5
    """Weight with which an extreme value is learnt from."""
    rate_floor: Annotated[float, Option(1e-9, 1e3, "1/s", "rounding only; the paper has no floor")] = 1e-9
    """Least standard deviation of the strain rate."""
    growth_share: Annotated[float, Option(0.0, 10.0, "-", "paper, section II-D")] = 0.1
    """A positive event must exceed this share of the strain, per frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StrainThresholdOptions(ContactOptions):
    """Method ``strain_threshold``: the plain comparison."""

    threshold: Annotated[float, Option(0.0, 10.0, "-", "best on the tuning scenes")] = 0.03
    """Least change of strain since the touch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceRatioOptions(ContactOptions):
    """Method ``force_ratio``: Song et al. 2014."""

    break_away_ratio: Annotated[float, Option(0.0, 100.0, "-", "best on tuning scenes of μ 0.36 to 0.5")] = 0.3
    """Least f_t/f_n of a slipping element; must be known beforehand."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ForcesOnlyOptions(ContactOptions):
    """Method ``forces_only``: chosen on coarse arrays (benchmarks/detector/coarse.py, set ``tuning``)."""

    contact_force_share: Annotated[float, Option(0.0, 0.9, "-", "taxels at the rim bear little")] = 0.03
    """Least share of the frame's largest normal force."""
    force_smoothing: Annotated[float, Option(0.0, 10.0, "s", "tuning scenes")] = 0.036
    """Time constant of the low-pass on element forces."""
    least_load_change: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes")] = 0.008
    """Change of the elements' forces over the normal force, beyond noise, at which they are looked at again."""
    load_deviations: Annotated[float, Option(0.0, 100.0, "-", "noise sums up evenly over elements")] = 1.5
    """Multiple of what noise makes of that change on average that does not count."""
    least_friction: Annotated[float, Option(1e-3, 10.0, "-", "PTFE and oiled steel")] = 0.05
    """Least friction coefficient that is considered."""
    largest_friction: Annotated[float, Option(1e-2, 100.0, "-", "soft rubber")] = 2.5
    """Largest friction coefficient that is considered."""
    frictions: Annotated[int, Option(2, 1000, "-", "steps of 19 %; with twice as many F1 differs by 0.002")] = 24
    """How many friction coefficients are considered."""
    usual_friction: Annotated[float, Option(1e-3, 100.0, "-", "of dry things on silicone")] = 0.55
    """Median friction coefficient before anything is seen."""
    friction_spread: Annotated[float, Option(0.01, 100.0, "-", "95 % between 0.2 and 1.5: what is grasped")] = 0.5
    """Standard deviation of its logarithm."""
    friction_memory: Annotated[float, Option(1e-3, 1e6, "-", "tuning scenes")] = 0.4
    """Change of load over normal force within which what is known of friction fades."""
    friction_weight: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes")] = 1.0
    """Weight of each element's evidence on friction."""
    excess: Annotated[float, Option(1e-4, 10.0, "-", "tuning scenes")] = 0.035
    """By how much the force ratio of elements stands above friction, as a share of it."""
    slip_level: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes: more than half of an element slips")] = 0.64
    """Force ratio over friction at which an element as likely slips as sticks."""
    slip_level_width: Annotated[float, Option(1e-3, 10.0, "-", "tuning scenes")] = 0.05
    """Scale of the logistic function about it."""
    largest_level_odds: Annotated[float, Option(0.1, 100.0, "log-odds", "tuning scenes")] = 5.0
    """Largest evidence from the force ratio."""
    part_spread: Annotated[float, Option(1e-3, 10.0, "-", "tuning scenes")] = 0.12
    """Scatter of the part of a change of load that a sticking element takes, around what it took before."""
    overload: Annotated[float, Option(1.0, 100.0, "-", "tuning scenes")] = 1.3
    """Part that sticking elements take for others that slip."""
    overload_spread: Annotated[float, Option(1e-3, 10.0, "-", "tuning scenes")] = 0.35
    """Scatter of it."""
    overload_share: Annotated[float, Option(1e-3, 0.999, "-", "tuning scenes")] = 0.42
    """Share of sticking elements that do."""
    slip_part: Annotated[float, Option(0.0, 100.0, "-", "tuning scenes")] = 1.3
    """Part that a slipping element takes is this times (1 − ratio/friction) to the power of ``slip_exponent``."""
    slip_exponent: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes; a third in a whole contact")] = 0.4
    """Power of it."""
    slip_part_spread: Annotated[float, Option(1e-3, 10.0, "-", "tuning scenes")] = 0.22
    """Scatter of that part."""
    part_weight: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes")] = 0.8
    """Weight of what the part says of an element."""
    outlier_share: Annotated[float, Option(1e-6, 0.5, "-", "5 %")] = 0.05
    """Share of elements of which the part says nothing."""
    least_change: Annotated[float, Option(1e-9, 1.0, "-", "tuning scenes")] = 0.0005
    """Change of an element's force ratio that counts as load, and of the normal force as pressing."""
    largest_share: Annotated[float, Option(1.0, 100.0, "-", "elements in the middle bear twice what is even")] = 3.0
    """How unevenly elements share a load, at most."""
    largest_gain: Annotated[float, Option(0.1, 100.0, "log-odds", "tuning scenes")] = 3.0
    """Largest evidence on an element from one change of load."""
    memory: Annotated[float, Option(1e-3, 1e6, "-", "tuning scenes")] = 0.08
    """Change of load over normal force within which the evidence on an element fades."""
    largest_log_odds: Annotated[float, Option(0.1, 100.0, "log-odds", "tuning scenes")] = 3.0
    """Largest evidence on an element from changes of load."""
    taken_back: Annotated[float, Option(0.0, 100.0, "log-odds", "tuning scenes")] = 2.0
    """Evidence for stick where an element's load is taken back."""
    pressing_share: Annotated[float, Option(0.01, 10.0, "-", "tuning scenes; Mindlin–Deresiewicz: 1")] = 1.6
    """All stick while the tangential load grows by less than this share of friction times the normal load's growth."""
    pressing_deviations: Annotated[float, Option(0.0, 100.0, "standard deviations", "3 σ")] = 3.0
    """Least growth of the normal force over its noise."""
    pressed_log_odds: Annotated[float, Option(0.0, 100.0, "log-odds", "tuning scenes")] = 8.0
    """Evidence for stick from that."""
    threshold: Annotated[float, Option(0.01, 0.99, "-", "tuning scenes; the reported probability is ½ there")] = 0.4
    """Least posterior of slip."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CoarseOptions(ForcesOnlyOptions):
    """Method ``coarse``: those of ``forces_only``, and what it is joined with method ``filter`` and with layers by."""

    forces_weight: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes: the same by 0.005 from 0.4 to 0.7")] = 0.5
    """Weight of the log-odds of method ``forces_only``."""
    filter_weight: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes: the same by 0.01 from 0.25 to 0.35")] = 0.3
    """Weight of the log-odds of method ``filter``."""
    few_odds: Annotated[float, Option(0.0, 10.0, "log-odds", "tuning scenes; 1: false slip of .055 on 3 × 3")] = 0.6
    """What is added to the log-odds of slip where very few elements touch, and taken off where more do."""
    few_elements: Annotated[float, Option(1.0, 1e9, "-", "tuning scenes: the same within .01 from 6.5 to 10")] = 7.0
    """How many elements have to touch for neither."""
    many_elements: Annotated[float, Option(1.0, 1e9, "-", "tuning scenes: the same within .003 from 30 to 60")] = 45.0
    """How many elements have to touch for forces and layers to count half as much as on few; beyond, ever less."""
    largest_sum: Annotated[float, Option(1.0, 30.0, "log-odds", "tuning scenes")] = 9.0
    """Largest log-odds of any of them."""
    layers_weight: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes; more adds false slip")] = 1.5
    """Weight of the log-odds of the layers that the contact has grown by, where elements are of one gel."""
    layers: Annotated[int, Option(4, 1000, "-", "tuning scenes: twice as many change F1 by 0.001")] = 16
    """How many layers a contact has, at most."""
    layer_misfit: Annotated[float, Option(1e-3, 10.0, "-", "tuning scenes: forces err by 2 to 7 % of friction")] = 0.1
    """By how much forces of elements differ from those of the layers, as a share of friction."""
    layer_evidence: Annotated[float, Option(0.0, 10.0, "-", "tuning scenes; 1: elements err independently")] = 0.3
    """Weight of these forces as evidence on friction."""
    layer_stick_share: Annotated[float, Option(0.0, 1.0, "-", "tuning scenes: half of an element's area")] = 0.31
    """Share of an element's normal force in layers that stick at which it as likely slips as sticks."""
    layer_stick_width: Annotated[float, Option(1e-3, 10.0, "-", "tuning scenes")] = 0.1
    """Scale of the logistic function about it."""
    spring_spread: Annotated[float, Option(1e-6, 10.0, "-", "tuning scenes: pillars up to 0.03, gels from 0.3")] = 0.1
    """What of the elements' normal forces no common stiffness explains, as a share, at which layers count half."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RigidFitOptions(ContactOptions):
    """Method ``rigid_fit``: Dong et al. 2019."""

    core_share: Annotated[float, Option(0.01, 1.0, "-", "their reference points lie inside the stick region")] = 0.2
    """Share of the contact, nearest to its centre, that is taken to stick."""
    deviation_share: Annotated[float, Option(0.0, 10.0, "-", "best on the tuning scenes")] = 0.05
    """Least deviation from the rigid motion as a share of it."""
    least_deviation: Annotated[float, Option(0.0, 0.1, "m", "above the noise of markers")] = 1.5e-5
    """Least deviation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalDeformationOptions(ContactOptions):
    """Method ``local_deformation``: Zhang et al. 2023."""

    threshold: Annotated[float, Option(0.0, 10.0, "-", "best on the tuning scenes")] = 0.02
    """Least relative displacement of neighbours per distance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeformationGradientOptions(ContactOptions):
    """Method ``deformation_gradient``: Sui et al. 2022."""

    share: Annotated[float, Option(0.0, 1.0, "-", "best on the tuning scenes")] = 0.3
    """Least gradient as a share of the largest in the contact."""
    least_gradient: Annotated[float, Option(0.0, 10.0, "-", "above the noise of markers")] = 0.02
    """Least gradient."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleOptions(Options):
    """Which slipping elements give a friction sample."""

    least_velocity: Annotated[float, Option(0.0, 1.0, "m/s", "creep of a gel at rest")] = 1e-5
    """Least tangential velocity: slower points are most likely stuck and would drag μ down."""
    velocity_to_noise: Annotated[float, Option(0.0, 100.0, "-", "3 σ of one velocity component")] = 3.0
    """Least tangential velocity over its noise, √2 σ_marker over the interval."""
    least_force_share: Annotated[float, Option(0.0, 0.99, "-", "the rim, where forces are least certain")] = 0.1
    """Least normal force as a share of the frame's largest."""
    force_to_noise: Annotated[float, Option(0.0, 1e3, "-", "tuning grasps; bias of 1/f_n by (σ/f_n)⁴: 0.2 %")] = 5.0
    """Least normal force over its noise: μ = f_t/f_n is heavy-tailed and biased below."""
    force_noise: Annotated[float, Option(0.0, 1e3, "N", "NaN: estimated from the log")] = math.nan
    """Standard deviation of an element's normal force."""
    least_weight: Annotated[float, Option(0.0, 1.0, "-", "more likely slip than not")] = 0.5
    """Least probability of slip."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchOptions(Options):
    """How contact patches are followed, and when the load on one stands on the limit surface."""

    window: Annotated[float, Option(1e-3, 100.0, "s", "objects pivot and slide within seconds")] = 0.5
    """Over which rates of motion are taken."""
    margin: Annotated[int, Option(0, 100, "elements", "sensors smooth forces over one to three")] = 2
    """How far around a patch forces still count as its own."""
    kernel_width: Annotated[float, Option(0.0, 0.1, "m", "0: not smoothed")] = 0.0
    """Standard deviation of the kernel that the sensor smooths forces with."""
    least_anisotropy: Annotated[float, Option(0.0, 1.0, "-", "half-axes 1.36 to 1; rounder ones turn by noise")] = 0.3
    """(a² − b²)/(a² + b²) of the half-axes of a patch above which it has a direction."""
    least_travel: Annotated[float, Option(0.0, 10.0, "elements", "the centre of force errs by a tenth")] = 0.2
    """Travel of a patch over the markers within the window from which it moves."""
    least_speed: Annotated[float, Option(0.0, 1.0, "m/s", "creep of a gel at rest")] = 2e-5
    """Speed over the markers from which an object moves, where its pose is given."""
    least_force_share: Annotated[float, Option(0.0, 1.0, "-", "forces are least certain at touch and release")] = 0.3
    """Of a patch's largest normal force, under which its load is not looked at."""
    flatness: Annotated[float, Option(0.0, 1.0, "-", "μ differs by less with speed and place")] = 0.1
    """Share of the largest load that a plateau may lie below it, and grow within an element's travel."""
    plateau_travel: Annotated[float, Option(0.0, 100.0, "elements", "far beyond what partial slip moves")] = 0.5
    """Least travel over the markers on a plateau."""
    shortfall: Annotated[float, Option(0.0, 1.0, "-", "μ of one object in two directions")] = 0.2
    """Share that a plateau may lie below the largest load that the patch bore; below, it rolls."""
    rolling_resistance: Annotated[float, Option(0.0, 10.0, "-", "soft rollers resist with 0.01 to 0.1")] = 0.1
    """Tangential over normal force up to which a patch that travels may roll."""
    sliding_share: Annotated[float, Option(0.0, 1.0, "-", "a rolling body: up to 0.36; a sliding one nearly 1")] = 0.6
    """Share of a patch's way that it makes on plateaus, if it slides; below, it rolls."""
    resultant_error: Annotated[float, Option(0.0, 1.0, "-", "Tac3D's resultants and sums differ by 3 to 7 %")] = 0.03
    """Standard error of a ratio of resultants, as a share of it."""
    slip_share: Annotated[float, Option(0.0, 1.0, "-", "false slip of noise is less")] = 0.05
    """Share of a patch's elements that slip, from which its slip is incipient."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckOptions(Options):
    """When ``check_log`` finds something doubtful.

    Where no physical bound gives a limit it stands between grasps simulated with noise and the three Tac3D recordings,
    of which the friction is known to come out wrong (docs/checks.md has both sides); none of others was at hand.
    """

    longest_interval: Annotated[float, Option(0.0, 60.0, "s", "a slip front passes an element in a tenth")] = 1.0
    """Longest time between frames, in the median."""
    shortest_interval: Annotated[float, Option(0.0, 60.0, "s", "taxels are read at up to 4 kHz, images at 1 kHz")] = (
        2e-4
    )
    """Shortest, likewise."""
    largest_stretch: Annotated[float, Option(0.0, 100.0, "-", "no gel is half as large again; scenes 0.01")] = 0.5
    """Largest strain of the whole lattice in the direction of its least, in the mean over the log."""
    stretch_frames: Annotated[
        int, Option(1, 1000000, "frames", "places are there in any frame; of long logs a few")
    ] = 9
    """Evenly chosen over the log, of whose mean that is taken."""
    area_factor: Annotated[float, Option(1.0, 1e6, "-", "taxels with gaps fill a quarter of their cell")] = 4.5
    """Largest factor between an element's area and its cell of the lattice, either way."""
    repeated_share: Annotated[float, Option(0.0, 1.0, "-", "noise makes no two readings alike")] = 0.05
    """Largest share of frames that are copies of the one before."""
    largest_pressure: Annotated[float, Option(0.0, 1e12, "Pa", "gels tear and fingertips hurt below 1 MPa")] = 5e6
    """Largest normal force over element area."""
    largest_modulus: Annotated[float, Option(0.0, 1e15, "Pa", "silicone, rubber and thin gels are below 5e6")] = 5e7
    """Largest modulus of a skin, of the largest force, the area that bears it, and the largest displacement."""
    saturated_share: Annotated[float, Option(0.0, 1.0, "-", "one element has the largest, four by symmetry")] = 0.05
    """Largest share of the elements in contact that reach the largest reading, to the last digit."""
    rest_share: Annotated[float, Option(0.0, 1.0, "-", "linear gels bear no larger share of the force then")] = 0.03
    """Of the contact's largest mean displacement, up to which its markers are at rest."""
    rest_deviations: Annotated[float, Option(0.0, 100.0, "-", "least and largest of 100 readings lie 5 apart")] = 6.0
    """Standard deviations of noise by which a contact's force at rest may be above its least, where markers are seen in
    the plane only."""
    least_rest: Annotated[int, Option(2, 1000000, "frames", "a variance to a factor of two")] = 4
    """Frames at rest from which the forces in them count as the sensor's zero."""
    zero_share: Annotated[float, Option(0.0, 10.0, "-", "friction of 0.4 is off by 6 % then; scenes to 0.01")] = 0.025
    """Largest mean of what elements read at rest, as a share of their normal force in the grasp."""
    zero_errors: Annotated[float, Option(1.0, 100.0, "-", "by chance in 0.3 % of components")] = 3.0
    """Standard errors of a component's mean from which on it counts."""
    leak_variances: Annotated[
        float, Option(1.0, 1e3, "-", "the squared mean of what falls off linearly to nothing")
    ] = 3.0
    """Variances between elements beside the contact from which on a component's squared mean is no leak of it."""
    passing_touch: Annotated[float, Option(0.0, 1.0, "-", "noise above a threshold, and no contact")] = 0.05
    """Share of the frames in which an element may seem to touch, and count as not touched in the grasp."""
    free_distance: Annotated[int, Option(0, 1000, "elements", "smoothed forces spread over one to three")] = 2
    """From elements that touch, up to which others may feel something of the contact."""
    least_free: Annotated[int, Option(2, 1000000, "elements", "in four corners leaks are alike by symmetry")] = 16
    """Elements beyond that from which they tell the sensor's zero during a grasp."""
    normal_lean: Annotated[float, Option(0.0, 1.0, "rad", "friction of 0.4 is off by 9 % then; Tac3D's 3e-5")] = 0.03
    """Largest angle by which all normals lean against the surface."""
    lean_errors: Annotated[float, Option(0.0, 100.0, "-", "by chance in 0.3 % of frames")] = 3.0
    """Standard errors that such a lean is more than, too."""
    large_lean: Annotated[float, Option(0.0, 1.57, "rad", "20°; a rim on 3 × 3 elements bends the mean by 5")] = 0.35
    """From which on the lean is that of the mean normal."""
    least_turning: Annotated[float, Option(0.0, 1.0, "rad", "a thirtieth of the lean allowed")] = 1e-3
    """Root mean square by which normals turn with place on a surface that is curved."""
    flat_places: Annotated[float, Option(0.0, 1.0, "-", "the places of a dome 0.25 to 0.33")] = 0.1
    """How far places lie off their plane, over the product of how far they and their normals spread, below which they
    are flat under the normals of a curved surface."""
    gripper_share: Annotated[float, Option(0.0, 10.0, "-", "resultants of Tac3D part from their sum by 3 to 7 %")] = (
        0.15
    )
    """Share by which the sum of normal forces may differ from the gripper's force, in the median."""
    gripper_full: Annotated[float, Option(0.0, 1.0, "-", "the ramp of a grip is left out")] = 0.8
    """Share of the gripper's largest force from which on both are compared."""
    gripper_delay: Annotated[float, Option(0.0, 10.0, "s", "a gripper's report at 10 Hz")] = 0.1
    """By which the gripper's report may be late."""
    gripper_change: Annotated[float, Option(0.0, 1.0, "-", "a third of the share by which both may differ")] = 0.05
    """Share of its largest force by which it may change within that in frames that are compared."""
    gripper_cropped: Annotated[float, Option(0.0, 1.0, "-", "most of a contact is on it; kgf give 0.1")] = 0.25
    """Least share of the gripper's force that elements may bear where the contact leaves the lattice."""
    gripper_trend: Annotated[float, Option(0.0, 10.0, "-", "half of what friction differs by between places")] = 0.08
    """Share by which their ratio may change from the first to the last fifth of the frames held."""
    contact_likeness: Annotated[float, Option(0.0, 1.0, "-", "an offset is alike everywhere, about 0")] = 0.5
    """Correlation over elements of forces at rest with those of the grasp, above which they are a contact's."""
    least_held: Annotated[int, Option(3, 1000000, "frames", "a line and what it leaves")] = 8
    """Frames in which the contact is pressed, from which forces are compared with the markers."""
    least_moved: Annotated[float, Option(0.0, 1.0, "-", "the line is hardly drawn beyond what was seen")] = 0.3
    """Share of the largest mean displacement, over force, that some frame must stay below."""
    lean: Annotated[float, Option(0.0, 10.0, "-", "scenes 0.004, Tac3D's recordings 0.02 to 0.06")] = 0.08
    """Largest sideways force over normal force where no marker moves sideways."""
    turn: Annotated[float, Option(0.0, 180.0, "°", "Tac3D's recordings 4 to 18; an exchange of axes is 90")] = 45.0
    """Largest angle between the directions of forces and of markers."""
    no_load: Annotated[float, Option(0.0, 10.0, "-", "well below any friction coefficient")] = 0.1
    """Ratio of the contact's tangential load, force and moment, to its normal force below which it is unloaded."""
    sideways_share: Annotated[float, Option(0.0, 10.0, "-", "scenes up to 0.20, a recording that pivots 0.26")] = 0.25
    """Largest sum of the elements' tangential forces over the normal force, without load."""
    travel: Annotated[float, Option(0.0, 1e3, "elements", "the centre of force errs by a fraction of one")] = 2.0
    """How much further than its markers a contact's centre may travel."""
    partial_slip: Annotated[float, Option(0.0, 1.0, "-", "the rim of what is only pressed, up to 0.08 in scenes")] = 0.1
    """Largest share of the contact in slip up to which nothing is taken to slip."""
    least_friction: Annotated[float, Option(0.0, 1.0, "-", "PTFE on steel, the slipperiest pair, 0.04 to 0.1")] = 0.05
    """Friction below which some axis is taken to be in another unit."""
    largest_friction: Annotated[float, Option(1.0, 1e3, "-", "clean rubber on glass 2, rarely more")] = 3.0
    """Friction above which the same is."""
    friction_change: Annotated[float, Option(0.0, 10.0, "-", "simulated grasps 0.01, recordings 0.25 to 0.50")] = 0.3
    """Largest change of friction from the quarter of samples with the least force to that with the most."""
    place_scatter: Annotated[float, Option(0.0, 10.0, "-", "simulated grasps 0.03, recordings 0.17 and 0.30")] = 0.15
    """Largest standard deviation of friction between elements, as a share of it."""
    scatter_share: Annotated[float, Option(0.0, 10.0, "-", "as for the scatter between elements")] = 0.15
    """Largest standard deviation of friction about a law of speed and force, as a share of friction."""
    scatter_over_repeats: Annotated[float, Option(1.0, 1e3, "-", "tuning scenes: 0.4 to 2.6 where so many repeat")] = (
        3.0
    )
    """Largest multiple of the standard deviation of the same element's readings, from frame to frame, that this is."""
    least_repeats: Annotated[int, Option(2, 1000000, "pairs", "a deviation to 16 %")] = 20
    """Pairs of samples of one element in successive frames from which that deviation counts."""
    least_samples: Annotated[int, Option(8, 1000000, "samples", "quarters of ten samples")] = 40
    """Samples from which friction is compared."""
    samples_of_place: Annotated[int, Option(2, 1000000, "samples", "a mean to half of their scatter")] = 5
    """Samples of an element from which its friction counts."""
    least_places: Annotated[int, Option(2, 1000000, "elements", "a deviation to 40 %")] = 4
    """Such elements from which friction by place is compared."""
    symmetric: Annotated[int, Option(1, 1000, "elements", "a contact about a lattice's corner")] = 4
    """Elements that may share the largest reading where nothing but symmetry makes them alike."""


METHOD_NAMES = (
    "filter",
    "strain_rate",
    "strain_rate_literal",
    "rigid_fit",
    "local_deformation",
    "deformation_gradient",
    "force_ratio",
    "strain_threshold",
    "forces_only",
    "coarse",
)
"""The methods of detection, for who offers them without loading their kernels (``slipcore.METHODS`` does)."""
DEFAULT_METHOD = "filter"
FORCES_METHOD = "forces_only"
"""In its place for logs without displacement."""
FEW_METHOD = "coarse"
FEW_ELEMENTS = 36
"""Where nobody names a method, of arrays of no more elements, as 6 × 6, that measure displacement and forces. It has an
F1 of .79 to .87 there and ``filter`` of .41 to .78, of 10 × 10 .889 and .892 (docs/sensors.md)."""
LOOKAHEAD = 2
"""Frames after it that a frame of a stored log is decided by; more than two gains little (tuning scenes)."""
MOST_LOOKAHEAD = 100
"""Frames; each one costs time and memory, and what lies further ahead says nothing."""

FORMER_OPTIONS = frozenset(
    {"onset_time", "end_time", "motion_margin", "onset_under_restick", "following_least", "pressing_sideways_variances"}
    | {"rim_inside", "rim_clear"}
)
"""Of method ``filter``: the first three until slip began and ended by motion and load alone, the next until it was
measured that they change nothing, and the last two until a contact on a bonded gel was found by ``contact_reach``
alone; ignored with a warning for one version."""

Kind = TypeVar("Kind", bound=Options)


def choose_options(kind: type[Kind], given: Mapping[str, float]) -> Kind:
    """Defaults with the ``given`` options in their place.

    Raises ``InvalidInput`` naming an option that does not exist, is not a number or lies outside its range.
    """
    known = describe_options(kind)
    for name in sorted(FORMER_OPTIONS & given.keys() - known.keys()):
        warnings.warn(f"option {name} has no effect any more", DeprecationWarning, stacklevel=3)
    given = {name: value for name, value in given.items() if name in known or name not in FORMER_OPTIONS}
    for name, value in given.items():
        if name not in known:
            raise InvalidInput("option", name, ", ".join(sorted(known)))
        low, high, unit, _ = known[name]
        whole = isinstance(kind.__dataclass_fields__[name].default, int)
        number = isinstance(value, int if whole else (int, float)) and not isinstance(value, bool)
        if not number or not low <= value <= high:
            raise InvalidInput(name, value, f"{'a whole number, ' if whole else ''}{low:g} to {high:g} {unit}")
    return kind(**given)
