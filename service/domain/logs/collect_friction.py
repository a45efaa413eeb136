"""What a log says of friction, and where that is nothing, why."""

from typing import TYPE_CHECKING

import numpy as np

import slipcore
from slipcore import Collected, ContactFriction, FrictionSamples, GraspLog, SlipHistory

if TYPE_CHECKING:
    from slipcore.forces import Reconstruction


def collect(
    log: GraspLog, history: SlipHistory, reconstruction: "Reconstruction | None"
) -> tuple[Collected, str | None]:
    """What is known of friction, and if there are no samples, why; noise of reconstructed forces is theirs."""
    if not log.is_scaled:
        return _no_samples(log), "the log's scale is unknown; friction needs velocities in m/s, not pixels a second"
    if log.force is None:
        return _no_samples(log), _without_forces(log)
    if not history.contact.any():
        return _no_samples(log), f"no element was in contact in any of the {len(log)} frames"
    if reconstruction is None:
        found = slipcore.collect_friction(log, history)
    else:
        found = slipcore.collect_friction(reconstruction.for_samples(log), history, **reconstruction.of_samples)
    if len(found.samples) == 0:
        because = found.elements_left_out or _unsure(log, reconstruction) or _without_samples(log, history)
        return found, "; ".join(filter(None, (because, _bound(found.contact))))
    return found, None


def _unsure(log: GraspLog, reconstruction: "Reconstruction | None") -> str | None:
    """That elements' reconstructed normal forces are too unsure for any sample, where they are."""
    if reconstruction is None or log.force is None:
        return None
    largest, noise = float(-log.force[..., 2].min()), reconstruction.force_noise
    if largest >= reconstruction.of_samples["force_to_noise"] * noise:
        return None
    return (
        f"elements' normal forces follow from displacement to ± {1e3 * noise:.2g} mN of at most "
        f"{1e3 * largest:.2g} mN, too unsure for samples; let all of the contact slide, and record the object's pose"
    )


def _without_samples(log: GraspLog, history: SlipHistory) -> str:
    if not log.has_displacement:
        return "forces alone show slip but no velocity, so there are no friction samples"
    seen = f"no slip gave a friction sample ({int(history.slip.sum())} slipping elements in {len(log)} frames)"
    return f"{seen}; an element counts once all around it slips: load it further, or press less"


def _without_forces(log: GraspLog) -> str:
    from service.domain.sensors.names import NAMELESS  # with the database, which local commands go without

    reason = "the log has no forces; friction is tangential over normal force. "
    if left_out := log.metadata.get("columns_left_out"):
        reason += f"If they are among the columns that were left out ({left_out[:80]}), say which in a mapping. "
    if log.sensor in NAMELESS:
        gel = "describe its gel, from which forces follow, and send the log again with the sensor's name (`sensor=`)"
    else:
        gel = f"describe the gel of sensor {log.sensor!r}, from which forces follow, and send the log again"
    return f"{reason}If a sensor sees only its markers move, {gel}"


def _bound(contact: ContactFriction | None) -> str | None:
    return None if contact is None else f"by the load that the contact bore, friction is at least {contact.low:.2g}"


def _no_samples(log: GraspLog) -> Collected:
    none = np.empty(0)
    samples = FrictionSamples(none, none, none, none, none, none.astype(int), none, log.element_area)
    return Collected(samples, samples, None, None)
