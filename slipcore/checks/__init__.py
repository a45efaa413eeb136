"""What is wrong with a log, or with what was found in it: findings with their evidence and what to do.

Most recordings that give a wrong friction break no rule of their format. These checks look at what a sensor cannot
have measured, and at what a friction coefficient cannot depend on.
"""

import numpy as np

from slipcore.checks import contact, friction, recording
from slipcore.checks import forces as force_checks
from slipcore.checks.subject import Check, Subject
from slipcore.defaults import CheckOptions, choose_options
from slipcore.element_forces import element_forces
from slipcore.errors import NoForces, UnknownScale
from slipcore.finding import SEVERITIES, Finding
from slipcore.frames import GraspLog
from slipcore.patch.friction import contact_friction
from slipcore.samples import FrictionSamples, element_samples
from slipcore.slip_state import SlipHistory
from slipcore.surface.log_normals import normals_of

__all__ = ["AGAINST_FRICTION", "Finding", "check_log"]

CHECKS: tuple[Check, ...] = (
    recording.time_unit,
    recording.still_markers,
    recording.no_contact,
    recording.places_for_displacement,
    recording.element_area,
    recording.repeated_frames,
    recording.interpolated_frames,
    recording.force_unit,
    recording.displacement_unit,
    recording.force_sign,
    recording.saturation,
    recording.rest_in_contact,
    recording.found_by_detector,
    force_checks.zero_offset,
    force_checks.zero_drift,
    force_checks.leaning_normals,
    force_checks.gripper_force,
    force_checks.force_frame,
    contact.load_free_tangential_force,
    contact.moving_contact,
    friction.no_slip,
    friction.friction_of_surfaces,
    friction.friction_by_force,
    friction.friction_by_place,
    friction.scatter_beyond_noise,
    friction.friction_against_contact,
)
"""In the order in which findings are listed: the recording first, then what was found in it."""

AGAINST_FRICTION = frozenset(name for name, severity in SEVERITIES.items() if severity == "warning")
"""Names of the findings that are warnings: friction from such logs is not the material's."""


def check_log(
    log: GraspLog, history: SlipHistory, samples: FrictionSamples | None = None, **options: float
) -> list[Finding]:
    """Look for what makes friction from this log doubtful; an empty list is no proof that all is well.

    ``history``: what a detector found in it; ``samples`` of its elements, else they are collected; ``options``: see
    ``defaults.CheckOptions``. Raises ``InvalidInput`` for an option that does not exist or is out of its range.
    """
    limits = choose_options(CheckOptions, options)
    normal = None if log.force is None else normals_of(log)
    forces = None if log.force is None or normal is None else element_forces(log.force, normal)
    pressing = np.zeros(log.displacement.shape[:3]) if forces is None else np.maximum(forces.pressing, 0.0)
    samples = _samples(log, history) if samples is None else samples
    contact = contact_friction(log.time, history.patches)
    subject = Subject(log, history, forces, normal, pressing, samples, contact, limits)
    return [finding for check in CHECKS for finding in check(subject)]


def _samples(log: GraspLog, history: SlipHistory) -> FrictionSamples | None:
    try:
        return element_samples(log, history)
    except (NoForces, UnknownScale):
        return None
