"""Every default of estimators, with unit, valid range and source.

"Trials": chosen by benchmarks/estimators on simulated samples, at the same result; "bound": stops what does not
converge, with an error or with what was found. What ±50 % of each changes stands in docs/sensitivity.md.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from slipcore.options import Option, Options


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference(Options):
    """What matters to a grasp: the spans over which a slope is of consequence, and the size of the quantities."""

    tangential_velocity: Annotated[float, Option(1e-9, 10.0, "m/s", "incipient slip runs at 0.1 to 10 mm/s")] = 5e-3
    pressure: Annotated[float, Option(1.0, 1e8, "Pa", "a fingertip of 1 to 2 cm² that carries 5 to 10 N")] = 5e4
    friction: Annotated[float, Option(1e-3, 10.0, "-", "between polished metal, 0.1, and rubber on dry paper, 1")] = 0.5
    scatter: Annotated[float, Option(1e-6, 1.0, "-", "a tenth of the friction itself")] = 0.05
    """Standard deviation of friction between elements."""

    def spans(self, element_area: float) -> NDArray[np.float64]:
        """Spans [2] of v (m/s) and of an element's f_n (N), from the area of the element in m²."""
        return np.array([self.tangential_velocity, self.pressure * element_area])


@dataclass(frozen=True, slots=True, kw_only=True)
class Identifiability(Options):
    """When a coefficient counts as known."""

    effect: Annotated[float, Option(0.0, 1.0, "-", "a tenth of a grip force is a usual margin")] = 0.1
    """Largest half-width of its interval, as a change of μ over the span, in parts of the mean μ."""
    prior_shift: Annotated[float, Option(0.0, 10.0, "standard deviations", "the data say more than the prior")] = 0.5
    """Largest move of a known coefficient when the prior is made twice as wide."""
    collinear: Annotated[float, Option(1e-14, 1e-6, "-", "rounding of float32 samples squared")] = 1e-10
    """Smallest singular value of the equilibrated regressors that still counts as a direction."""
    ill_conditioned: Annotated[float, Option(1.0, 1e15, "-", "three digits lost")] = 1e3
    """Scaled condition number from which the factor is computed again in extended precision."""
    hidden: Annotated[float, Option(1e-15, 0.1, "-", "rounding")] = 1e-8
    """Share in a direction that is not seen from which a coefficient is not identified."""
    rounding: Annotated[float, Option(1.0, 1000.0, "ulp", "rounding of a mean of many")] = 8.0
    """Spread of a column, in units of its mean's last digit, up to which it is constant."""
    compared: Annotated[int, Option(1, 1000, "sensors", "their pairs, of those that differ most, are few")] = 4
    """With the largest gains and with the least: of so many twice, all pairs are compared."""
    interval: Annotated[float, Option(0.5, 0.9999, "-", "custom")] = 0.95
    """Level of the intervals that are reported and that calibrated standard errors are made for."""

    @property
    def ends(self) -> tuple[float, float]:
        """Probabilities below the interval's two ends."""
        tail = round(0.5 * (1.0 - self.interval), 15)
        return tail, 1.0 - tail


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior(Options):
    """Weak conjugate prior: β | σ² ~ N((μ₀, 0, 0), σ² V₀), σ² ~ IG(ν₀/2, ν₀ s₀²/2).

    V₀ is such that at σ = s₀ the standard deviation of β₀ is ``width``, and that of each slope changes μ by ``width``
    over its reference span: the prior weighs as much as (s₀/width)² = 1/400 of one sample.
    """

    width: Annotated[float, Option(1e-3, 1e3, "-", "no known pair of dry surfaces lies outside 0.5 ± 2")] = 1.0
    degrees_of_freedom: Annotated[float, Option(1e-6, 100.0, "-", "as much as a tenth of one sample says of σ")] = 0.1
    """ν₀."""
    effect_degrees_of_freedom: Annotated[float, Option(1.0, 100.0, "-", "weak, yet with a mean and a variance")] = 4.0
    """Of the half-Student-t prior of the scatter between places."""
    grasp_scatter: Annotated[float, Option(1e-4, 10.0, "-", "over materials 7 to 24 %: the prior's median is 5 %")] = (
        0.07
    )
    """Scale of the half-Student-t prior of the scatter between grasps, as a part of the friction itself."""
    grasp_degrees_of_freedom: Annotated[float, Option(1.0, 100.0, "-", "one in ten lies above 13 %")] = 7.0
    """Of that prior. Three leave a single grasp without any model at a slip probability of 1e-3."""
    sensor_scatter: Annotated[float, Option(1e-4, 10.0, "-", "two forces, each calibrated to 5 %: their ratio")] = 0.07
    """Scale of the half-Student-t prior of how much sensors differ in f_t/f_n, as a part of it."""
    sensor_degrees_of_freedom: Annotated[float, Option(1.0, 100.0, "-", "weak: two hardly show their scale")] = 4.0
    """Of that prior."""
    least_span: Annotated[float, Option(1e-9, 1.0, "-", "where all are equal, any prior of a slope is one")] = 1e-3
    """Least part of the largest value of v or f_n that counts as the range seen."""
    velocity_effect: Annotated[float, Option(1e-4, 10.0, "-", "a usual margin, as of what is identifiable")] = 0.1
    """Standard deviation of what velocity changes over its reference span, as a part of friction, where the size of
    β₁ matters and no sample shows it."""
    least_velocity_effect: Annotated[
        float, Option(1e-4, 10.0, "-", "gouge and a bench at 1 µm/s to 0.2 mm/s: 0.1 to 6 %, root mean square 4.4")
    ] = 0.05
    """The least of it from rest to the speed of slip, however slow, where no sample shows β₁."""
    contradicted: Annotated[float, Option(1.0, 100.0, "standard deviations", "one in 370 lies beyond")] = 3.0
    """Of both together, beyond which a slope that samples show contradicts that."""
    unknown_velocity: Annotated[float, Option(1e-6, 1.0, "m/s", "incipient slip: 0.1 to 10 mm/s")] = 1e-3
    """Root mean square of those unknown: then 2 % of friction; of rocks it is 1 to 3 % a decade (Marone, 1998)."""
    velocity_tilt: Annotated[float, Option(0.0, 10.0, "-", "a third slower or faster at half the force")] = 0.5
    """Standard deviation of the power k with which unknown velocities go with f_n."""
    nu_shape: Annotated[float, Option(0.1, 100.0, "-", "Juárez & Steel, J. Bus. Econ. Stat. 28 (2010) 52")] = 2.0
    """Shape of the gamma prior of the degrees of freedom of Student-t errors."""
    nu_rate: Annotated[float, Option(1e-4, 10.0, "-", "Juárez & Steel (2010): mean 20, any tails")] = 0.1
    """Its rate."""
    clean: Annotated[float, Option(1.0, 100.0, "-", "a sixth of the samples on average, none as likely as any")] = 4.0
    """Part of outliers π ~ Beta(1, this) below ½; with a majority the two components would trade places."""
    outlier_ratio: Annotated[float, Option(0.1, 1000.0, "-", "outliers as narrow as the rest are none")] = 6.0
    """Median of the scatter of outliers over that of the rest, less 1 (log-normal)."""
    outlier_ratio_spread: Annotated[float, Option(0.01, 10.0, "-", "3.6 to 9.9 within one deviation")] = 0.5
    """Standard deviation of its logarithm."""
    outlier_offset: Annotated[float, Option(-10.0, 10.0, "-", "below the plane, as false slip is")] = -0.1
    """Mean of the outliers' mean residual (normal)."""
    outlier_offset_spread: Annotated[float, Option(0.001, 10.0, "-", "either side is possible")] = 0.2
    """Standard deviation of it."""
    force_noise: Annotated[float, Option(1e-4, 10.0, "-", "forces reconstructed to a few per cent")] = 0.05
    """Scale of the half-Student-t prior of the noise of forces, in parts of the root mean square of f_n."""
    most_noise: Annotated[float, Option(0.1, 1.0, "-", "of what varies, some is real")] = 0.98
    """Largest square of that noise, as a share of the variance of the measured f_n."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PopulationSettings(Options):
    """What other materials say of how much grasps of one differ (``population.py``)."""

    fewest: Annotated[int, Option(2, 1000, "grasps", "three differences: fewer leave τ to its prior")] = 4
    """Of a material that counts."""
    outlier_share: Annotated[float, Option(0.0, 1.0, "-", "one in ten: an odd one decides nothing")] = 0.1
    """Probability that a material is none of the population but any."""
    quantiles: Annotated[int, Option(4, 10_000, "quantiles", "ratios of priors to a few per cent")] = 32
    """Of a material's information on τ, that are averaged over."""
    least: Annotated[float, Option(1e-6, 0.1, "-", "below what any sensor repeats")] = 1e-3
    """Scale of the population's τ from which is summed."""
    most: Annotated[float, Option(0.1, 100.0, "-", "absurd")] = 3.0
    """To which is summed."""
    nodes: Annotated[int, Option(5, 10_000, "nodes", "7 % apart: closer than any population is known")] = 121
    """Of that sum, at equal ratios."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainSettings(Options):
    """How a posterior is sampled, and when the sampling stops."""

    fewest_walkers: Annotated[int, Option(8, 10_000, "walkers", "emcee wants more than twice the dimension")] = 16
    """Even."""
    most_walkers: Annotated[int, Option(8, 100_000, "walkers", "shares a call's overhead within one block")] = 440
    """Even."""
    block: Annotated[int, Option(1, 10_000, "steps", "50 τ of a good proposal, enough for R̂")] = 130
    """Before the first look at the chain."""
    batch: Annotated[int, Option(1, 1000, "steps", "shares a call's overhead")] = 10
    """Whose proposals are drawn and looked at together."""
    chain_lengths: Annotated[float, Option(5.0, 1000.0, "τ", "emcee's rule")] = 50.0
    """Steps in units of the integrated autocorrelation time, from which that time is trusted."""
    window: Annotated[float, Option(1.0, 100.0, "τ", "Sokal (1989); emcee's")] = 5.0
    """Lags that the time is summed over; steps of the chain that are dropped as burn-in."""
    longest_series: Annotated[int, Option(1000, 10_000_000, "draws", "τ to a few per cent")] = 2**15
    """Draws that the time is read from."""
    accuracy: Annotated[float, Option(1e-4, 1.0, "standard deviations", "an effective sample size of 10,000")] = 0.02
    """Monte-Carlo error of mean, 5 % and 95 % quantile at which sampling stops."""
    accuracy_per_sample: Annotated[float, Option(1e-4, 1.0, "standard deviations", "a sample size of 2,000")] = 0.05
    """The same where each step of each walker reads all samples."""
    accuracy_of_scales: Annotated[float, Option(1e-4, 1.0, "standard deviations", "the rest is known exactly")] = 0.05
    """The same where only scales are sampled: coefficients, known exactly given them, come out ten times better."""
    max_steps: Annotated[int, Option(10, 1_000_000, "steps", "bound")] = 3000
    min_acceptance: Annotated[float, Option(0.0, 1.0, "-", "trials")] = 0.3
    """Acceptance of the independence proposal below which differential evolution takes over."""
    proposal_degrees_of_freedom: Annotated[float, Option(1.0, 1000.0, "-", "heavier tails than a posterior's")] = 10.0
    """Of the multivariate Student-t proposal: an acceptance of 0.88."""
    local: Annotated[float, Option(0.0, 1.0, "-", "trials")] = 0.25
    """Part of small steps where the proposal's weights are uneven: they free walkers stuck in a tail."""
    local_slowness: Annotated[float, Option(1.0, 100.0, "-", "trials: small steps make chains so much slower")] = 3.0
    """By which the number of walkers is then larger."""
    local_step: Annotated[float, Option(0.01, 100.0, "-", "Gelman, Roberts & Gilks (1996)")] = 2.4
    """Standard deviation of small steps, times √dimension."""
    even: Annotated[float, Option(0.0, 1.0, "-", "trials")] = 0.85
    """Evenness of the proposal's weights (effective number over number) from which no small steps are taken."""
    max_split_rhat: Annotated[float, Option(1.0, 2.0, "-", "Vehtari et al., Bayesian Analysis 16 (2021) 667")] = 1.01
    kept_draws: Annotated[int, Option(1, 1_000_000, "draws", "quantiles of 1 % to a tenth of it")] = 4000
    """Draws that a model keeps."""
    tail: Annotated[float, Option(0.001, 0.5, "-", "Vehtari et al. (2021)")] = 0.05
    """Probability beyond the quantiles, one on either side, whose error is watched."""
    candidates: Annotated[int, Option(1, 1000, "proposals", "trials")] = 8
    """A walker, of which its start is chosen."""
    nearer: Annotated[float, Option(0.001, 0.9, "-", "six times it leave a millionth of the proposals' width")] = 0.1
    """Share of their distance from the mode at which candidates are looked at next, where none is possible."""
    nearer_starts: Annotated[int, Option(1, 100, "looks", "as above")] = 7
    """At candidates, before it is said that none is possible."""
    tail_error: Annotated[float, Option(0.1, 100.0, "-", "√(0.05 · 0.95)/φ(z₀.₀₅) for a normal density")] = 2.1
    """Standard error of the watched quantiles times the root of the effective sample size."""
    expected_time: Annotated[float, Option(1.0, 1000.0, "steps", "at an acceptance of 0.88")] = 1.4
    """Autocorrelation time that walkers are planned for."""
    more_walkers: Annotated[float, Option(1.0, 10.0, "-", "the worst of all parameters counts")] = 1.5
    more_steps: Annotated[float, Option(1.0, 10.0, "-", "a tenth to spare: a chain is seldom looked at again")] = 1.1
    largest_exponent: Annotated[float, Option(10.0, 700.0, "-", "far tails of a proposal are only rejected")] = 200.0
    """Logarithms of positive parameters are cut there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProposalSettings(Options):
    """Proposals for a density that is not normal: ``sampling/{proposal,adaptation,laplace,normal_score}.py``."""

    defensive: Annotated[
        float, Option(0.01, 1.0, "-", "defensive mixture: Hesterberg, Technometrics 37 (1995) 185")
    ] = 0.1
    """Part of proposals that always come from the widest component: no region is left without any."""
    least_part: Annotated[float, Option(0.0, 0.1, "-", "a component may come back")] = 1e-3
    enough: Annotated[float, Option(0.01, 1.0, "-", "weights whose mean and covariance can be taken")] = 0.2
    """Evenness to which weights are flattened."""
    thinnest: Annotated[float, Option(1e-12, 1.0, "-", "a hundredth of the width, squared")] = 1e-4
    """Least spread of a component along any direction, as a share of the widest's."""
    components: Annotated[int, Option(1, 100, "components", "trials")] = 5
    """Of a mixture, beside the widest."""
    rounds: Annotated[int, Option(1, 1000, "rounds", "bound")] = 8
    """Of a mixture's fit."""
    draws: Annotated[int, Option(10, 1_000_000, "draws", "trials")] = 1500
    """Of each round."""
    wide: Annotated[float, Option(1.0, 10.0, "-", "beyond all points of the pilot run")] = 1.3
    """Of the widest component at first, over the points' spread."""
    narrow: Annotated[float, Option(0.01, 1.0, "-", "trials")] = 0.7
    """Of the others."""
    first_fits: Annotated[int, Option(0, 100, "steps", "EM settles on a pilot's points in a few")] = 3
    pilot_walkers: Annotated[int, Option(10, 10_000, "walkers", "trials")] = 100
    """Of the run that finds where the mass is."""
    pilot_steps: Annotated[int, Option(10, 100_000, "steps", "trials")] = 200
    """Of which the second half counts."""
    pilot_thin: Annotated[int, Option(1, 1000, "steps", "τ of differential evolution is longer")] = 5
    pilot_candidates: Annotated[int, Option(1, 1000, "draws", "trials")] = 8
    """A walker, from which its start is chosen."""
    pilot_floor: Annotated[float, Option(0.0, 0.1, "-", "as many starts as walkers")] = 1e-12
    difference: Annotated[float, Option(1e-4, 1.0, "standard deviations", "wide enough for 10⁶ rounded terms")] = 0.1
    """Finite-difference step of Laplace's approximation."""
    fall: Annotated[float, Option(1.0, 1000.0, "-", "a density of e⁻¹⁰ of the mode's is none")] = 10.0
    """What the edge of the support counts for in a difference of the log density."""
    newton_steps: Annotated[int, Option(1, 10_000, "steps", "bound")] = 60
    close: Annotated[float, Option(1e-6, 1.0, "standard deviations", "a proposal gains nothing from a better mode")] = (
        0.02
    )
    """Newton step at which the mode is found."""
    flattest: Annotated[float, Option(1.0, 1000.0, "standard deviations", "of the start")] = 3.0
    """Spread along a direction without curvature."""
    longest_step: Annotated[float, Option(0.1, 1000.0, "standard deviations", "far away, curvature misleads")] = 4.0
    refine_rounds: Annotated[int, Option(1, 1000, "rounds", "bound")] = 8
    refine_draws: Annotated[int, Option(10, 1_000_000, "draws", "trials")] = 400
    refine_even: Annotated[float, Option(0.01, 1.0, "-", "trials")] = 0.6
    """Evenness of weights at which refinement ends."""
    coarse_samples: Annotated[int, Option(100, 10_000_000, "samples", "show where to look")] = 4000
    """Samples on which the mode is looked for first."""
    score_knots: Annotated[int, Option(10, 100_000, "knots", "linear between them: 1e-4 of a score")] = 400
    score_depth: Annotated[float, Option(1.0, 300.0, "-", "a normal score of about 5.5")] = 18.0
    """Fall of a log density at which the map to normal scores ends."""
    least_rise: Annotated[float, Option(0.0, 0.1, "-", "rounding of scores")] = 1e-6
    """Of the score from knot to knot."""
    start_spread: Annotated[float, Option(1e-3, 10.0, "-", "log σ of 50 samples")] = 0.1
    """Spread of a scale's logarithm where the mode is looked for."""
    start_nu: Annotated[float, Option(1.0, 1000.0, "-", "moderate tails")] = 6.0
    start_nu_spread: Annotated[float, Option(1e-3, 10.0, "-", "the prior's, about")] = 0.5
    start_part: Annotated[float, Option(0.01, 0.79, "-", "6 % of the samples")] = 0.4
    """Cube root of the part of outliers."""
    start_noise: Annotated[float, Option(0.01, 0.99, "-", "well within the variation of f_n")] = 0.3
    """Largest noise of forces, as a share of that variation."""
    largest_root: Annotated[float, Option(10.0, 1e100, "-", "all of the scatter is noise long before")] = 1e30
    """Of the noise of forces over the scatter, which is cut there."""
    start_noise_spread: Annotated[float, Option(0.01, 10.0, "-", "trials")] = 0.3
    """Spread of the noise's root, as a share of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GridSettings(Options):
    """The hierarchical posterior on a grid, and what summarises it (``linear/{posterior_grid,normal_mixture}.py``)."""

    least_tau: Annotated[float, Option(1e-9, 0.1, "-", "what does not matter")] = 1e-4
    """Between grasps."""
    least_omega: Annotated[float, Option(1e-9, 0.1, "-", "what does not matter")] = 1e-5
    """Between places."""
    least_gain: Annotated[float, Option(1e-9, 0.1, "-", "a tenth of a per cent matters to no grip")] = 1e-3
    """Between sensors."""
    most_scatter: Annotated[float, Option(0.1, 100.0, "-", "absurd")] = 3.0
    """Of any."""
    gain_nodes: Annotated[int, Option(4, 100, "nodes", "to 1 % of the error of β₀; nine: to 8 %")] = 12
    """Of the scale between sensors, where there are several."""
    beside_gains: Annotated[int, Option(4, 200, "nodes", "trials")] = 14
    """Of each other scale then, in place of ``fine``."""
    coarse: Annotated[int, Option(4, 100, "nodes", "trials")] = 12
    """A scale, of the first two grids."""
    fine: Annotated[int, Option(4, 200, "nodes", "trials")] = 20
    """A scale, of the others."""
    sigma_nodes: Annotated[int, Option(1, 50, "nodes", "Gauss–Hermite: exact to the 13th moment")] = 7
    depth: Annotated[float, Option(1.0, 100.0, "-", "a density of e⁻¹⁰ of the mode's is none")] = 10.0
    """Fall of the log density that the grid spans."""
    rounds: Annotated[int, Option(3, 100, "grids", "bound")] = 5
    settled: Annotated[float, Option(0.1, 1.0, "-", "trials")] = 0.6
    """Share of a grid that must matter for it to be the last."""
    no_scatter: Annotated[float, Option(10.0, 300.0, "-", "e⁶⁰: any scatter between explains all within")] = 60.0
    """Logarithm of the variance between over that within at which the least σ is looked for."""
    block_bytes: Annotated[int, Option(2**10, 2**40, "B", "beside what a fit takes anyway, little")] = 2**24
    """Of points whose sums over each of many sensors are in memory at a time."""
    taps: Annotated[int, Option(2, 12, "nodes", "a cubic's error showed in the log density")] = 6
    """A scale, that sums over grasps are interpolated from where emcee walks."""
    middle: Annotated[float, Option(0.6, 0.999, "-", "of a 95 % interval")] = 0.975
    """Lower of the quantiles at which a Student-t is matched to a mixture."""
    extreme: Annotated[float, Option(0.9, 0.99999, "-", "a planner's slip probability of 1e-3")] = 0.999
    """Upper of them."""
    most_freedom: Annotated[float, Option(30.0, 1e9, "-", "quantiles of 1e-3 are then normal to 1e-4")] = 1e4
    """Degrees of freedom from which a Student-t is taken as normal."""
    quantile_steps: Annotated[int, Option(10, 1000, "steps", "a bracket halved 60 times is rounding")] = 60
    quantile_rounding: Annotated[float, Option(1e-15, 1e-2, "-", "far below a Monte-Carlo error")] = 1e-10


@dataclass(frozen=True, slots=True, kw_only=True)
class RobustSettings(Options):
    """The M-estimate (``linear/m_estimate.py``)."""

    subsets: Annotated[int, Option(10, 100_000, "fits", "none clean at 45 % outliers: chance below 1e-39")] = 500
    """Elemental fits tried."""
    subset_samples: Annotated[int, Option(50, 10_000_000, "samples", "medians to 3 %")] = 2000
    """That these are compared on."""
    regular: Annotated[float, Option(10.0, 1e15, "-", "half of the digits")] = 1e8
    """Largest condition number of an elemental fit."""
    improved: Annotated[int, Option(1, 100, "fits", "Rousseeuw & Van Driessen (2006) improve the ten best")] = 5
    concentrations: Annotated[int, Option(1, 1000, "steps", "bound; each lowers the trimmed sum of squares")] = 20
    same: Annotated[float, Option(1e-15, 1e-2, "-", "rounding")] = 1e-10
    """Relative change of coefficients that is none."""
    near: Annotated[float, Option(1.0, 10.0, "scales", "0.3 % of normal errors lie beyond")] = 3.0
    """From which a sample does not count while the scale is found."""
    inflated: Annotated[float, Option(1.0, 100.0, "-", "45 % outliers inflate by 2.5")] = 4.0
    """Most that outliers inflate the start's scale by."""
    scale_tolerance: Annotated[float, Option(1e-12, 0.1, "-", "far below a scale's own error")] = 1e-3
    """Relative change of the scale at which it is found."""
    step_tolerance: Annotated[float, Option(1e-15, 0.1, "scales", "far below a coefficient's own error")] = 1e-8
    """Of the M-step."""
    least_scale: Annotated[float, Option(0.0, 1e-3, "-", "rounding")] = 1e-12
    """In units of the median response, below which a scale is rounding."""
    rounding: Annotated[float, Option(1.0, 1000.0, "ulp", "rounding of least squares")] = 8.0
    """Move of the coefficients, in units of their last digit, that is none."""
    iterations: Annotated[int, Option(1, 10_000, "steps", "bound")] = 200
    huber: Annotated[float, Option(0.1, 100.0, "-", "95 % efficiency at normal errors (Huber, 1981)")] = 1.345
    tukey: Annotated[float, Option(0.1, 100.0, "-", "95 % efficiency at normal errors (Beaton & Tukey, 1974)")] = 4.685
    nodes: Annotated[int, Option(101, 1_000_001, "nodes", "to rounding")] = 4001
    """Of the trapezium rule over standard normal errors."""
    reach: Annotated[float, Option(6.0, 38.0, "standard deviations", "1e-15 of a normal lies beyond")] = 8.0
    """Of that rule."""
    least_slope: Annotated[float, Option(0.01, 1.0, "-", "errors grow by five at most")] = 0.2
    """Of ψ over ψ(u)/u, in the mean: below it the correction of errors would diverge."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterSettings(Options):
    """Errors that samples share (``linear/``: ``cluster_errors``, ``shared_errors``, ``observations``,
    ``grasp_statistics``, ``within_places``, ``lasting_errors``, ``place_correlation``, ``slopes_of_grasps``).
    """

    few: Annotated[int, Option(1, 100, "clusters", "9 for the three coefficients")] = 3
    """A direction, from which the cluster-robust variance stands alone."""
    dominant: Annotated[float, Option(0.5, 1.0, "-", "what is left of a variance by one cluster is noise")] = 0.8
    """Share of the information on a direction above which the cluster that holds it is alone there."""
    alone: Annotated[float, Option(1e-15, 1e-2, "-", "rounding")] = 1e-8
    """What a cluster leaves of a direction that it determines."""
    shared_level: Annotated[float, Option(1e-12, 0.5, "-", "one false alarm in a thousand fits")] = 1e-3
    """Level of the test that errors are shared within the elements of a grasp."""
    time_blocks: Annotated[int, Option(2, 1000, "blocks", "enough for a variance, long enough to be independent")] = 20
    """That the record of a single element, or of a grasp, is cut into."""
    by_chance: Annotated[float, Option(0.0, 10.0, "standard errors", "usual for what differs from chance")] = 2.0
    """Of a variance of so many blocks: larger by less than that shows no errors that go together."""
    independent: Annotated[float, Option(0.01, 0.99, "-", "as likely as not")] = 0.5
    """Probability, before the levels of a grasp's places are seen, that none of their errors last."""
    lasting_freedom: Annotated[float, Option(0.5, 100.0, "-", "tuning seeds of 2 to 10 places: 95 % are held")] = 3.0
    """Degrees of freedom with which the levels of places tell how errors last."""
    few_places: Annotated[float, Option(0.0, 1.0, "-", "ten places whose errors last: 0.87")] = 0.9
    """Of what a grasp would say of a slope beside many, below which alone its places are too few."""
    least_neighbours: Annotated[int, Option(2, 1000, "pairs", "a correlation to 0.25")] = 16
    """Of places of a grasp beside each other, from which they show whether neighbours are off alike."""
    most_alike: Annotated[float, Option(0.0, 0.999, "-", "alike over 7 elements: wider than a contact shows")] = 0.99
    """Correlation of neighbours that is taken at most."""
    least_places: Annotated[float, Option(1.0, 100.0, "places", "a level and two slopes, and one to spare")] = 4.0
    """That those of a grasp count as in any case."""
    most_places: Annotated[int, Option(2, 1_000_000, "places", "32 bytes each: less than 16 kB a grasp")] = 480
    """That are kept one by one."""
    most_groups: Annotated[int, Option(2, 1_000_000, "groups", "88 bytes each")] = 170
    """Of places of about the same weight that more places are pooled into."""
    above_scatter: Annotated[float, Option(1.0, 10.0, "-", "factors from 0 to 2, and any τ up to 0.5")] = 2.0
    """Of the law over what grasps scatter by, from which their levels tell of factors."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearSettings(Options):
    """Least squares (``linear/least_squares.py``, ``methods/ols.py``)."""

    min_samples: Annotated[int, Option(4, 1000, "samples", "three coefficients and a scatter")] = 4
    chunk: Annotated[int, Option(4, 10_000_000, "rows", "fit the processor's cache")] = 8192
    """That are worked on at once."""
    unbounded: Annotated[float, Option(1e8, 1e300, "-", "JSON has no infinity")] = 1e16
    """Reported in place of an infinite condition number or variance inflation."""
    statsmodels: Annotated[int, Option(0, 1_000_000_000, "samples", "it takes seconds beyond")] = 20_000
    """Up to which statsmodels adds its classical, HC3 and CR1 errors for comparison."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecognitionPrior(Options):
    """The population of materials from which one that is not known comes."""

    unknown: Annotated[float, Option(0.0, 1.0, "-", "one in twenty")] = 0.05
    """Prior probability that a grasp is of none of the known materials."""
    level: Annotated[float, Option(1e-3, 10.0, "-", "known pairs lie between 0.1 and 1")] = 0.25
    """Standard deviation of β₀ between materials."""
    slope: Annotated[float, Option(1e-4, 10.0, "-", "a fifth of the friction itself")] = 0.1
    """Standard deviation of each slope between materials, as a change of μ over its reference span; of those whose
    slopes are large."""
    least_slope: Annotated[float, Option(1e-4, 1.0, "-", "half a per cent of friction: none to a grip")] = 0.03
    """Part of it that it is between materials whose slopes are least; others lie between, at equal ratios."""
    scatter_freedom: Annotated[float, Option(0.1, 100.0, "-", "weak, yet proper")] = 2.0
    """Of the half-Student-t distribution of σ between materials, whose scale is the reference scatter."""
    least_scatter: Annotated[float, Option(1e-6, 0.1, "-", "a fifth of the reference: less is the sensor's")] = 0.01
    """Of samples, of any material: less does not distinguish materials."""
    scatter_spread: Annotated[float, Option(0.0, 5.0, "-", "a quarter, as grasps are loaded")] = 0.25
    """Of log σ between grasps of one material."""
    spread_freedom: Annotated[float, Option(1.0, 100.0, "-", "a grasp by a noisier sensor is no stranger")] = 4.0
    """Degrees of freedom of its Student-t distribution."""
    rounding: Annotated[float, Option(1e-6, 1.0, "-", "a hundredth of its variance")] = 0.1
    """Part of that below which a material's own scatter counts as so much."""
    nodes: Annotated[
        int, Option(1, 100, "-", "sixteenths from either end: tails of few degrees of freedom are cut there")
    ] = 8
    """Quantiles of the scatter between grasps over which the likelihood is averaged."""
    scatter_nodes: Annotated[int, Option(5, 1000, "nodes", "a third of e apart at first")] = 33
    """Of log σ."""
    rounds: Annotated[int, Option(1, 100, "rounds", "nodes 16 times closer each: for a million samples")] = 3
    """In which these close in."""
    reach: Annotated[float, Option(1.0, 20.0, "-", "e⁴: a density of e⁻⁴ at the worst")] = 4.0
    """Of log σ beyond all scatter that there is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Automatic(Options):
    """When the data call for more than least squares."""

    downweighted: Annotated[float, Option(0.011, 1.0, "-", "three times what normal errors leave, 0.011")] = 0.03
    """Part of the samples that Tukey's loss gives less than half weight."""
    least_outliers: Annotated[float, Option(0.1, 1000.0, "samples", "chance makes one or two in few samples")] = 3.0
    """So many samples that lie far off show more than chance."""
    half_weight: Annotated[float, Option(1.0, 10.0, "standard deviations", "Tukey's loss; 1.1 % of normal errors")] = (
        2.535
    )
    """From which that loss gives a sample less than half weight."""
    far: Annotated[float, Option(1.0, 10.0, "standard deviations", "0.3 % of normal errors")] = 3.0
    """From which samples are left out where too many lie far off."""
    least_scatter: Annotated[float, Option(0.0, 0.1, "-", "three of them, 1 % of friction, matter to no grip")] = 0.0033
    """Of samples, in parts of friction, below which a deviation is not taken to lie: what is nearer is not far off."""
    fewest: Annotated[int, Option(2, 1000, "samples", "a median to 0.4 of their deviation")] = 8
    """Of a place, from which its median says what is the place's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeSettings(Options):
    """The sequential test for a changed surface (``change_detector.py``)."""

    alarm: Annotated[float, Option(1e-12, 0.5, "-", "one false alarm in a thousand stretches")] = 1e-3
    spread: Annotated[float, Option(1e-3, 100.0, "standard deviations", "a shift of half a deviation matters")] = 0.5
    """Of the shifts that are looked for."""
    reset_after: Annotated[int, Option(1, 1_000_000_000, "samples", "a late change is not buried")] = 1000
    farthest: Annotated[float, Option(3.0, 38.0, "standard deviations", "beyond, one sample would decide alone")] = 8.0
    """Score that any sample counts for at most."""
    largest_exponent: Annotated[float, Option(10.0, 709.0, "-", "exp must not overflow")] = 700.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AlarmSettings(Options):
    """The alarm of changed surfaces, grasp by grasp (``change_alarm.py``)."""

    rate: Annotated[float, Option(1e-12, 0.999, "-", "one false alarm in a thousand grasps")] = 1e-3
    shift: Annotated[float, Option(1e-3, 10.0, "-", "a fifth of friction matters to a grip")] = 0.2
    """Standard deviation of a change of friction, as a part of it."""
    reference: Annotated[int, Option(1, 1000, "grasps", "fewer do not show their scatter")] = 3
    """Before which none can have happened."""
    lasting: Annotated[int, Option(1, 100, "grasps", "heavy tails bring one odd grasp, seldom two")] = 2
    """Since a change, before which it raises no alarm."""
    soon: Annotated[int, Option(1, 1000, "grasps", "a planner would rather not grip five times in vain")] = 5
    """Within which a change should be noticed."""
    settled: Annotated[int, Option(2, 1000, "grasps", "with fewer, it is their number that hides a change")] = 10
    """From which grasps that differ too much for that are noted."""
    fall_digits: Annotated[float, Option(1e-6, 0.1, "-", "it is given in whole per cent")] = 5e-3
    """To which the least fall that would be noticed is found."""
    longest: Annotated[int, Option(10, 1_000_000, "grasps", "a change so long ago is the material")] = 1000
    """That are looked at: those before say no more of τ."""
    least_tau: Annotated[float, Option(1e-6, 0.1, "-", "below what any sensor repeats")] = 1e-3
    """Scatter between grasps, as a part of friction, from which is summed."""
    most_tau: Annotated[float, Option(0.1, 10.0, "-", "as large as friction itself")] = 1.0
    """To which is summed."""
    nodes: Annotated[int, Option(5, 1000, "nodes", "19 % apart: far closer than τ is known")] = 40
    """Of that sum, at equal ratios."""
    least_scatter: Annotated[float, Option(0.0, 1e-3, "-", "rounding: without scatter all places count alike")] = 1e-9
    """Of a place, in parts of friction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignSettings(Options):
    """Which grasp to record next (``grasp_design.py``)."""

    quantile: Annotated[float, Option(1e-6, 0.5, "-", "a slip in a hundred grasps")] = 1e-2
    """Of friction, that a planner asks for."""
    elements: Annotated[int, Option(1, 100_000, "elements", "a fingertip's contact at a pitch of 1 mm")] = 60
    """Of the contact that is planned for."""
    seconds: Annotated[float, Option(0.0, 1e4, "s", "to grasp and let go")] = 4.0
    """For a grasp beside its slip."""
    frame_rate: Annotated[float, Option(1.0, 1e5, "1/s", "paper, Section IV-A")] = 30.0
    drop_probability: Annotated[float, Option(1e-9, 0.5, "-", "one in a thousand probes")] = 1e-3
    """With which a probe may drop what it bears."""
    least_speed: Annotated[float, Option(1e-6, 1.0, "m/s", "17 µm a frame at 30 fps: above markers' noise")] = 5e-4
    """Slowest slip of a probe that a robot may choose unless another is given."""
    least_length: Annotated[float, Option(1e-6, 1.0, "m", "about an element's pitch")] = 5e-4
    """Shortest slip of a probe, in the same way."""
    slipping: Annotated[float, Option(0.01, 1.0, "-", "half way of the slip front")] = 0.5
    """Part of a contact's elements that slip in a probe."""
    force_spread: Annotated[float, Option(0.0, 2.0, "-", "Hertz's pressure: about 0.35 over its area")] = 0.3
    """Standard deviation of their normal forces, in parts of the mean."""
    velocity_spread: Annotated[float, Option(0.0, 2.0, "-", "slip grows towards the rim")] = 0.5
    """The same of their velocities."""
    forces: Annotated[int, Option(2, 1000, "forces", "8 % apart where the greatest is six times the least")] = 25
    """That are tried, at equal ratios."""
    least_scatter: Annotated[float, Option(0.0, 1e-2, "-", "scatter of 0 would make one grasp decide all")] = 1e-6
    """Of a model, in parts of friction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InfluenceSettings(Options):
    """When a grasp is named that lowers the friction that a planner may count on (``influence.py``)."""

    fall: Annotated[float, Option(1e-3, 1.0, "-", "below it 2 in 34 answers vanish; one log in 15 is named")] = 0.05
    """Of that friction, in parts of it, beyond which the grasp is looked for."""
    undone: Annotated[float, Option(0.0, 1.0, "-", "more than all others together")] = 0.5
    """Part of the fall that leaving the grasp out must undo."""
    lowest: Annotated[int, Option(1, 1000, "grasps", "a fit each; the newest and the highest beside them")] = 3
    """Of least friction that are left out in turn."""


LASTING = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
"""How long errors of a record last, in its stretches of time: from none to the next, to three records."""
OWN_SHARES = (0.0, 0.25, 0.5, 0.75)
"""Part of their variance that each stretch has for itself."""
STEP_SHARES = (1.0, 0.5, 0.25, 0.1, 0.03, 0.01, 0.001)
"""Shares of a Newton step that Laplace's approximation tries at once: trials on skewed posteriors."""
WEIGHT_POWERS = (1.0, 0.7, 0.5, 0.3, 0.2, 0.1, 0.05, 0.02)
"""Powers that flatten the weights of draws, the largest first: trials."""
ROUNDING = 1e-12
"""Relative difference that is rounding."""
NORMAL_MAD = 0.674489750196082
"""Φ⁻¹(¾): median of |ε|/σ for normal ε."""

ALARM = AlarmSettings()
AUTOMATIC = Automatic()
CHANGE = ChangeSettings()
CLUSTERS = ClusterSettings()
DESIGN = DesignSettings()
GRID = GridSettings()
LINEAR = LinearSettings()
RECOGNITION = RecognitionPrior()
REFERENCE = Reference()
IDENTIFIABILITY = Identifiability()
INFLUENCE = InfluenceSettings()
POPULATION = PopulationSettings()
PRIOR = Prior()
PROPOSAL = ProposalSettings()
ROBUST = RobustSettings()
SAMPLING = ChainSettings()

TABLES = (
    ALARM, AUTOMATIC, CHANGE, CLUSTERS, DESIGN, GRID, LINEAR, RECOGNITION, REFERENCE, IDENTIFIABILITY, INFLUENCE,
    POPULATION, PRIOR, PROPOSAL, ROBUST, SAMPLING,
)  # fmt: skip
"""All tables of estimators."""
