"""A filter of two states an element, stick and slip, on its place in the object's frame and its force ratio."""

import math
from dataclasses import dataclass

import numpy as np

from slipcore.defaults import FilterOptions
from slipcore.frames import FloatArray
from slipcore.kernels_filter import PROBABILITY, ROWS, STICK_VARIANCE, Loading, Pose, Tuning, step_filter
from slipcore.methods.interface import Decision, Method, Observation
from slipcore.strain import Lattice

_NOTHING = np.zeros((1, 1, 3))


@dataclass(frozen=True, slots=True, eq=False)
class FilterState:
    """Memory of each element [11, n, m] and of the object: ``pose``, ``loading``, slipping ``friction`` (sum, weight);
    the last frame's ``displacement`` and ``force``.
    """

    elements: FloatArray
    pose: Pose
    loading: Loading
    friction: tuple[float, float]
    displacement: FloatArray
    force: FloatArray | None
    tuning: Tuning


def init(_: Lattice, seen: Observation, options: FilterOptions) -> FilterState:
    """Start at rest."""
    elements = np.zeros((ROWS, *seen.contact.shape))
    elements[STICK_VARIANCE] = np.inf
    place = (0.0, 0.0, 0.0) if seen.object_pose is None else tuple(float(v) for v in seen.object_pose)
    pose = Pose(place[0], place[1], place[2], 1.0)
    tuning = Tuning(*(float(getattr(options, name)) for name in Tuning._fields))
    return FilterState(
        elements, pose, Loading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0), seen.displacement, seen.force, tuning
    )


def step(
    state: FilterState, lattice: Lattice, seen: Observation, options: FilterOptions
) -> tuple[FilterState, Decision]:
    """Move the filter on by one frame; one that repeats the last tells nothing."""
    if not seen.touched.any() and np.array_equal(seen.displacement, state.displacement):
        return state, _decide(state.elements[PROBABILITY], options)
    normal, tangential, force_change = _NOTHING[0], _NOTHING[0], _NOTHING
    has_force = seen.forces is not None and seen.force is not None and state.force is not None
    if seen.forces is not None and seen.force is not None and state.force is not None:
        normal, tangential, force_change = seen.forces.pressing, seen.forces.tangential, seen.force - state.force
    elements, pose, loading, friction = step_filter(
        state.elements,
        state.pose,
        state.loading,
        state.friction,
        lattice.position[..., 0] + seen.displacement[..., 0],
        lattice.position[..., 1] + seen.displacement[..., 1],
        state.displacement[..., 2] - seen.displacement[..., 2],
        seen.contact,
        seen.touched,
        normal,
        tangential,
        force_change,
        has_force,
        np.zeros(3) if seen.object_pose is None else seen.object_pose.copy(),
        seen.object_pose is not None,
        options.unknown_noise if math.isnan(seen.noise) else seen.noise,
        0.0 if math.isnan(seen.pressing_noise) else 1.1 * seen.pressing_noise,
        seen.interval,
        state.tuning,
    )
    after = FilterState(elements, pose, loading, friction, seen.displacement, seen.force, state.tuning)
    return after, _decide(elements[PROBABILITY], options)


def _decide(posterior: FloatArray, options: FilterOptions) -> Decision:
    """Slip above the threshold; the probability is the posterior with its odds shifted to ½ there."""
    odds = (1.0 - options.threshold) / options.threshold
    probability = posterior * odds / (1.0 - posterior + posterior * odds)
    return Decision(posterior > options.threshold, probability)


METHOD = Method(FilterOptions, init, step)
