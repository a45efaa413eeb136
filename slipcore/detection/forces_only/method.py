"""Stick and slip from forces alone, for taxels and pillars without displacement; no friction coefficient is given.

As the load grows, an element that slips takes ever less of it, until its force ratio stands at the friction
coefficient, while its neighbours take over (Cattaneo, 1938; between pillars: Khamis et al., 2018). Which friction the
contact has is not known: its probability is followed on a grid, by how well each value explains which elements take
less at what force ratio, and that none stands above it. Everything goes by changes of the load: what is held changes
nothing.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import expit

from slipcore.defaults import ForcesOnlyOptions
from slipcore.detection.filter.loading import low_pass
from slipcore.detection.forces_only.sharing import Loads, Sharing, compare, slip_density, stick_density
from slipcore.detection.shared.interface import Method, ObservedFrame
from slipcore.detection.shared.records import Decision
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice

RAYLEIGH_MEAN = np.sqrt(np.pi / 2.0)
"""Mean length of a vector of two components with normal noise of 1."""


class ForcesState(NamedTuple):
    """What is remembered: low-passed forces of the elements, ``normal`` [n, m] and ``tangential`` [n, m, 3] N, now and
    when the load was last looked at; which elements touched then; log-odds of slip [n, m] that changes of the load have
    told; log weights [g] of friction coefficients; and the probability of slip [n, m].
    """

    normal: FloatArray
    tangential: FloatArray
    last_normal: FloatArray
    last_tangential: FloatArray
    touched: BoolArray
    told: FloatArray
    friction: FloatArray
    probability: FloatArray


def frictions(options: ForcesOnlyOptions) -> FloatArray:
    """The friction coefficients that are considered, [g]."""
    grid: FloatArray = np.geomspace(options.least_friction, options.largest_friction, options.frictions)
    return grid


def prior(options: ForcesOnlyOptions) -> FloatArray:
    """Log weights of them before anything is seen, [g]."""
    away = np.log(frictions(options) / options.usual_friction) / options.friction_spread
    weights: FloatArray = -0.5 * away**2
    return weights


def init(lattice: Lattice, options: ForcesOnlyOptions) -> ForcesState:
    """Nothing touches yet."""
    nothing, vectors = np.zeros(lattice.position.shape[:2]), np.zeros(lattice.position.shape)
    return ForcesState(nothing, vectors, nothing, vectors, nothing > 0.0, nothing, prior(options), nothing)


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
        np.where(anew, 0.0, state.told),
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
    told = state.told[on] * np.exp(-moved / options.memory) + gained
    told = np.clip(told, -options.largest_log_odds, options.largest_log_odds)
    told -= options.pressed_log_odds * weight[grid > sticking_friction(before, now, noise, options)].sum()
    after, probability = np.zeros(on.shape), np.zeros(on.shape)
    after[on] = np.maximum(told, -options.pressed_log_odds)
    probability[on] = weight @ expit(level + after[on])
    return state._replace(
        last_normal=state.normal, last_tangential=state.tangential, told=after, friction=friction,
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
    told = np.where(loaded, np.logaddexp(at_limit + slip, below + stick), 0.0)
    grid = frictions(options)[:, None]
    above = np.maximum(seen.ratio / grid - 1.0, 0.0) / np.hypot(options.excess, seen.deviation / grid)
    first = prior(options)
    kept = first + (friction - first) * np.exp(-moved / options.friction_memory)
    weights = kept + options.friction_weight * (told - 0.5 * above**2).sum(axis=1)
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


METHOD = Method(ForcesOnlyOptions, init, step)
