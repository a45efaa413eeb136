"""Friction samples of a grasp: of its elements, and of its contacts as a whole."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slipcore.defaults import COLLECTION
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.patch.friction import contact_friction
from slipcore.patch_record import ContactFriction, Patch, bounds_of, frames_of, joined
from slipcore.repeated_frames import of_own
from slipcore.samples import KIND, FrictionSamples, element_samples
from slipcore.slip_state import SlipHistory


class Collected(NamedTuple):
    """What a grasp says of friction: the ``samples`` that are trusted, those of all ``elements``, what the
    ``contact`` as a whole shows (None without forces or contact), and why elements are left out (None: they are not).
    """

    samples: FrictionSamples
    elements: FrictionSamples
    contact: ContactFriction | None
    elements_left_out: str | None


def collect_samples(log: GraspLog, history: SlipHistory, **options: float) -> FrictionSamples:
    """The samples of ``collect_friction``, of which this takes the arguments and raises the errors."""
    return collect_friction(log, history, **options).samples


def collect_friction(log: GraspLog, history: SlipHistory, **options: float) -> Collected:
    """Observe friction at the elements of ``log`` that slip by ``history``, and of contacts that slide or pivot.

    Where these contradict each other the contact is trusted: smoothed forces and tilted normals hardly change its
    sums. Elements of a contact that rolls say nothing, for what slips by its motion does not.
    ``options``: see ``defaults.SampleOptions``. Raises ``NoForces`` for a log without forces, ``UnknownScale`` for one
    whose lengths are not in metres, ``InvalidInput`` for a history of another log and for bad options.
    """
    elements = element_samples(log, history, **options)
    log, history = of_own(log, history)
    contact = contact_friction(log.time, history.patches)
    left_out = None if contact is None or not len(elements) else contradiction(elements, contact, history.patches)
    kept = elements.take(np.full(len(elements), left_out is None))
    parts = [kept, _contact_samples(log, history.patches, elements)] if history.patches else [kept]
    return Collected(FrictionSamples.concatenate(parts), elements, contact, left_out)


def contradiction(elements: FrictionSamples, contact: ContactFriction, patches: Sequence[Patch]) -> str | None:
    """Why the elements cannot be right, if the contact is."""
    if contact.is_bound and _rolls(patches):
        return contact.reason
    if len(elements) < COLLECTION.least_samples:
        return None
    low, high = np.quantile(elements.normal_force, [0.25, 0.75])
    weakly, strongly = (
        float(np.median(elements.friction_coefficient[chosen]))
        for chosen in (elements.normal_force <= low, elements.normal_force >= high)
    )
    least, most = (1.0 - COLLECTION.agreement) * contact.low, (1.0 + COLLECTION.agreement) * contact.high
    if least <= min(weakly, strongly) and max(weakly, strongly) <= most:
        return None
    as_whole = (
        f"{'at least ' if contact.is_bound else ''}{contact.low if contact.is_bound else contact.coefficient:.2f}"
    )
    return (
        f"elements show friction of {weakly:.2f} where they press least and {strongly:.2f} where they press most, "
        f"the contact as a whole {as_whole}"
    )


def _rolls(patches: Sequence[Patch]) -> bool:
    """Whether the contact rolls for most of its time."""
    regime = joined(patches, "regime")
    return bool(np.count_nonzero(regime == "rolling") > 0.5 * np.count_nonzero(regime != "none"))


def _contact_samples(log: GraspLog, patches: Sequence[Patch], elements: FrictionSamples) -> FrictionSamples:
    """One sample a frame of a patch on a plateau.

    The law of friction is linear: a contact's friction is the law's at the means, weighted by force, of velocity and of
    its elements' normal force. These are taken over each plateau, for what they vary in it is mostly their noise.
    """
    on = np.flatnonzero(joined(patches, "plateau"))
    patch = np.searchsorted(bounds_of(patches), on, side="right") - 1
    begins = (np.diff(on, prepend=-2) > 1) | (np.diff(patch, prepend=-1) > 0)
    speed, force = (_means_of_groups(joined(patches, name)[on], begins) for name in ("speed", "element_force"))
    ratio = joined(patches, "load_ratio")[on]
    return FrictionSamples(
        friction_coefficient=ratio,
        tangential_velocity=speed,
        normal_force=force,
        tangential_force=ratio * force,
        time=log.time[frames_of(patches)[on]],
        element=log.grid[0] * log.grid[1] + patch,
        weight=np.ones(len(on)),
        element_area=log.element_area,
        normal_force_noise=elements.normal_force_noise,
        velocity_noise=elements.velocity_noise,
        kind=np.full(len(on), "contact", KIND),
        sensor=log.sensor,
    )


def _means_of_groups(field: FloatArray, begins: BoolArray) -> FloatArray:
    """The field [k] with each group, from where one ``begins`` to the next, levelled to its mean."""
    group = np.cumsum(begins) - 1
    return np.asarray((np.bincount(group, field) / np.bincount(group))[group])
