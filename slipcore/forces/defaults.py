"""Every default of forces from displacement, with unit, valid range and source.

"Scenes", "trials": chosen on the independent solver's scenes in tests/data/contact; "rounding": what double precision
leaves; "bound": stops what does not converge.
"""

from dataclasses import dataclass
from typing import Annotated

from slipcore.calibration import defaults as of_presses
from slipcore.options import Option, Options


@dataclass(frozen=True, slots=True)
class GelLimits:
    """What a sensor's gel can plausibly be; outside, the units are almost surely wrong."""

    young_modulus: tuple[float, float] = (1e2, 1e12)
    """Pa; softer than any gel, stiffer than any solid."""
    thickness: float = 1e-6
    """m, at least."""
    thinness: float = 0.1
    """Thickness over the distance between markers, at least: thinner gels move a marker only where it is loaded itself,
    and their response takes time with the square of one over it."""
    relative_thickness: tuple[float, float] = (0.25, 4.0)
    """Of a place, over the gel's thickness."""
    slope: float = 0.35
    """m a m, by which the thickness changes at most."""
    marker_depth: float = 1.0
    """m, at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeDefaults(Options):
    """Where traction is sought (``nodes.py``)."""

    margin: Annotated[int, Option(0, 100, "nodes", "scenes cut by the lattice")] = 4
    """Beyond the outermost markers: a contact that the lattice cuts acts on its markers from there, too."""
    most: Annotated[int, Option(1, 1_000_000, "nodes", "more would take over 10 GB of memory")] = 20_000


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseDefaults(Options):
    """Displacement by traction on a node (``response.py``)."""

    cells: Annotated[int, Option(1, 100, "cells", "1e-2 of the response at its peak, and less far away")] = 7
    """Along a pitch, of which hat functions are made and between which is interpolated."""
    finer: Annotated[int, Option(1, 100, "-", "2e-4 of the response at its peak; 1e-2 without")] = 7
    """How many times smaller cells are near a node."""
    near: Annotated[int, Option(1, 100, "pitches", "beyond, the coarser cells do as well")] = 3
    """Within which they are."""
    digits: Annotated[int, Option(3, 12, "decimals", "far below what a spline misses")] = 9
    """Of a cell, to which offsets of markers from nodes that are alike agree; each is evaluated once."""
    thicknesses: Annotated[int, Option(1, 100, "thicknesses", "1e-3 of the response where they differ by four")] = 5
    """Of layers, between which those of a gel that is not alike thick everywhere are interpolated."""
    least_change: Annotated[float, Option(1e-9, 1.0, "-", "rounding")] = 1e-3
    """Half of the range, in logarithms, that these span at least."""
    plane: Annotated[
        float, Option(0.0, 1.0, "-", "an ellipse: 0.44 where a layer is thin beside it, 0.35 where thick")
    ] = 0.4
    """How deep in such a gel, as a share of its thickness, the plane lies that markers and nodes are framed by."""
    neighbours: Annotated[int, Option(1, 100, "markers", "midway between four of a lattice")] = 4
    """By which the thickness at a node is interpolated."""
    least_distance: Annotated[float, Option(1e-9, 1.0, "-", "rounding")] = 1e-6
    """Of a marker, in the smallest there is, that is taken to lie at a node."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PriorDefaults(Options):
    """What is assumed of traction before any marker is seen (``prior.py``)."""

    pressure_length: Annotated[float, Option(0.1, 100.0, "pitches", "trials")] = 6.0
    """Correlation length of pressure, from which the choice begins."""
    traction_length: Annotated[float, Option(0.1, 100.0, "pitches", "a slip front is narrower than a contact")] = 3.0
    """The same of tangential traction."""
    length_factor: Annotated[float, Option(1.0, 100.0, "-", "the evidence is flat between")] = 2.0
    """By which lengths that the data may choose instead are shorter and longer."""
    shear: Annotated[float, Option(0.01, 10.0, "-", "of the size of friction coefficients")] = 0.3
    """Standard deviation of a tangential component over that of pressure, from which the choice begins."""
    least_shear: Annotated[float, Option(0.001, 10.0, "-", "an object that is pressed alone")] = 0.1
    """Smallest such ratio that the data may choose."""
    largest_shear: Annotated[float, Option(0.01, 100.0, "-", "rubber on a clean face")] = 1.0
    """Largest such ratio that the data may choose."""
    unseen_shear: Annotated[float, Option(1e-6, 10.0, "-", "so small that pressure alone explains depth")] = 0.02
    """Such a ratio, not chosen by data, where displacement along the normal alone is seen."""
    jitter: Annotated[float, Option(0.0, 1e-3, "-", "rounding of a thousand nodes' Cholesky factor")] = 1e-8
    """Added to the correlation of a node with itself, so that nodes much closer than a length stay distinct."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StrengthDefaults(Options):
    """Choice of the prior's strength, the standard deviation of pressure (``strength.py``)."""

    largest: Annotated[float, Option(1e-3, 100.0, "Young's moduli", "linear elasticity ends far below")] = 1.0
    """A model that misses what the data show must not explain it by pressures that no gel bears."""
    least_share: Annotated[float, Option(1e-9, 0.1, "-", "1 kPa on a gel of 1 MPa: 0.1 N on 1 cm²")] = 1e-3
    """Smallest strength that is tried, as a share of the largest."""
    least_signal: Annotated[float, Option(1e-6, 1.0, "-", "a prior that explains nothing of the data")] = 1e-2
    """The same in units of what makes the strongest singular direction equal to noise; the lesser counts."""
    grid: Annotated[int, Option(3, 1000, "strengths", "brackets the best, which is refined")] = 41
    """Tried at equal ratios before the best is refined."""
    steps: Annotated[int, Option(1, 1000, "steps", "bound; one to three do")] = 30
    """By Newton's method from a strength that is nearly the best."""
    settled: Annotated[float, Option(1e-9, 10.0, "nats", "what is then left is a twentieth of it")] = 0.2
    """Gain of a step after which none follows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SupportDefaults(Options):
    """Search for the nodes in contact (``support.py``)."""

    rounds: Annotated[int, Option(1, 1000, "rounds", "bound; scenes take 8 to 21")] = 40
    least_share: Annotated[float, Option(0.0, 0.1, "-", "a pressure of 3 % of the largest")] = 1e-3
    """Variance, as a share of the largest, under which a node is left out."""
    settled: Annotated[float, Option(1e-9, 1.0, "-", "supports change no more")] = 0.02
    """Mean change of the logarithms of variances at which they have converged."""
    shear: Annotated[float, Option(0.01, 10.0, "-", "of the size of friction coefficients")] = 0.3
    """Standard deviation of a tangential component over that of pressure."""
    coupling: Annotated[float, Option(0.0, 1.0, "-", "scenes: with 1/4 a contact grows by half an element more")] = 0.1
    """Weight of the nodes beside a node in its variance; with 0 every other node of a contact is left out."""
    least_freedom: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-12
    """Least number of its values that the data are taken to determine of a node."""
    steps: Annotated[int, Option(0, 100, "rows", "bound")] = 6
    """Most rows by which a contact then grows or shrinks."""
    levels: Annotated[int, Option(0, 100, "levels", "an ellipse, a cone, a block and a stadium")] = 8
    """Of pressure at which the rim of a contact is tried to be cut, from a row less to a row more."""
    least_probability: Annotated[float, Option(0.0, 1.0, "-", "less adds under a tenth to deviations")] = 1e-2
    """Of a contact, in those of the most probable one, from which on forces by it count in deviations."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FitDefaults(Options):
    """Tractions on a known contact (``fit.py``)."""

    rounds: Annotated[int, Option(1, 1000, "rounds", "bound")] = 30
    """Changes of the set of nodes without pressure until it is given up to look for a better one."""
    tension: Annotated[float, Option(0.0, 1.0, "-", "scenes: to forbid it costs 0.3 % of the normal force")] = 0.05
    """Share of the largest pressure by which any may seem to pull: so far bilinear pressures overshoot at a contact's
    rim."""
    rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-9
    """Share of the largest pressure by which one may lie below that bound."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OverTimeDefaults(Options):
    """Tractions by all frames of a contact (``over_time.py``)."""

    shortest: Annotated[float, Option(1e-3, 10.0, "frames", "e⁻¹⁰ of a frame is kept in the next")] = 0.1
    """Time over which tractions last, at least."""
    longest: Annotated[float, Option(1.0, 1e15, "frames", "a load at rest changes by a 10⁻⁷ of itself")] = 1e14
    """The same, at most."""
    grid: Annotated[int, Option(3, 1000, "times", "a decade apart")] = 16
    """Tried at equal ratios before the best is refined."""
    settled: Annotated[float, Option(1e-6, 1.0, "-", "a tenth of the time: errors change by 3 % of themselves")] = 0.1
    """Of its logarithm, to which it is found."""
    frames: Annotated[int, Option(2, 1_000_000, "frames", "they take some 20 kB each")] = 1000
    """At once, at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LatticeDefaults(Options):
    """Traction anywhere under the lattice (``whole_lattice.py``)."""

    concentration: Annotated[float, Option(1.0, 100.0, "-", "contacts cover a twentieth of the lattice and more")] = 5.0
    """Prior standard deviation over that which explains the displacement if the whole lattice were loaded alike."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReconstructionDefaults(Options):
    """A whole log (``reconstruction.py``)."""

    discretisation: Annotated[float, Option(0.0, 0.1, "-", "scenes: up to 1 µm of 1 mm")] = 1e-3
    """Error of bilinear tractions one to a marker, as a share of a frame's largest displacement."""
    change: Annotated[float, Option(0.0, 10.0, "-", "trials")] = 0.1
    """Change of the displacement, as a share of it, after which the contact is sought anew."""
    significant: Annotated[float, Option(0.0, 100.0, "standard deviations", "one false touch in 10⁶ frames")] = 5.0
    """By which a frame's mean square must exceed that of noise for something to touch."""
    node_significance: Annotated[float, Option(0.0, 100.0, "standard deviations", "3 σ")] = 3.0
    """Of a node's pressure, above which it may be in contact."""
    node_share: Annotated[float, Option(0.0, 1.0, "-", "bilinear pressures overshoot by so much")] = 0.03
    """Of the frame's largest pressure, above which a node may be in contact."""
    element_significance: Annotated[float, Option(0.0, 100.0, "standard deviations", "2 σ")] = 2.0
    """Of an element's normal force or shear, above which it is said to be in contact."""
    element_share: Annotated[float, Option(0.0, 1.0, "-", "scenes: the rim of Hertz's pressure")] = 0.06
    """Of the frame's largest normal force or shear, above which an element is said to be in contact."""
    rim_share: Annotated[float, Option(0.0, 1.0, "-", "an ellipse, a cone and a block on 4 mm")] = 0.15
    """Of the largest normal force or shear around an element, above which it is said to be in contact: else all that a
    contact covers a little would count."""
    least_coupling: Annotated[float, Option(0.0, 10.0, "-", "ν 0.49: half-space 0.01, 5 mm 0.1 to 0.3")] = 0.03
    """Motion of markers in the plane by a pressure over that by a shear, from which on they show where it presses."""
    covered: Annotated[float, Option(0.0, 1.0, "-", "its marker then lies inside")] = 0.5
    """Share of an element's area that must lie over the contact."""
    element_error: Annotated[float, Option(0.0, 1.0, "-", "scenes")] = 1e-2
    """Standard deviation of what bilinear tractions and the shape of the contact leave wrong of an element's force, as
    a share of the largest."""
    force_to_noise: Annotated[float, Option(0.0, 1e3, "-", "neighbours err together, and by no mean less")] = 20.0
    """Least normal force of an element's friction sample over its deviation: more than of a sensor's own forces."""
    force_tolerance: Annotated[float, Option(1e-6, 1.0, "-", "as of presses")] = of_presses.ESTIMATE.force_tolerance
    """Standard deviation of a given total force, as a share of it, and of this share of the largest given one."""
    least_force: Annotated[float, Option(0.0, 1e-3, "N", "far below what force sensors resolve")] = 1e-9
    """Taken for the largest given force where all are 0."""
    largest_pressure: Annotated[float, Option(0.1, 1e3, "-", "linear elasticity ends far below")] = 10.0
    """Largest given total force, over Young's modulus times the area of all elements."""
    contradiction: Annotated[float, Option(1.0, 100.0, "standard deviations", "3 σ")] = 3.0
    """From which on a given total force and the one that is found are not alike."""
    contradicted_share: Annotated[
        float, Option(0.0, 1.0, "-", "of sure forces 0.3 %, of heavy-tailed ones some more")
    ] = 0.1
    """Of the frames that touch, in which that must be so for it to be reported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceStreamDefaults(Options):
    """Frames as they come (``stream.py``)."""

    frames: Annotated[int, Option(3, 1000, "frames", "half a second at 30 frames a second")] = 15
    """First ones, which show the noise of markers and have no forces; as many latest ones show it again later."""
    least_noise: Annotated[float, Option(0.0, 1e-3, "m", "finer than cameras resolve")] = 1e-8
    """Of a marker's coordinate, where none shows: a sensor that rounds, or a simulated one."""
    stride: Annotated[int, Option(1, 1000, "frames", "a look takes 50 ms of CPU: 25 ms a frame")] = 2
    """From one look for the contact to the next, at least, where depth is seen."""
    stride_in_plane: Annotated[int, Option(1, 1000, "frames", "a look takes 150 to 220 ms of CPU: 28 ms a frame")] = 8
    """The same where it is not."""
    growth: Annotated[float, Option(1.0, 100.0, "-", "trials")] = 1.5
    """Of the displacement, since contact and prior were sought from the beginning, after which they are again, where
    depth is seen."""
    growth_in_plane: Annotated[float, Option(1.0, 100.0, "-", "a beginning takes over 1 s of CPU")] = 3.0
    """The same where it is not."""
    typical: Annotated[float, Option(1.0, 1e6, "-", "a press of some N on a gel of 1 MPa, 1 µm")] = 30.0
    """Displacement over noise that is expected before anything touches."""
    lattice_growth: Annotated[float, Option(1.0, 1e6, "-", "its prior is then half as wide as else")] = 10.0
    """Of the displacement, over that which the whole lattice's operator was made for, after which it is made anew."""
    noise_change: Annotated[float, Option(1.0, 1e6, "-", "estimates from 15 frames scatter by far less")] = 2.0
    """Of the noise, up or down, after which it is made anew."""
    compared: Annotated[int, Option(1, 10_000, "frames", "a second at 30 frames a second")] = 30
    """With a gripper's force, before it is said to be contradicted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GelCalibrationDefaults(Options):
    """A gel from presses with known forces (``gel_calibration.py``)."""

    least_ratio: Annotated[float, Option(0.0, 0.5, "-", "silicones, gels and foams that bear a press")] = 0.3
    """Smallest Poisson's ratio; up to 0.5 all are as probable before anything is seen."""
    first_ratio: Annotated[float, Option(0.0, 0.5, "-", "usual of gels")] = 0.48
    """Poisson's ratio with which the search begins."""
    thinnest: Annotated[float, Option(0.1, 100.0, "pitches", "thinner ones move one marker at a time")] = 1.0
    """Smallest thickness; one over it down to 0 (a half-space), all are as probable before anything is seen."""
    first_thickness: Annotated[float, Option(0.1, 1000.0, "pitches", "usual of sensors")] = 6.0
    """Thickness with which the search begins."""
    factor: Annotated[float, Option(1.0, 10.0, "-", "trials")] = 2.0
    """Between thicknesses that are tried at first."""
    thicknesses: Annotated[int, Option(1, 100, "-", "from a pitch to beyond a lattice of 20")] = 6
    """Tried at first, beside a half-space."""
    margin: Annotated[int, Option(0, 100, "nodes", "a contact may grow by so many rows under another gel")] = 3
    """Around all contacts, within which tractions are sought."""
    pressed: Annotated[float, Option(0.0, 1.0, "-", "Hertz's rim: half on a half-space, less on a layer")] = 0.4
    """Share of the largest depth to which markers are pressed in where a contact is first taken to be."""
    still: Annotated[float, Option(0.0, 1.0, "-", "trials")] = 0.95
    """Share of markers that move less sideways than those at the rim of a contact."""
    alternations: Annotated[int, Option(1, 100, "-", "bound")] = 3
    """Of seeking a contact and its prior."""
    held: Annotated[float, Option(0.0, 1.0, "-", "force sensors' tolerance")] = 0.01
    """Change of the displacement, as a share of it, up to which frames belong to a press's hold."""
    simplex: Annotated[float, Option(0.0, 1.0, "-", "trials")] = 0.1
    """Side of the first simplex, as a share of the larger of a quantity and this share of its range; of each later one,
    as a share of the last."""
    gels: Annotated[int, Option(0, 10_000, "gels", "bound")] = 60
    """Tried on the way to the most probable one, with the same contacts."""
    climbs: Annotated[int, Option(1, 100, "-", "bound")] = 3
    """Ways to the most probable gel, between which contacts are sought anew."""
    step: Annotated[float, Option(0.0, 1.0, "-", "trials")] = 2e-3
    """First step away from the most probable gel, as a share of the range."""
    close: Annotated[float, Option(0.0, 1000.0, "nats", "the rest follows from the Gaussian around the best one")] = (
        10.0
    )
    """Difference of log probability within which the way to the most probable gel ends."""
    fall: Annotated[float, Option(0.0, 10.0, "nats", "two standard deviations of a Gaussian")] = 2.0
    """By which the log probability is to fall over a step."""
    settled: Annotated[float, Option(0.0, 1.0, "nats", "a step goes at most six times as far as the last")] = 0.05
    """Fall that is taken for none."""
    rounds: Annotated[int, Option(1, 100, "steps", "bound")] = 4
    """Steps tried along each quantity."""
    near: Annotated[float, Option(0.0, 100.0, "nats", "four standard deviations")] = 8.0
    """Below the most probable gel, up to which gels decide the shape of the posterior."""
    reach: Annotated[float, Option(1.0, 100.0, "standard deviations", "all but 1e-6 of a Gaussian")] = 5.0
    """From the most probable gel, as far as the posterior is followed."""
    lattice: Annotated[int, Option(3, 10_000, "points", "1e-3 of a quantile")] = 161
    """Of the posterior, along each quantity."""
    least_precision: Annotated[float, Option(0.0, 1.0, "-", "trials")] = 1e-6
    """Of a quantity that nothing determines, in units of the steps tried."""
    confidence: Annotated[float, Option(0.5, 0.999, "-", "usual")] = 0.95
    """Of intervals."""
    half_space: Annotated[float, Option(0.0, 1.0, "-", "two standard deviations of a Gaussian")] = 0.135
    """Density of a half-space, over the largest, from which a gel may be one."""
    identified: Annotated[float, Option(0.0, 1.0, "-", "half of its variance before")] = 0.5
    """Share of a quantity's information from the presses, under which it is said to be the prior's."""
    resultant_error: Annotated[float, Option(0.0, 1.0, "-", "scenes")] = 2e-3
    """Standard deviation of what bilinear tractions and the shape of the contact leave wrong of a press's resultant, as
    a share of it."""
    young_modulus_error: Annotated[float, Option(0.0, 1.0, "-", "an ellipse, a cone, spheres and the scenes")] = 1e-2
    """Standard deviation of what bilinear tractions leave wrong of Young's modulus, as a share of it."""
    poisson_ratio_error: Annotated[float, Option(0.0, 0.1, "-", "an ellipse, a cone, spheres and the scenes")] = 3e-3
    """The same of Poisson's ratio."""
    thickness_error: Annotated[float, Option(0.0, 1.0, "-", "an ellipse, a cone, spheres and the scenes")] = 1.2e-2
    """The same of the thickness, as a share of it."""
    in_plane: Annotated[float, Option(1.0, 100.0, "-", "an ellipse, a cone, spheres and the scenes")] = 4.0
    """How many times larger these are where markers are seen in the plane alone."""


GEL = GelLimits()
NODES = NodeDefaults()
RESPONSE = ResponseDefaults()
PRIOR = PriorDefaults()
STRENGTH = StrengthDefaults()
SUPPORT = SupportDefaults()
FIT = FitDefaults()
OVER_TIME = OverTimeDefaults()
LATTICE = LatticeDefaults()
RECONSTRUCTION = ReconstructionDefaults()
FORCE_STREAM = ForceStreamDefaults()
GEL_CALIBRATION = GelCalibrationDefaults()

TABLES = (
    NODES,
    RESPONSE,
    PRIOR,
    STRENGTH,
    SUPPORT,
    FIT,
    OVER_TIME,
    LATTICE,
    RECONSTRUCTION,
    FORCE_STREAM,
    GEL_CALIBRATION,
)
"""All tables of forces from displacement."""
