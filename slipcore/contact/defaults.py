"""Every default of the contact simulator, with unit, source and valid range."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Ramp:
    """The closed-form tangential ramp: the paper's Condition 1 (Table I) on its sensor's lattice (Section IV-A)."""

    friction: float = 0.4
    """Coulomb coefficient [-], above 0; Table I."""
    normal_force: float = 10.0
    """N, above 0; Table I."""
    tangential_force: float = 0.95
    """In units of the sliding force μF_N, 0 to 1; 0.99 at the end of Condition 1, 0.95 leaves a stick circle to see."""
    sphere_radius: float = 15e-3
    """m, above 0; fingertip of Fig. 5."""
    young_modulus: float = 1e6
    """Pa, above 0; fingertip of Fig. 5."""
    poisson_ratio: float = 0.49
    """[-], above −1 and at most 0.5; silicone gels are nearly incompressible, the paper gives none."""
    points: int = 20
    """Markers along each side, 2 or more; Section IV-A."""
    pitch: float = 0.75e-3
    """m between markers, above 0; a 14 mm wide field."""
    frame_rate: float = 30.0
    """1/s, above 0; Section IV-A."""


RAMP = Ramp()
