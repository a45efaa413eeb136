"""Checks of the friction that elements show: it is a material's, not a place's nor a force's."""

from collections.abc import Iterator

import numpy as np

from slipcore.checks.subject import Subject
from slipcore.collection import contradiction
from slipcore.finding import Finding
from slipcore.frames import FloatArray
from slipcore.samples import FrictionSamples


def no_slip(seen: Subject) -> Iterator[Finding]:
    """A load that never came near friction: neither does the contact slide as a whole, nor does a part of it slip."""
    if seen.contact is None or not seen.contact.is_bound or not seen.held.any():
        return
    share = 1.0 - float(np.nanmin(seen.history.stick_ratio[seen.held], initial=1.0))
    if share < seen.limits.partial_slip:
        evidence = (
            f"no more than {share:.0%} of the contact slips at a time, and it does not slide as a whole: "
            f"friction is at least {seen.contact.low:.2f}, and nothing says how much more"
        )
        yield Finding("no slip", evidence, "load the object sideways until more than half of the contact slips")


def friction_of_surfaces(seen: Subject) -> Iterator[Finding]:
    """Friction that no surface shows on a sensor's skin: axes of force in different units look so."""
    least = seen.limits.least_friction
    if seen.samples is not None and len(seen.samples) >= seen.limits.least_samples:
        friction = float(np.median(seen.samples.friction_coefficient))
    elif seen.contact is None:
        return
    elif seen.contact.is_bound:  # it may be more
        friction, least = seen.contact.low, -np.inf
    else:
        friction = seen.contact.coefficient
    if not least <= friction <= seen.limits.largest_friction:
        evidence = f"friction is {friction:.2g}; skins of sensors show 0.1 to 2 on nearly all that is held"
        yield Finding("odd friction", evidence, "make sure that all axes of force are in N")


def friction_by_force(seen: Subject) -> Iterator[Finding]:
    """Friction that depends on the element's force more than it would by a law within one contact."""
    samples = seen.samples
    if samples is None or len(samples) < seen.limits.least_samples:
        return
    low, high = np.quantile(samples.normal_force, [0.25, 0.75])
    weakly, strongly = (
        float(np.median(samples.friction_coefficient[chosen]))
        for chosen in (samples.normal_force <= low, samples.normal_force >= high)
    )
    middle = float(np.median(samples.friction_coefficient))
    if abs(strongly - weakly) > seen.limits.friction_change * middle:
        evidence = f"friction is {weakly:.2f} where elements press least and {strongly:.2f} where they press most"
        remedy = "forces that are smoothed over neighbours look so; believe the whole contact's ratio, not elements'"
        yield Finding("friction follows force", evidence, remedy)


def friction_by_place(seen: Subject) -> Iterator[Finding]:
    """Friction that is a property of elements rather than of the material."""
    if seen.samples is None or len(seen.samples) < seen.limits.least_samples:
        return
    friction = seen.samples.friction_coefficient
    _, place, count = np.unique(seen.samples.element, return_inverse=True, return_counts=True)
    mean = np.bincount(place, friction) / count
    within = np.bincount(place, (friction - mean[place]) ** 2)
    enough = count >= seen.limits.samples_of_place
    if np.count_nonzero(enough) < seen.limits.least_places:
        return
    noise = within[enough] / (count[enough] - 1) / count[enough]
    between = float(np.sqrt(max(np.var(mean[enough], ddof=1) - noise.mean(), 0.0)))
    middle = float(np.mean(friction))
    if between > seen.limits.place_scatter * middle > 0.0:
        evidence = f"friction differs by {between / middle:.0%} from element to element, and stays so"
        yield Finding("friction differs by place", evidence, "calibrate the sensor's elements, or clean its surface")


def scatter_beyond_noise(seen: Subject) -> Iterator[Finding]:
    """Friction that scatters far more than the same element's readings do from one frame to the next."""
    samples = seen.samples
    if samples is None or len(samples) < seen.limits.least_samples:
        return
    left, frame = _left_by_law(samples), np.searchsorted(seen.log.time, samples.time)
    order = np.lexsort((frame, samples.element))
    again = (np.diff(samples.element[order]) == 0) & (np.diff(frame[order]) == 1)
    if np.count_nonzero(again) < seen.limits.least_repeats:
        return
    repeats = float(np.sqrt(0.5 * np.mean(np.diff(left[order])[again] ** 2)))  # a difference holds the noise of both
    scatter, middle = float(left.std()), float(samples.friction_coefficient.mean())
    if scatter > max(seen.limits.scatter_over_repeats * repeats, seen.limits.scatter_share * middle):
        evidence = (
            f"friction scatters by {scatter / middle:.0%} about any law of speed and force, "
            f"while an element's readings repeat to {repeats / middle:.0%} from frame to frame"
        )
        remedy = "more samples do not average this out: calibrate elements, zero and normals, or use the whole contact"
        yield Finding("scatter beyond noise", evidence, remedy)


def _left_by_law(samples: FrictionSamples) -> FloatArray:
    """What the best linear law of speed and normal force leaves of friction, [k]."""
    terms = np.stack([np.ones(len(samples)), samples.tangential_velocity, samples.normal_force], axis=-1)
    terms /= np.maximum(np.abs(terms).max(axis=0), np.finfo(float).tiny)
    law = np.linalg.lstsq(terms, samples.friction_coefficient, rcond=None)[0]
    return np.asarray(samples.friction_coefficient - terms @ law)


def friction_against_contact(seen: Subject) -> Iterator[Finding]:
    """Elements whose friction the whole contact contradicts."""
    if seen.samples is None or not len(seen.samples) or seen.contact is None:
        return
    evidence = contradiction(seen.samples, seen.contact, seen.history.patches)
    if evidence is not None:
        remedy = "the contact is trusted, and no element: record a grasp that slides or pivots, or calibrate the sensor"
        yield Finding("contact contradicts elements", evidence, remedy)
