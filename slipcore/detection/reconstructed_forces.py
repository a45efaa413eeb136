"""How forces that follow from displacement count in slip: they and their errors are that displacement once more."""

from slipcore.defaults import RECONSTRUCTED_FORCES


def for_reconstructed_forces(deviation: float) -> dict[str, float]:
    """Options of method "filter" for reconstructed forces with this standard ``deviation`` N on an element.

    It is noise that lasts; each frame's ratio counts less, since errors of frames are not independent; and forces
    against the object's motion are no friction of slip.
    """
    return {
        "force_floor": deviation,
        "ratio_weight": RECONSTRUCTED_FORCES.ratio_weight,
        "heading_length": RECONSTRUCTED_FORCES.heading_length,
    }
