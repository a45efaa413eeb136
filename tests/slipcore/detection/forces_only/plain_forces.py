"""Method ``forces_only`` in numpy, all elements and friction coefficients at once, to hold its kernels against."""

from typing import NamedTuple

import numpy as np
from scipy.special import expit

from slipcore.defaults import NUMERICS, ForcesOnlyOptions
from slipcore.detection.filter.loading import low_pass
from slipcore.detection.forces_only.method import init
from slipcore.detection.forces_only.sharing import Sharing
from slipcore.detection.forces_only.step import ForcesState
from slipcore.detection.forces_only.tuning import frictions, prior
from slipcore.detection.shared.interface import ObservedFrame
from slipcore.detection.shared.records import Decision
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice

_LEAST_FORCE = NUMERICS.least_element_force
RAYLEIGH_MEAN = np.sqrt(np.pi / 2.0)
"""Mean length of a vector of two components with normal noise of 1."""


class Loads(NamedTuple):
    """Forces on elements [k] at places [k, 2] m: ``normal`` N inwards, ``tangential`` [k, 3] N."""

    place: FloatArray
    normal: FloatArray
    tangential: FloatArray

    @property
    def ratio(self) -> FloatArray:
        """Of tangential to normal force, [k]."""
        size: FloatArray = np.linalg.norm(self.tangential, axis=-1)
        return size / np.maximum(self.normal, _LEAST_FORCE)

    @property
    def evenly(self) -> FloatArray:
        """Each element's vector of force over normal force, [k, 3], if the load were shared by the normal force.

        With F_N = Σp, centre c = Σp x/F_N and arms r = x − c: q + ω ẑ × r for q = Σf/F_N and ω = Σ(r × f)/Σp r².
        """
        arm, polar = self._arms()
        total = self.normal.sum()
        turn = (arm[:, 0] * self.tangential[:, 1] - arm[:, 1] * self.tangential[:, 0]).sum() / polar
        even: FloatArray = np.tile(self.tangential.sum(axis=0) / total, (len(self.normal), 1))
        even[:, 0] -= turn * arm[:, 1]
        even[:, 1] += turn * arm[:, 0]
        return even

    def sideways(self, change: FloatArray) -> float:
        """Size of a ``change`` of the tangential forces [k, 3] as a whole, N: of its sum, and of its moment over the
        radius of gyration.
        """
        arm, polar = self._arms()
        moment = (arm[:, 0] * change[:, 1] - arm[:, 1] * change[:, 0]).sum()
        return float(np.hypot(np.linalg.norm(change.sum(axis=0)), moment / np.sqrt(polar / self.normal.sum())))

    def _arms(self) -> tuple[FloatArray, float]:
        arm = self.place - (self.normal[:, None] * self.place).sum(axis=0) / self.normal.sum()
        return arm, float((self.normal[:, None] * arm**2).sum()) + NUMERICS.least_spread


def compare(before: Loads, now: Loads, noise: float, options: ForcesOnlyOptions) -> Sharing:
    """How elements shared the change from ``before`` to ``now``; ``noise`` of one component of force, N."""
    ratio, even = now.ratio, now.evenly
    along = now.tangential / np.maximum(np.linalg.norm(now.tangential, axis=-1), _LEAST_FORCE)[:, None]
    expected = ((even - before.evenly) * along).sum(axis=-1)
    level = np.maximum((even * along).sum(axis=-1), options.least_change)
    share = np.clip(ratio / level, 1.0 / options.largest_share, options.largest_share)
    deviation = noise * np.sqrt(1.0 + ratio**2) / np.maximum(now.normal, _LEAST_FORCE)
    most = np.maximum(np.abs(expected) * share, options.least_change)
    change = ratio - before.ratio
    return Sharing(ratio, deviation, change / most, np.sqrt(2.0) * deviation / most, expected, change < 0.0)


def log_density(x: FloatArray, mean: FloatArray | float, deviation: FloatArray | float) -> FloatArray:
    """Of a normal distribution, up to a constant."""
    density: FloatArray = -0.5 * ((x - mean) / deviation) ** 2 - np.log(deviation)
    return density


def stick_density(seen: Sharing, options: ForcesOnlyOptions) -> FloatArray:
    """Log density [k] of the part that sticking elements take: as before, or more for others that slip."""
    as_before = log_density(seen.part, 1.0, np.hypot(options.part_spread, seen.part_deviation))
    more = log_density(seen.part, options.overload, np.hypot(options.overload_spread, seen.part_deviation))
    share = options.overload_share
    mixed = np.logaddexp(np.log1p(-share) + as_before, np.log(share) + more)
    return _or_anything(mixed, seen, options)


def slip_density(seen: Sharing, friction: FloatArray, options: ForcesOnlyOptions) -> FloatArray:
    """Log density [g, k] of the part that slipping elements take, for each ``friction`` [g].

    An element slips from its rim inwards, and what sticks in it takes on load until nothing does: the compliance of a
    contact in partial slip (Mindlin, 1949) goes with (1 − f_t/μf_n)^⅓, here with an exponent of its own.
    """
    left = np.maximum(1.0 - seen.ratio / friction[:, None], 0.0)
    part = options.slip_part * left**options.slip_exponent
    taken = log_density(seen.part, part, np.hypot(options.slip_part_spread, seen.part_deviation))
    return _or_anything(taken, seen, options)


def _or_anything(density: FloatArray, seen: Sharing, options: ForcesOnlyOptions) -> FloatArray:
    share = options.outlier_share
    anything = log_density(seen.part, 1.0, np.hypot(1.0, seen.part_deviation))
    mixed: FloatArray = np.logaddexp(np.log1p(-share) + density, np.log(share) + anything)
    return mixed


def step(
    state: ForcesState, lattice: Lattice, seen: ObservedFrame, options: ForcesOnlyOptions
) -> tuple[ForcesState, Decision]:
    """Follow the forces, and look at them once the load has changed by more than noise."""
    if seen.force.size == 0:
        return state, Decision(np.zeros(seen.contact.shape, bool), np.full(seen.contact.shape, 0.5))
    gain = low_pass(seen.interval, options.force_smoothing)
    state = follow(state, seen, gain) if seen.contact.any() else init(lattice, options)
    on = seen.stays & state.touched
    noise = 0.0 if np.isnan(seen.force_noise) else seen.force_noise * np.sqrt(gain / (2.0 - gain))
    now = _loads(lattice, state.normal, state.tangential, on)
    before = _loads(lattice, state.last_normal, state.last_tangential, on)
    if on.any() and min(now.normal.sum(), before.normal.sum()) > 0.0:
        moved = load_change(before, now, noise, options)
        if moved > options.least_load_change:
            state = look(state, on, before, now, noise, moved, options)
    p, odds = state.probability, (1.0 - options.threshold) / options.threshold
    return state, Decision(p > options.threshold, p * odds / (1.0 - p + p * odds))


def _loads(lattice: Lattice, normal: FloatArray, tangential: FloatArray, on: BoolArray) -> Loads:
    return Loads(lattice.position[on][:, :2], normal[on], tangential[on])


def follow(state: ForcesState, seen: ObservedFrame, gain: float) -> ForcesState:
    """Low-pass the forces of what stays in contact, and begin anew with what has just touched."""
    pressing, anew = np.maximum(seen.pressing, 0.0), ~(seen.stays & state.touched)
    sideways = seen.force + seen.pressing[..., None] * seen.normal
    normal = np.where(anew, pressing, state.normal + gain * (pressing - state.normal))
    tangential = np.where(anew[..., None], sideways, state.tangential + gain * (sideways - state.tangential))
    return ForcesState(
        normal,
        tangential,
        np.where(anew, normal, state.last_normal),
        np.where(anew[..., None], tangential, state.last_tangential),
        seen.contact,
        np.where(anew, 0.0, state.log_odds),
        state.friction,
        np.where(anew, 0.0, state.probability),
    )


def load_change(before: Loads, now: Loads, noise: float, options: ForcesOnlyOptions) -> float:
    """How far the forces of elements have gone, as a share of the normal force and beyond what noise makes of it."""
    total = now.normal.sum()
    gone = np.linalg.norm(now.tangential - before.tangential, axis=-1).sum() + abs(total - before.normal.sum())
    of_noise = options.load_deviations * RAYLEIGH_MEAN * np.sqrt(2.0) * noise * len(now.normal)
    return float((gone - of_noise) / total)


def look(
    state: ForcesState, on: BoolArray, before: Loads, now: Loads, noise: float, moved: float, options: ForcesOnlyOptions
) -> ForcesState:
    """What a change of the load says of the friction, and of each element that stays ``on``."""
    seen, grid = compare(before, now, noise, options), frictions(options)
    level = np.clip(
        (seen.ratio / grid[:, None] - options.slip_level) / options.slip_level_width,
        -options.largest_level_odds,
        options.largest_level_odds,
    )
    stick, slip = stick_density(seen, options), slip_density(seen, grid, options)
    friction = friction_told(state.friction, seen, level, stick, slip, moved, options)
    known = friction - np.logaddexp.reduce(friction)
    weight, slip = np.exp(known), np.logaddexp.reduce(known[:, None] + slip, axis=0)
    gained = log_odds_told(seen, slip - stick, options)
    log_odds = state.log_odds[on] * np.exp(-moved / options.memory) + gained
    log_odds = np.clip(log_odds, -options.largest_log_odds, options.largest_log_odds)
    log_odds -= options.pressed_log_odds * weight[grid > sticking_friction(before, now, noise, options)].sum()
    after, probability = np.zeros(on.shape), np.zeros(on.shape)
    after[on] = np.maximum(log_odds, -options.pressed_log_odds)
    probability[on] = weight @ expit(level + after[on])
    return state._replace(
        last_normal=state.normal, last_tangential=state.tangential, log_odds=after, friction=friction,
        probability=probability,
    )  # fmt: skip


def log_odds_told(seen: Sharing, gained: FloatArray, options: ForcesOnlyOptions) -> FloatArray:
    """Log-odds of slip [k] from a change of the load: what the part says where it grows, and stick where it is taken
    back.
    """
    most, least = options.largest_gain, options.least_change
    back = np.where((seen.expected < -least) & seen.falls, -options.taken_back, 0.0)
    return np.where(seen.expected > least, options.part_weight * np.clip(gained, -most, most), back)


def friction_told(
    friction: FloatArray,
    seen: Sharing,
    level: FloatArray,
    stick: FloatArray,
    slip: FloatArray,
    moved: float,
    options: ForcesOnlyOptions,
) -> FloatArray:
    """Log weights [g] after elements of whose load more is known; what was known fades by the way moved."""
    at_limit, below = -np.logaddexp(0.0, -level), -np.logaddexp(0.0, level)
    loaded = seen.expected > options.least_change
    log_likelihood = np.where(loaded, np.logaddexp(at_limit + slip, below + stick), 0.0)
    grid = frictions(options)[:, None]
    above = np.maximum(seen.ratio / grid - 1.0, 0.0) / np.hypot(options.excess, seen.deviation / grid)
    first = prior(options)
    kept = first + (friction - first) * np.exp(-moved / options.friction_memory)
    weights = kept + options.friction_weight * (log_likelihood - 0.5 * above**2).sum(axis=1)
    return np.asarray(weights - weights.max())


def sticking_friction(before: Loads, now: Loads, noise: float, options: ForcesOnlyOptions) -> float:
    """Friction above which all stick again, for the normal force grows so much faster than the tangential one
    (Mindlin and Deresiewicz, 1953); infinite where it does not grow beyond noise.
    """
    grows = now.normal.sum() - before.normal.sum()
    least = options.pressing_deviations * noise * np.sqrt(2.0 * len(now.normal))
    if grows <= max(least, options.least_change * now.normal.sum()):
        return np.inf
    return float(now.sideways(now.tangential - before.tangential) / (options.pressing_share * grows))
