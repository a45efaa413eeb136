"""What the other materials of a sensor say of one, before it has grasps of its own."""

from sqlalchemy.orm import Session

import estimators
from db.repositories import friction_models
from estimators import ScatterPrior
from service.domain.models.recommended import PREFERENCE
from service.domain.models.stored_results import to_friction_model
from service.domain.models.surface_change import MARK

MOST_OTHERS = 100
"""Materials that are asked, the latest fitted: more make the prior hardly sharper."""


def prior_from_others(session: Session, material_id: int) -> ScatterPrior:
    """The prior of scatter between grasps of a material, by the current models of the others of its sensors.

    Models of a surface that has changed are left out: their scatter is of two surfaces.
    """
    others = friction_models.of_same_sensors(session, material_id, PREFERENCE[0], MOST_OTHERS)
    unchanged = (each.model for each in others if MARK not in each.model.diagnostics)
    return estimators.population_scatter(map(to_friction_model, unchanged))
