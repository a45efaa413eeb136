"""Every default of estimators, with unit, source and valid range."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Reference:
    """What matters to a grasp: the spans over which a slope is of consequence, and the size of the quantities."""

    tangential_velocity: float = 5e-3
    """m/s, > 0; incipient slip of a fingertip runs at 0.1 to 10 mm/s."""
    pressure: float = 5e4
    """Pa, > 0; a fingertip of 1 to 2 cm² that carries 5 to 10 N."""
    friction: float = 0.5
    """-, > 0; between polished metal (0.1) and rubber on dry paper (1)."""
    scatter: float = 0.05
    """-, > 0; standard deviation of friction between elements, a tenth of the friction itself."""

    def spans(self, element_area: float) -> NDArray[np.float64]:
        """Spans [2] of v (m/s) and of an element's f_n (N), from the area of the element in m²."""
        return np.array([self.tangential_velocity, self.pressure * element_area])


@dataclass(frozen=True, slots=True)
class Identifiability:
    """When a coefficient counts as known."""

    effect: float = 0.1
    """-, 0 to 1; largest half-width of its 95 % interval, as a change of μ over the span, in parts of the mean μ."""
    prior_shift: float = 0.5
    """Posterior standard deviations; largest move of a known coefficient when the prior is made twice as wide."""
    collinear: float = 1e-10
    """-, 1e-14 to 1e-6; smallest singular value of the equilibrated regressors that still counts as a direction."""
    ill_conditioned: float = 1e3
    """-, ≥ 1; scaled condition number from which the factor is computed again in extended precision."""


@dataclass(frozen=True, slots=True)
class Prior:
    """Weak conjugate prior: β | σ² ~ N((μ₀, 0, 0), σ² V₀), σ² ~ IG(ν₀/2, ν₀ s₀²/2).

    V₀ is such that at σ = s₀ the standard deviation of β₀ is ``width``, and that of each slope changes μ by ``width``
    over its reference span: the prior weighs as much as (s₀/width)² = 1/400 of one sample.
    """

    width: float = 1.0
    """-, > 0; no known pair of dry surfaces lies outside 0.5 ± 2."""
    degrees_of_freedom: float = 0.1
    """ν₀, > 0; the prior's say in σ weighs as much as a tenth of one sample."""
    effect_degrees_of_freedom: float = 4.0
    """> 0; of the half-Student-t prior of the scatter between places: weak, yet with a mean and a variance."""
    grasp_scatter: float = 0.07
    """-, > 0; scale of the half-Student-t prior of the scatter between grasps, as a part of the friction itself.

    Over materials friction scatters by 7 to 24 % between grasps; the prior's median is 5 %, and one in ten lies above
    13 %.
    """
    grasp_degrees_of_freedom: float = 7.0
    """> 0; of that prior. Three leave a single grasp without any answer at a slip probability of 1e-3."""


@dataclass(frozen=True, slots=True)
class ChainSettings:
    """How a posterior is sampled, and when the sampling stops."""

    walkers: tuple[int, int] = (16, 440)
    """Fewest and most, even: as many as bring the accuracy within one block, so that the overhead a step is shared."""
    block: int = 130
    """Steps before the first look at the chain: 50 τ of a good proposal, and enough for R̂ to tell it from others."""
    batch: int = 10
    """Steps whose proposals are drawn and looked at together: the overhead of a call is shared."""
    chain_lengths: float = 50.0
    """Steps in units of the integrated autocorrelation time, from which that time is believed (emcee's rule)."""
    accuracy: float = 0.02
    """Posterior standard deviations; Monte-Carlo error of mean, 5 % and 95 % quantile at which sampling stops."""
    accuracy_per_sample: float = 0.05
    """The same where each step of each walker reads all samples: an effective sample size of 2,000."""
    accuracy_of_scales: float = 0.05
    """The same where only scales are sampled: the coefficients, known exactly given them, are told ten times better."""
    max_steps: int = 3000
    """Steps after which a chain that does not converge is given up."""
    min_acceptance: float = 0.3
    """Acceptance of the independence proposal below which differential evolution takes over (house trials)."""
    proposal_degrees_of_freedom: float = 10.0
    """Of the multivariate Student-t proposal: tails heavier than the posterior's, at an acceptance of 0.88."""
    local: float = 0.25
    """0 to 1; part of small steps where the proposal's weights are uneven: they free walkers stuck in a tail."""
    even: float = 0.85
    """0 to 1; evenness of the proposal's weights (effective number over number) from which no small steps are taken."""
    max_split_rhat: float = 1.01
    """Vehtari et al. (2021), Bayesian Analysis 16:667."""
    kept_draws: int = 4000
    """Draws that a model keeps."""


@dataclass(frozen=True, slots=True)
class Recognition:
    """The population of materials from which one that is not known comes."""

    unknown: float = 0.05
    """0 to 1; prior probability that a grasp is of none of the known materials."""
    level: float = 0.25
    """-, > 0; standard deviation of β₀ between materials."""
    slope: float = 0.1
    """-, > 0; standard deviation of each slope between materials, as a change of μ over its reference span."""
    scatter_freedom: float = 2.0
    """> 0; degrees of freedom of σ² between materials, about the square of the reference scatter."""


@dataclass(frozen=True, slots=True)
class Automatic:
    """When the data call for more than least squares."""

    downweighted: float = 0.03
    """0.011 to 1; part of the samples that Tukey's loss gives less than half weight (normal errors: 0.011)."""
    least_outliers: float = 3.0
    """> 0; so many samples that lie far off show more than chance in few samples."""


AUTOMATIC = Automatic()
RECOGNITION = Recognition()
REFERENCE = Reference()
IDENTIFIABILITY = Identifiability()
PRIOR = Prior()
SAMPLING = ChainSettings()
MIN_SAMPLES = 4
"""Three coefficients and a scatter need four samples."""

SHARED_LEVEL = 1e-3
"""0 to 1; level of the test that errors are shared within the elements of a grasp."""
