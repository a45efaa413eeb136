"""Checks of what was recorded: units, signs, clocks, ranges."""

from collections.abc import Iterator

import numpy as np

from slipcore.checks.subject import Subject
from slipcore.defaults import LIMITS
from slipcore.finding import Finding
from slipcore.frames import BY_MOTION, BoolArray, GraspLog
from slipcore.repeated_frames import interpolated, repeated
from slipcore.saturation import saturated


def no_contact(seen: Subject) -> Iterator[Finding]:
    """A log in which nothing is found to touch, of which there is nothing else to say."""
    if seen.history.contact.any():
        return
    because, remedy = _without_contact(seen.log)
    yield Finding("no contact", f"no element touches in any of the {len(seen.log)} frames: {because}", remedy)


def _without_contact(log: GraspLog) -> tuple[str, str]:
    """Why nothing touches, by that from which contact is found, and what to do."""
    if log.contact is not None:
        if log.metadata.get("contact") == BY_MOTION:
            return "no marker moves beyond noise", "load the object sideways, or say what touches in `contact`"
        return "the log's own `contact` says so", "give in `contact` what touches, or leave it out"
    if log.force is not None and not log.has_reconstructed_force:
        largest = float(np.linalg.norm(log.force, axis=-1).max())
        return f"the largest force on one is {largest:.2g} N", "make sure that force is in N, and of what is recorded"
    if not log.displacement[..., 2].any():
        return "markers are seen in the plane alone", "say what touches in `contact`, or give z or forces"
    deepest = max(-float(log.displacement[..., 2].min()), 0.0) / np.sqrt(log.element_area)
    return (
        f"markers are pressed in by {deepest:.2g} of an element's width at most",
        "turn displacement along z so that it points outwards: what is pressed in has z below 0",
    )


def time_unit(seen: Subject) -> Iterator[Finding]:
    """Frames too far apart for slip, or closer than those of any sensor."""
    interval = float(np.median(np.diff(seen.log.time)))
    if interval > seen.limits.longest_interval:
        evidence = f"frames lie {interval:.3g} s apart; slip passes an element within a tenth of a second"
        yield Finding("slow frames", evidence, "make sure that times are in s, not ms; record at 20 Hz or more")
    if interval < seen.limits.shortest_interval:
        rate, fastest = 1.0 / interval, 1.0 / seen.limits.shortest_interval
        evidence = f"{rate:,.0f} frames a second; no tactile sensor takes more than {fastest:,.0f}"
        remedy = "make sure that times are in s: seconds that are taken for ms (a mapping's `unit`) look so"
        yield Finding("fast frames", evidence, remedy)


def still_markers(seen: Subject) -> Iterator[Finding]:
    """A log without displacement."""
    if seen.log.has_displacement and not np.ptp(seen.log.displacement, axis=0).any():
        evidence = "no marker ever moves"
        remedy = "map the field of displacements; of a sensor that measures forces alone, use method forces_only"
        yield Finding("no displacement", evidence, remedy)


def places_for_displacement(seen: Subject) -> Iterator[Finding]:
    """Places of markers where their displacement should be: they spread as the lattice itself does."""
    frames = np.linspace(0, len(seen.log) - 1, min(len(seen.log), seen.limits.stretch_frames)).astype(int)
    moved = seen.log.displacement[frames].mean(axis=0)[..., :2].reshape(-1, 2)
    place = seen.log.position[..., :2].reshape(-1, 2)
    gradient = np.linalg.pinv(place - place.mean(axis=0)) @ (moved - moved.mean(axis=0))
    least = float(np.linalg.svd(gradient, compute_uv=False)[-1])
    if least > seen.limits.largest_stretch:
        evidence = f"by their displacement the markers lie {least:.0%} further apart, in all directions, than at rest"
        remedy = "give displacement from the place at rest; with `rest` a mapping takes places of markers"
        yield Finding("places for displacement", evidence, remedy)


def element_area(seen: Subject) -> Iterator[Finding]:
    """An area of elements that their lattice contradicts: how hard to grip goes by it."""
    if min(seen.log.grid) < 2:
        return
    along, across = (np.diff(seen.log.position, axis=axis).mean(axis=(0, 1)) for axis in (0, 1))
    cell = float(np.linalg.norm(np.cross(along, across)))
    factor = seen.log.element_area / cell if cell else 1.0
    if max(factor, 1.0 / factor) > seen.limits.area_factor:
        evidence = (
            f"elements of {1e6 * seen.log.element_area:.3g} mm² lie on a lattice of {1e6 * cell:.3g} mm² an element"
        )
        yield Finding("element area", evidence, "give the area of one element, in m², or the lattice's true pitch")


def repeated_frames(seen: Subject) -> Iterator[Finding]:
    """A sensor that is slower than its recorder, or frozen."""
    share = float(repeated(seen.log)[1:].mean())
    if len(seen.log) > LIMITS.min_frames and share > seen.limits.repeated_share:
        evidence = f"{share:.0%} of the frames are copies of the one before"
        yield Finding("repeated frames", evidence, "record each frame once, with the time at which the sensor took it")


def interpolated_frames(seen: Subject) -> Iterator[Finding]:
    """A log that was resampled: what lies between the sensor's frames was not measured."""
    share = float(interpolated(seen.log)[1:-1].mean()) if len(seen.log) > LIMITS.min_frames else 0.0
    if share > seen.limits.repeated_share:
        evidence = f"{share:.0%} of the frames lie on the line between the one before and the one after"
        yield Finding("interpolated frames", evidence, "record the sensor's own frames, with the time of each")


def force_unit(seen: Subject) -> Iterator[Finding]:
    """Forces beyond what gels stand."""
    if seen.forces is None:
        return
    largest = float(seen.forces.normal.max()) / seen.log.element_area
    if largest > seen.limits.largest_pressure:
        evidence = f"{largest / 1e6:.3g} MPa on an element"
        yield Finding("force too large", evidence, "make sure of N (not mN, g or raw counts) and of the element's area")


def displacement_unit(seen: Subject) -> Iterator[Finding]:
    """Displacements too small for what presses, as of metres that were taken for millimetres.

    The skin's modulus is that of a half-space under a flat punch, F = 2 a E u (Johnson, 1985, Contact Mechanics,
    eq. 3.36, E for E / (1 - ν²)), of a contact with as much area as its elements have that bear the force.
    """
    if seen.forces is None or seen.log.has_reconstructed_force or not seen.log.displacement.any():
        return
    pressing = seen.pressing[np.argmax(seen.pressing.sum(axis=(1, 2)))]
    force, square = float(pressing.sum()), float(np.sum(pressing**2))
    if not force > 0.0 or float(pressing.max()) > seen.limits.largest_pressure * seen.log.element_area:
        return
    radius = np.sqrt(force**2 / square * seen.log.element_area / np.pi)
    moved = float(np.linalg.norm(seen.log.displacement, axis=-1).max())
    modulus = force / (2.0 * radius * moved)
    if modulus > seen.limits.largest_modulus:
        evidence = (
            f"under {force:.3g} N no marker moves by more than {1e6 * moved:.3g} µm, as on a skin of {modulus:.2g} Pa"
        )
        remedy = "make sure that displacement is in m (a mapping's `unit`), and force in N"
        yield Finding("displacement too small", evidence, remedy)


def force_sign(seen: Subject) -> Iterator[Finding]:
    """Forces with the wrong sign."""
    if seen.forces is None:
        return
    signed = seen.forces.pressing.sum(axis=(1, 2))
    strongest = float(signed[np.argmax(np.abs(signed))])
    if strongest < 0.0:
        evidence = f"the object pulls with {-strongest:.3g} N where forces are largest"
        remedy = "turn the sign of the forces: those of the object on the sensor, whose z points outwards"
        yield Finding("force pulls", evidence, remedy)


def saturation(seen: Subject) -> Iterator[Finding]:
    """Readings at the end of their range."""
    measured = None if seen.log.has_reconstructed_force else seen.log.force
    contact = seen.history.contact
    touched = int(np.count_nonzero(contact.any(axis=0)))
    for name, field in (("displacement", seen.log.displacement), ("force", measured)):
        if field is None or not field.any():
            continue
        at_end = saturated(field, seen.log.observed) & contact[..., None]
        ended = int(np.count_nonzero(at_end.any(axis=(0, 3))))
        if ended > max(seen.limits.symmetric, seen.limits.saturated_share * touched):
            axes = " and ".join(axis for k, axis in enumerate("xyz") if at_end[..., k].any())
            evidence = f"{ended} of the {touched} elements that touch reach the largest {name} along {axes}"
            yield Finding("saturation", evidence, "press less, or choose a wider range of the sensor")


def rest_in_contact(seen: Subject) -> Iterator[Finding]:
    """A recording that begins after the touch: an element goes on touching. Noise, which is known only after a few
    frames, lets others seem to touch in the first.
    """
    first = seen.history.contact[: seen.limits.least_rest]
    if first.all(axis=0).any():
        yield from begun_in_contact(first[0])


def begun_in_contact(contact: BoolArray) -> Iterator[Finding]:
    """That a recording begins after the touch, by which elements [n, m] touch in its first frame."""
    touching = int(np.count_nonzero(contact))
    if touching:
        evidence = f"{touching} elements touch in the first frame"
        yield Finding("no rest", evidence, "begin the recording before the touch: what was before is not known")


def found_by_detector(seen: Subject) -> Iterator[Finding]:
    """What the detector itself found inconsistent."""
    yield from seen.history.findings
