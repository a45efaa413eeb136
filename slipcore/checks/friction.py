"""Checks of the friction that elements show: it is a material's, not a place's nor a force's."""

from collections.abc import Iterator

import numpy as np

from slipcore.checks.subject import Subject
from slipcore.collection import contradiction
from slipcore.finding import Finding
from slipcore.patch.friction import contact_friction


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


def friction_against_contact(seen: Subject) -> Iterator[Finding]:
    """Elements whose friction the whole contact contradicts."""
    contact = contact_friction(seen.log.time, seen.history.patches)
    if seen.samples is None or not len(seen.samples) or contact is None:
        return
    evidence = contradiction(seen.samples, contact, seen.history.patches)
    if evidence is not None:
        remedy = "the contact is trusted, and no element: record a grasp that slides or pivots, or calibrate the sensor"
        yield Finding("contact contradicts elements", evidence, remedy)
