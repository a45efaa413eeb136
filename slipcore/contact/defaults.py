"""Every default of the contact simulator, with unit, valid range and source.

"Trials": chosen by what the solver took at the same result; "rounding": what double precision leaves; "bound": stops
what does not converge, with an error. What ±50 % of each changes stands in docs/sensitivity.md.
"""

from dataclasses import dataclass
from typing import Annotated

from slipcore.options import Option, Options

TINY = 1e-300
"""Keeps quotients of numbers that may be zero finite; far below any force, length or square of them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RampDefaults(Options):
    """A fingertip, its sensor and the closed-form ramp: the paper's Condition 1 (Table I) and sensor (Section IV-A)."""

    friction: Annotated[float, Option(0.0, 10.0, "-", "paper, Table I")] = 0.4
    """Coulomb coefficient, above 0."""
    normal_force: Annotated[float, Option(0.0, 1e4, "N", "paper, Table I")] = 10.0
    """Above 0."""
    tangential_force: Annotated[float, Option(0.0, 1.0, "-", "0.99 ends Condition 1; leaves a stick circle")] = 0.95
    """In units of the sliding force μF_N."""
    sphere_radius: Annotated[float, Option(1e-4, 1.0, "m", "fingertip of the paper's Fig. 5")] = 15e-3
    young_modulus: Annotated[float, Option(1e2, 1e12, "Pa", "fingertip of the paper's Fig. 5")] = 1e6
    poisson_ratio: Annotated[float, Option(0.0, 0.5, "-", "silicone gels are nearly incompressible")] = 0.49
    points: Annotated[int, Option(2, 1000, "markers", "paper, Section IV-A")] = 20
    """Along each side."""
    pitch: Annotated[float, Option(1e-6, 0.1, "m", "a 14 mm wide field of the paper's 20 markers")] = 0.75e-3
    """Between markers."""
    frame_rate: Annotated[float, Option(1e-3, 1e6, "1/s", "paper, Section IV-A")] = 30.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ScheduleDefaults(Options):
    """Seconds of each phase of the closed-form ramp."""

    rest: Annotated[float, Option(0.0, 1e3, "s", "15 frames: enough for an estimate of noise")] = 0.5
    press: Annotated[float, Option(0.0, 1e3, "s", "a grasp closes within a second")] = 1.0
    settle: Annotated[float, Option(0.0, 1e3, "s", "separates pressing from shear")] = 0.5
    shear: Annotated[float, Option(0.0, 1e3, "s", "90 frames over the whole slip front")] = 3.0
    hold: Annotated[float, Option(0.0, 1e3, "s", "15 frames without motion")] = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneDefaults(Options):
    """What a scene is taken to be where it does not say so."""

    press_duration: Annotated[float, Option(1e-3, 1e3, "s", "a grasp closes within a second")] = 1.0
    duration: Annotated[float, Option(1e-3, 1e4, "s", "as long again for what follows the press")] = 2.0
    object_poisson_ratio: Annotated[float, Option(0.0, 0.5, "-", "most solids lie between 0.25 and 0.35")] = 0.3
    random_waves: Annotated[int, Option(16, 100_000, "waves", "values normal to the eye of any test of a scene")] = 256
    """Waves whose sum is a random field of friction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FidelityDefaults(Options):
    """How finely a scene is simulated where neither accuracy nor seconds are asked."""

    cells: Annotated[int, Option(4, 10_000, "cells", "a slip front to a sixteenth of the radius")] = 32
    """Across the largest contact."""
    substeps: Annotated[int, Option(1, 1000, "steps", "30 frames a second follow a grasp's load")] = 1
    """Load steps a frame."""
    tolerance: Annotated[float, Option(1e-12, 0.5, "-", "a tenth of what counts as at the limit")] = 1e-4
    """Of tractions, as a share of what a step changes."""
    normal_share: Annotated[float, Option(1e-6, 1.0, "-", "pressures then do not limit tractions")] = 1e-2
    """Tolerance of the gap as a share of that of tractions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LayerDefaults(Options):
    """Influence functions of a bonded layer (``elasticity/bonded_layer.py``)."""

    deepest_wave: Annotated[float, Option(10.0, 100.0, "-", "rounding: (kh)² exp(−2kh) = 4e-17 beyond")] = 22.0
    """From this kh on the base takes nothing from a wave."""
    far: Annotated[float, Option(4.0, 1000.0, "thicknesses", "a layer's response has decayed to 1e-16")] = 64.0
    """Beyond, a layer does not give way at all: the base takes the half-space's whole response."""
    panel_points: Annotated[int, Option(4, 200, "points", "exact to rounding for the phase of a panel")] = 24
    """Gauss points a panel of wave numbers."""
    panel_phase: Annotated[float, Option(1.0, 100.0, "rad", "24 points are then exact to rounding")] = 12.0
    """Largest change of kr and of kh over one panel."""
    degree: Annotated[int, Option(8, 1000, "-", "analytic for |Im asinh(r/2h)| < π/2: 1e-13 up to r = 1000 h")] = 96
    """Of the polynomials in asinh(r/2h)."""
    negligible: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-14
    """Coefficients of the polynomials that are left out, as a share of the largest."""
    cell_tolerance: Annotated[float, Option(1e-15, 1e-2, "-", "below the polynomials' error")] = 1e-12
    """Of Gauss quadrature over a cell, as a share of the function."""
    chunk: Annotated[int, Option(1, 1024, "cells", "growing boxes find their influence made")] = 32
    """It is made for multiples of so many cells a side, and cut to size."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InteriorDefaults(Options):
    """Displacement below the surface (``elasticity/interior.py``)."""

    cell_tolerance: Annotated[float, Option(1e-15, 1e-2, "-", "well below what any marker's noise shows")] = 1e-9
    """Of Gauss quadrature over a cell, as a share of the response."""
    near: Annotated[int, Option(1, 100, "cells", "beyond, the distance alone makes the response smooth")] = 4
    """Cells around the load that are integrated with as many points as the depth asks for."""
    most_points: Annotated[int, Option(2, 1000, "points", "enough from a thirtieth of the cell's side on")] = 96
    """Gauss points along one side of a cell near the load."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InfluenceDefaults(Options):
    """Influence functions of a half-space (``elasticity/influence.py``)."""

    near: Annotated[float, Option(2.0, 1000.0, "cells", "corner sums lose 24² = 576 roundings there")] = 24.0
    """Cells (of the longer side) within which corner sums are used."""
    gauss_points: Annotated[int, Option(1, 20, "points", "error (1/48)^8 < 1e-13 beyond 24 cells")] = 4
    """Points a direction beyond ``near``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NormalDefaults(Options):
    """Frictionless contact (``solver/normal.py``)."""

    tolerance: Annotated[float, Option(1e-14, 0.5, "-", "of a solution that others are compared with")] = 1e-8
    """Of the gap, as a share of the indentation, where none is asked."""
    active_sets: Annotated[int, Option(1, 10_000, "sets", "bound")] = 100
    """Most active sets on one box."""
    reduction: Annotated[float, Option(1e-6, 0.9, "-", "trials, 0.01 to 0.3: most sets are not the last")] = 0.3
    """How far each active set is relaxed, in the preconditioned residual."""
    iterations: Annotated[int, Option(1, 1000, "iterations", "an inexact solve is enough")] = 20
    """Most conjugate gradients an active set."""
    coarse_tolerance: Annotated[float, Option(1e-8, 0.5, "-", "below the discretisation error of coarse grids")] = 1e-3
    """On all grids but the finest."""
    coarsest: Annotated[int, Option(4, 1024, "cells", "trials: below it no coarser grid pays")] = 24
    """Cells a side."""
    memory: Annotated[int, Option(1, 100, "sets", "nonmonotone search: Grippo, Lampariello and Lucidi (1986)")] = 5
    """Active sets over whose energies a new one may climb."""
    energy_rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-12
    """Climb of the energy, as a share of it, that counts as none."""
    margin: Annotated[int, Option(1, 100, "cells", "contacts grow by few cells an active set")] = 3
    """Cells around the contact that its box leaves it to grow."""
    spread_edge: Annotated[float, Option(0.0, 0.5, "-", "interpolation spreads an edge by a quarter of a cell")] = 0.03
    """Pressures below this share of the largest are dropped after interpolation from a coarser grid."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TangentialDefaults(Options):
    """One step of tangential contact (``solver/tangential.py`` and ``solver/tangent_space.py``)."""

    tolerance: Annotated[float, Option(1e-14, 0.5, "-", "of a solution that others are compared with")] = 1e-8
    """Of the natural map, as a share of the largest limit, where none is asked."""
    newton_steps: Annotated[int, Option(1, 1000, "steps", "bound")] = 60
    reduction: Annotated[float, Option(1e-6, 0.9, "-", "trials, 0.05 to 0.12")] = 0.1
    """How far each Newton system is solved at least; further as Newton converges."""
    least_reduction: Annotated[float, Option(1e-6, 0.9, "-", "far above rounding of single precision")] = 1e-3
    """How far each is solved at most."""
    enough: Annotated[float, Option(0.01, 1.0, "-", "room for what the system does not show")] = 0.3
    """Of the tolerance: a system that leaves less is solved far enough."""
    motion_slack: Annotated[float, Option(0.0, 0.5, "-", "hardly shows in the residual")] = 0.01
    """Of the tolerance, by which the rigid motion may be off as a gradient step shows it."""
    iterations: Annotated[int, Option(1, 1000, "iterations", "an inexact solve is enough")] = 25
    """Most conjugate gradients a Newton step."""
    slow: Annotated[float, Option(0.0, 1.0, "-", "Newton's steps fall faster where they work")] = 0.9
    """A residual that does not fall to this share in a step is met by a gradient step every other time."""
    slope_rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-13
    """Of the work of slip at the limits, below which a slope is noise."""
    move_rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-14
    """Of the largest limit, below which a move is none."""
    far_start: Annotated[float, Option(0.0, 10.0, "-", "trials: Newton moves fronts by a few cells a step")] = 0.2
    """Residual of a start from which a coarser grid is asked first."""
    coarsest: Annotated[int, Option(4, 1024, "cells", "trials: below it no coarser grid pays")] = 24
    """Cells a side."""
    coarse_tolerance: Annotated[float, Option(1e-8, 0.5, "-", "below the discretisation error of coarse grids")] = 1e-3
    limit_margin: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-12
    """Loads this close to the limit surface, relative to it, are on it: all slides."""
    balance: Annotated[float, Option(1e-14, 1e-3, "-", "1.1e-10 on the limit surface, with room")] = 1e-9
    """Of the summed limits: a load that tractions miss by more is not carried, however small the residual."""
    circle_rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-12
    """Of its limit, by which a traction may fall short and still lie on it."""
    rank: Annotated[float, Option(1e-15, 1e-3, "-", "rounding")] = 1e-12
    """Share of the largest eigenvalue from which a rigid motion lies in the space of moves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProjectionDefaults(Options):
    """Nearest tractions within the limits and of a given resultant (``solver/projection.py``)."""

    tight: Annotated[float, Option(1e-15, 1e-3, "-", "what rounding allows to reach")] = 2e-14
    """Imbalance, as a share of the sum of the radii."""
    block: Annotated[int, Option(1, 100_000, "cells", "plain sums of more round one way, and miss ``tight``")] = 256
    """Cells summed at a time."""
    newton_steps: Annotated[int, Option(1, 1000, "steps", "bound")] = 60
    search_steps: Annotated[int, Option(1, 1000, "steps", "bound")] = 60
    slope: Annotated[float, Option(0.01, 0.99, "-", "usual of inexact searches")] = 0.5
    """A search ends where the slope along it has fallen to this share."""
    growth: Annotated[float, Option(1.1, 100.0, "-", "usual of bracketing")] = 4.0
    """Factor on the length of a search that has not found a bracket."""
    bracket: Annotated[float, Option(0.0, 0.5, "-", "usual of safeguarded false position")] = 0.1
    """Share of a bracket at either end where false position does not look."""
    longest: Annotated[float, Option(1.0, 1e12, "steps", "φ is then as good as linear along it")] = 1e6
    """Steps a search may grow to."""
    flat: Annotated[float, Option(1e2, 1e15, "-", "φ is flat to rounding beyond: the load is at its limit")] = 1e7
    """Dual, as a multiple of the largest traction and radius."""
    ridge: Annotated[float, Option(1e-15, 1e-3, "-", "rounding")] = 1e-13
    """Least pivot of Newton's system, as a share of its diagonal."""
    certificate: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-12
    """By how much more the load must work on a motion than friction takes up, to be refused."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitSurfaceDefaults(Options):
    """How far a load is from the limit of friction (``limit_load.py``)."""

    descents: Annotated[int, Option(1, 100_000, "steps", "bound")] = 500
    still: Annotated[float, Option(1e-15, 1e-3, "-", "a weight must not overflow")] = 1e-12
    """Share of the fastest motion below which a cell counts as the motion's centre."""
    settled: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-15
    """Relative descent at which the factor is found."""
    rank: Annotated[float, Option(1e-16, 1e-3, "-", "rounding")] = 1e-14
    """Least polar moment of the friction's weights about their centre, as a share of that about the origin."""
    free_motion: Annotated[float, Option(0.0, 0.1, "-", "far above rounding, far below any load")] = 1e-6
    """Share of a load that may be missed before some motion is taken to meet no friction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StepDefaults(Options):
    """A load step (``solver/quasi_static.py``, ``step_equations.py``, ``touching.py``, ``slip_rate.py``,
    ``extrapolation.py``, ``resolution.py``).
    """

    tolerance: Annotated[float, Option(1e-12, 0.5, "-", "of a solution that others are compared with")] = 1e-5
    """Of tractions, relative to what a step can change, where none is asked."""
    normal_tolerance: Annotated[float, Option(1e-14, 0.5, "-", "a hundredth of that")] = 1e-7
    """Of the gap, relative to the indentation, where none is asked."""
    at_limit: Annotated[float, Option(0.0, 0.1, "-", "paper, eq. 36, with room for the solver's tolerance")] = 1e-3
    """A cell whose traction is within this share of its limit is at it."""
    moved: Annotated[float, Option(0.0, 0.1, "-", "the same for motion")] = 1e-3
    """A cell that slips more than this share of the object's motion in the step moves against it."""
    noise: Annotated[float, Option(0.0, 1000.0, "tolerances", "ten times the error of a solution")] = 10.0
    """What a cell must slip at least, in units of the tolerance on traction times its compliance."""
    least_share: Annotated[float, Option(1e-12, 1.0, "-", "rounding comes near")] = 1e-3
    """Tolerances follow a step's increment down to this share of the contact's capacity."""
    unknown_share: Annotated[float, Option(1e-12, 1.0, "-", "a grasp's load in a hundred steps")] = 1e-2
    """The share where motion is given and the increment of load not known."""
    box_multiple: Annotated[int, Option(1, 64, "cells", "a growing contact meets few new operators")] = 4
    """Boxes grow by so many cells."""
    outer_iterations: Annotated[int, Option(1, 1000, "iterations", "bound")] = 100
    """Of coupling and of velocity-dependent friction."""
    mixing_depth: Annotated[int, Option(1, 20, "points", "trials, 1 to 8: thin layers need 4, others no more")] = 4
    """Earlier points that the next one of such an iteration is mixed of."""
    mixing_rank: Annotated[float, Option(1e-15, 1e-3, "-", "rounding of products")] = 1e-10
    """Share of the largest eigenvalue from which a combination of these points counts."""
    pressure_by_lift: Annotated[float, Option(0.1, 100.0, "-", "π²/2 for a sphere (Hertz)")] = 5.0
    """Change of pressure, as a share of its largest, by a lift as a share of the indentation."""
    coupling_start: Annotated[float, Option(1e-8, 1.0, "-", "order of Dundurs' β at ν = 0.49")] = 1e-2
    """What the first guess of the lift is taken to be off by, in the same measure."""
    inexact: Annotated[float, Option(1e-4, 1.0, "-", "trials: 0.3 misled the mixing, and took twice the work")] = 0.01
    """Of the last change of the lift: how far contact is solved under one that will change again."""
    coupling_margin: Annotated[float, Option(1.0, 1000.0, "-", "what a fixed point has still to go, with room")] = 10.0
    """Changes of the lift must be so much smaller than the tolerance."""
    longest_extrapolation: Annotated[float, Option(0.0, 10.0, "-", "loads seldom grow twice as fast as before")] = 2.0
    """Most of the last step's change that the next one's start repeats."""
    barred_tolerance: Annotated[float, Option(1.0, 1e4, "-", "trials: 1 to 1000 made no difference")] = 10.0
    """Tolerances of the motion of cells before they touch, in units of the step's own."""
    steady: Annotated[float, Option(0.0, 1.0, "-", "a load in ten steps a quarter of its period is")] = 0.3
    """Change of a load's rate, as a share of it, up to which the rate of slip goes on, too."""
    rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-12
    """Change of a load, as a share of it, that is none."""
    sliding_step: Annotated[float, Option(1e-6, 1.0, "s", "a light object on a soft finger turns back in 5 ms")] = (
        1.4e-3
    )
    """Longest step of an object that moves by itself (``solver/macro_slip.py``)."""
    longest_step: Annotated[float, Option(1.0, 2.4, "-", "backward differences are stable up to 1 + √2")] = 2.0
    """Longest step, in units of the one before, to which its rate of slip goes on."""
    contact_cells: Annotated[float, Option(1.0, 100.0, "cells", "pressures are off by 2 to 6 % below")] = 6.0
    """Radius of a contact that the grid resolves."""
    slip_cells: Annotated[float, Option(0.1, 100.0, "cells", "tractions are off by 6 to 14 % below")] = 1.0
    """Width of a slip zone that the grid resolves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeDefaults(Options):
    """Of stress at the centres of cells along an edge (``tiers/edges.py``); trials on 11 to 180 cells."""

    depth: Annotated[float, Option(1.0, 20.0, "cells", "deeper ones are right to 0.004 cells")] = 4.0
    """Within the edge, up to which cells are corrected."""
    beside: Annotated[float, Option(0.0, 5.0, "cells", "those that an edge may run through")] = 1.0
    """Beyond the edge, up to which the field goes on."""
    window: Annotated[float, Option(2.0, 10.0, "cells", "smaller ones leave too few cells within a corner")] = 3.2
    """Around a cell, of the parabola that tells the slope there."""
    rounds: Annotated[int, Option(1, 20, "rounds", "slope and correction agree to 1e-3 cells")] = 3
    apart: Annotated[float, Option(0.0, 20.0, "cells", "what an edge changes falls with its square")] = 2.0
    """From an edge of stick, up to which what an earlier one left is taken as gone."""
    table_reach: Annotated[float, Option(0.5, 5.0, "√cells", "the excess falls as 1/d beyond")] = 1.4
    """Of ``tiers/edge_cells.csv``: root of the largest distance."""
    rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-9
    """Of the squares in a window, added where its cells are too few for a parabola."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbeDefaults(Options):
    """How far a contact reaches, found on a coarse grid (``tiers/probe.py``)."""

    cells: Annotated[int, Option(8, 1024, "cells", "finds the edge to 4 %")] = 48
    tolerance: Annotated[float, Option(1e-8, 0.5, "-", "below the discretisation error")] = 1e-3
    room: Annotated[float, Option(1.0, 2.0, "-", "half a cell of the probe, and more")] = 1.06
    """Factor on the reach, for what the probe misses at its edge."""
    first_reach: Annotated[float, Option(1e-6, 1.0, "m", "a fingertip's contact")] = 4e-3
    """Where the search begins; the result of a search without contact."""
    tries: Annotated[int, Option(1, 100, "grids", "a reach of 4 mm doubled 20 times is 4 km")] = 20
    fills: Annotated[float, Option(0.5, 1.0, "-", "the edge must be seen")] = 0.95
    """Share of the grid that a contact may fill before the grid is doubled."""
    least: Annotated[float, Option(0.01, 0.9, "-", "the edge must be seen to a few per cent")] = 0.3
    """Share of the grid that it must fill."""
    shrink: Annotated[float, Option(1.0, 3.0, "-", "between the two above")] = 1.5
    """Next reach over the extent of a contact that fills less."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AccuracyDefaults(Options):
    """Accuracy on request (``tiers/accuracy.py``)."""

    safety: Annotated[float, Option(1.0, 10.0, "-", "estimates were 1.3 to 6 times the true errors without it")] = 1.25
    """Factor on estimated errors, which fall with the cell size on average only."""
    step_share: Annotated[float, Option(0.01, 0.99, "-", "steps cost less than cells")] = 0.3
    """Of the asked accuracy that load steps may use up; the rest is the grid's."""
    solver_share: Annotated[float, Option(1e-6, 1.0, "-", "the solver then does not count")] = 1e-2
    """Of the asked accuracy that the solver's tolerance is."""
    loosest: Annotated[float, Option(1e-8, 0.5, "-", "the contact-factor threshold")] = 1e-3
    """Largest tolerance of the solver."""
    timed_tolerance: Annotated[float, Option(1e-8, 0.5, "-", "as of a fidelity that is not asked")] = 1e-4
    """Tolerance where seconds are asked, not an accuracy."""
    tightest: Annotated[float, Option(1e-12, 0.1, "-", "rounding comes near in steps that change little")] = 1e-7
    """Least tolerance of the solver."""
    coarsest_cells: Annotated[int, Option(4, 1000, "cells", "half of them see a slip front")] = 12
    coarsest_error: Annotated[float, Option(1e-3, 1.0, "-", "random scenes: 0.1 to 0.3")] = 0.15
    """On the coarsest grid, for what ``progress`` expects before the first estimate."""
    more_ahead: Annotated[float, Option(1.0, 10.0, "-", "an estimate may ask for one more grid")] = 1.25
    """Work that ``progress`` expects over that of the runs which should do."""
    finest_cells: Annotated[int, Option(16, 100_000, "cells", "minutes a frame beyond")] = 700
    most_substeps: Annotated[int, Option(1, 10_000, "steps", "halving further adds nothing")] = 64
    fewest_frames: Annotated[int, Option(3, 1000, "frames", "half of fewer show little of a path")] = 8
    """From which on a log of half the frames shows what load steps leave."""
    least_growth: Annotated[
        float, Option(1.05, 1.5, "-", "less would show too little; above first_growth no grid is far enough")
    ] = 1.3
    """Of cells from one grid to the next, at least."""
    last_growth: Annotated[float, Option(1.01, 10.0, "-", "a few per cent more cells are hardly better")] = 1.12
    """The same for what is left of a budget."""
    first_growth: Annotated[float, Option(1.05, 10.0, "-", "twice the cells cost 1.5 to 3 times as much")] = 1.6
    """From the first grid to the second, and along a curve."""
    largest_growth: Annotated[float, Option(1.05, 10.0, "-", "more would trust one estimate too far")] = 2.5
    overshoot: Annotated[float, Option(1.0, 10.0, "-", "a grid too many costs more than cells")] = 1.15
    """Factor on the cells that should meet the target."""
    usual_order: Annotated[float, Option(0.5, 3.0, "-", "random scenes")] = 1.5
    """Of displacement and force in the cell size."""
    usual_ratio_order: Annotated[float, Option(0.5, 3.0, "-", "random scenes: 1.0 to 1.7, by twice as fine grids")] = (
        1.4
    )
    """The same of the stick ratio."""
    step_order: Annotated[float, Option(0.5, 2.0, "-", "accuracy-contact.md: 1.5 to 1.9")] = 1.5
    """Of what load steps leave, for what can be reached."""
    cost_order: Annotated[float, Option(1.0, 2.0, "-", "random scenes, 60 to 280 cells across: 1.06 to 1.2")] = 1.08
    """Power of a grid's cells with which a load step takes longer."""
    overhead_cells: Annotated[float, Option(0.0, 1e6, "cells", "Table I, lifting and cup: 2,700 to 5,000")] = 4000.0
    """What costs as much in a load step as all that does not grow with the grid, where it was not measured."""
    overhead_spread: Annotated[float, Option(1.0, 100.0, "-", "coupled and layered scenes lie within")] = 4.0
    """Factor that runs may change it by, either way."""
    telling_growth: Annotated[float, Option(1.05, 100.0, "-", "times of smaller ones differ by noise")] = 1.5
    """Of a grid's cells from which on two runs show what costs what."""
    held_back: Annotated[float, Option(0.0, 0.5, "-", "prices are off by a tenth")] = 0.08
    """Part of a budget that no run is planned into."""
    scouting_share: Annotated[float, Option(0.01, 0.9, "-", "the last run should have most of it")] = 0.2
    """Of what is left of a budget: a run between the last one and the one that uses it up."""
    overdrawn: Annotated[float, Option(1.0, 10.0, "-", "a fifth is allowed")] = 1.15
    """Part of a budget beyond which a run is ended."""
    telling_part: Annotated[float, Option(0.01, 1.0, "-", "presses take less, and slip more, a frame")] = 0.4
    """Part of a run from which on it shows how long the whole takes."""
    least_part: Annotated[float, Option(1e-6, 0.5, "-", "a frame of a hundred")] = 0.01
    runs_at_least: Annotated[float, Option(1.0, 20.0, "-", "half the frames, all of them, a finer grid")] = 5.0
    """Cost of a first log with its error, in runs of half the frames on the coarsest grid."""
    rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-9
    points: Annotated[int, Option(2, 1000, "points", "a scene without a sensor")] = 32
    """Points a side at which logs of a scene without a sensor are compared."""
    frames: Annotated[int, Option(2, 100_000, "frames", "two seconds at 30 frames a second")] = 60
    """Frames of a scene without a sensor."""
    flattest: Annotated[float, Option(1e-9, 1e-2, "-", "rounding of the squares that it divides")] = 1e-5
    """Of a field across a front (``tiers/fronts.py``): least slope, as a share of that in the other direction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheapTierDefaults(Options):
    """What the closed-form tier and the beam tier are known to miss."""

    beam_error: Annotated[float, Option(0.0, 10.0, "-", "0.40 measured over the library's scenes")] = 0.5
    """Largest error of stick ratio, displacement and force of the beams."""
    beam_cells: Annotated[int, Option(4, 64, "cells", "one a sensor element, as the paper has it")] = 4
    beam_room: Annotated[int, Option(1, 64, "grids", "the lattice's ends then do not count")] = 8
    """How much wider than the grid lattices are when their compliance is computed."""
    beam_tolerance: Annotated[float, Option(1e-8, 0.5, "-", "far below what beams miss")] = 1e-3
    element_samples: Annotated[int, Option(1, 100, "samples", "their error is part of ``sampling_error``")] = 8
    """Samples a side of each element over which the closed form's force is summed."""
    sampling_error: Annotated[float, Option(0.0, 1.0, "-", "1.4e-3 measured")] = 3e-3
    """What these and a stick ratio without a threshold leave at ν = 0."""
    poisson_error: Annotated[float, Option(0.0, 1.0, "-", "0.035 measured: loading, unloading, near sliding")] = 0.05
    """By ν, of what Mindlin and Deresiewicz's rule leaves out."""
    limit_rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding of the closed form")] = 1e-9
    """A point of the ramp is at the Coulomb limit where |f_t| ≥ (1 − this) μ f_n."""
    rounding: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-12
    """Relative change of a load, and of a time, that is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplainDefaults(Options):
    """When ``Scene.explain`` proposes an effect (``scene/explain.py``)."""

    cells: Annotated[int, Option(4, 1000, "cells", "shows which effects count, not how much to the last per cent")] = 10
    """Fidelity of the coarse runs."""
    frames: Annotated[int, Option(2, 1000, "frames", "the same")] = 12
    tolerance: Annotated[float, Option(1e-8, 0.5, "-", "below the error of ten cells")] = 1e-3
    most_runs: Annotated[int, Option(1, 1000, "runs", "a scene with four effects of mechanics")] = 5
    """That are made without being asked for."""
    negligible: Annotated[float, Option(0.0, 1.0, "-", "the coarse runs' tolerance")] = 1e-3
    """Change of stick ratio, displacement and force below which an effect may be left out."""
    layer_ratio: Annotated[float, Option(0.0, 10.0, "-", "Garcia & Garcia, Biophys. J. 114 (2018) 2923")] = 0.08
    """Contact radius over thickness from which a base stiffens a gel of ν = 0.5 by 10 %: 1 + 1.133χ + 1.497χ² + …"""
    coupling_ratio: Annotated[float, Option(0.0, 10.0, "-", "Spence, J. Elasticity 5 (1975) 297")] = 0.1
    """Dundurs' β over μ from which pressing alone makes slip that counts."""
    layer_shear: Annotated[float, Option(0.0, 10.0, "-", "boundary elements: 5 mm of gel at ν = 0.49")] = 0.29
    """Share of μp₀ that pressing shears a bonded layer by."""
    moment_share: Annotated[float, Option(0.0, 1.0, "-", "a twentieth of what friction carries")] = 0.05
    """Of friction's moment μF_N a that an off-centre contact takes from a force through the sensor's origin."""
    fewest_points: Annotated[int, Option(1, 1000, "points", "the edge alone holds 1 − (3/4)² = 0.44 of the area")] = 4
    """Sensor points along a contact radius."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldDefaults(Options):
    """The reduced world of closed loops (``reduced/``)."""

    gravity: Annotated[float, Option(0.0, 100.0, "m/s²", "standard, two digits")] = 9.81
    gyration: Annotated[float, Option(1e-4, 1.0, "m", "an object of 10 cm")] = 0.03
    """Radius of gyration of the object."""
    gripper_lag: Annotated[float, Option(1e-4, 10.0, "s", "order of electric parallel grippers")] = 0.03
    """Of the normal force behind its command."""
    gel_time: Annotated[float, Option(0.0, 1.0, "s", "loss over storage of 0.1 at 5 Hz")] = 3e-3
    """Viscous part of the gel's compliance over its elastic one."""
    time_step: Annotated[float, Option(1e-6, 0.1, "s", "a thirtieth of a frame")] = 1e-3
    sweeps: Annotated[int, Option(1, 1000, "sweeps", "each step begins from the last one's forces")] = 3
    """Over the bristles, in each step."""
    most_stiff: Annotated[float, Option(0.1, 4.0, "-", "half of that at which steps become unstable")] = 2.0
    """Largest h (h + 2τ) K/m."""
    rest: Annotated[float, Option(0.0, 0.1, "-", "a hundredth of what three sweeps leave")] = 3e-4
    """Share of its limit by which a bristle's force must change in a step, or wait."""
    at_limit: Annotated[float, Option(0.5, 1.0, "-", "an object that comes to rest goes back by a little")] = 0.98
    """Share of its limit from which a bristle counts as slipping."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceDefaults(Options):
    """Numerics of the closed-form references (``reference/``)."""

    beam_tolerance: Annotated[float, Option(1e-15, 1e-2, "-", "rounding of the sums, with room")] = 1e-10
    """Largest violation of a beam's equilibrium, as a share of the largest Coulomb limit."""
    beam_sweeps: Annotated[int, Option(1, 10_000_000, "sweeps", "bound")] = 20_000
    load_tolerance: Annotated[float, Option(1e-15, 1e-2, "-", "a tenfold of that")] = 1e-9
    """Largest imbalance of a given load, as a share of the summed limits."""
    inner_share: Annotated[float, Option(1e-6, 1.0, "-", "differences of the outer search must show")] = 1e-3
    """Tolerance of the beams within the search for a load's pose, as a share of ``beam_tolerance``."""
    pose_step: Annotated[float, Option(1e-12, 1e-2, "-", "root of the inner tolerance")] = 1e-7
    """Relative step of that search's differences."""
    pose_tolerance: Annotated[float, Option(1e-15, 1e-2, "-", "below ``load_tolerance``")] = 1e-10
    first_pose: Annotated[float, Option(0.01, 100.0, "-", "poses change little from step to step")] = 0.1
    """Bound of the search's first step (Powell's ``factor``)."""
    beam_noise: Annotated[float, Option(0.0, 1000.0, "tolerances", "ten times the error of a solution")] = 10.0
    """Least motion of a beam that slips, in units of the tolerance over its stiffness."""
    at_limit: Annotated[float, Option(0.0, 0.1, "-", "far above ``beam_tolerance``")] = 1e-6
    """A beam whose force is within this share of its limit is at it."""
    bottomless: Annotated[float, Option(10.0, 1e4, "-", "exp(−2kh) is 0 in double precision beyond")] = 400.0
    """From this kh on a layer is a half-space to the last bit."""
    series_below: Annotated[float, Option(0.0, 3.0, "-", "the difference would lose 1/x² of its digits")] = 1.0
    """Argument below which x − sin x is summed as a series."""
    line_nodes: Annotated[int, Option(8, 1000, "nodes", "integrals to rounding")] = 48
    """Of Lee and Radok's integrals."""
    torsion_nodes: Annotated[int, Option(8, 1000, "nodes", "integrals to rounding")] = 96
    """Of Lubkin's integrals."""


RAMP = RampDefaults()
SCHEDULE = ScheduleDefaults()
SCENE = SceneDefaults()
FIDELITY = FidelityDefaults()
LAYER = LayerDefaults()
INTERIOR = InteriorDefaults()
INFLUENCE = InfluenceDefaults()
NORMAL = NormalDefaults()
TANGENTIAL = TangentialDefaults()
PROJECTION = ProjectionDefaults()
LIMIT_SURFACE = LimitSurfaceDefaults()
STEP = StepDefaults()
EDGES = EdgeDefaults()
PROBE = ProbeDefaults()
ACCURACY = AccuracyDefaults()
CHEAP_TIERS = CheapTierDefaults()
EXPLAIN = ExplainDefaults()
WORLD = WorldDefaults()
REFERENCE = ReferenceDefaults()

TABLES = (
    RAMP, SCHEDULE, SCENE, FIDELITY, LAYER, INTERIOR, INFLUENCE, NORMAL, TANGENTIAL, PROJECTION, LIMIT_SURFACE, STEP,
    EDGES, PROBE, ACCURACY, CHEAP_TIERS, EXPLAIN, WORLD, REFERENCE,
)  # fmt: skip
"""All tables of the simulator."""
