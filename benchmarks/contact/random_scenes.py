"""Random scenes over all effects of mechanics, each a function of its seed: for what holds of every scene."""

import numpy as np

from slipcore.contact import effects
from slipcore.contact.plan.plan import Effect
from slipcore.contact.scene import Finger, Press, Scene

LIKELY, RARE = 0.35, 0.15
"""How probable an effect is in a scene: one of those that most scenes have, one of the others."""


def random_scene(seed: int) -> Scene:
    """A press and two changes of the load (or of the place), with any effects; below sliding where load is given."""
    rng = np.random.default_rng([20261124, seed])
    force, friction = float(rng.uniform(2.0, 20.0)), float(rng.uniform(0.2, 0.8))
    thickness = float(rng.uniform(3e-3, 8e-3))
    finger = Finger(poisson_ratio=float(rng.choice([0.0, 0.3, 0.45, 0.49])), thickness=thickness)
    coupled = rng.random() < LIKELY
    found: list[Effect] = [_surface(rng), _drive(rng, force * friction)]
    if coupled and friction > 0.3:
        found.append(effects.NormalTangentialCoupling())
    if rng.random() < LIKELY:
        found.append(effects.FiniteLayer(thickness))
    found += [effect for effect in _others(rng, friction) if rng.random() < RARE]
    if rng.random() < RARE:
        strength = float(rng.uniform(0.05, 0.4))
        found.append(effects.Viscoelasticity((strength,), (float(rng.uniform(0.05, 1.0)),)))
    points = int(rng.choice([8, 12, 20]))
    found.append(effects.SensorSampling((points, points), 15e-3 / points, float(rng.choice([6.0, 10.0, 20.0]))))
    present = tuple(effect for effect in found if not effect.absent)
    return Scene(f"random {seed}", present, finger=finger, friction=friction, press=Press(force, 1.0), duration=2.0)


def _surface(rng: np.random.Generator) -> Effect:
    """The object's shape; flat as often as each other one."""
    curvature = float(rng.uniform(5.0, 60.0))
    shapes: tuple[Effect, ...] = (
        effects.SphereSurface(0.0),
        effects.SphereSurface(curvature),
        effects.CylinderSurface(curvature, float(rng.uniform(0.0, np.pi))),
        effects.RingSurface(float(rng.uniform(2e-3, 4e-3)), float(rng.uniform(1e-3, 3e-3))),
        effects.WavySurface(float(rng.uniform(5e-6, 4e-5)), float(rng.uniform(2e-3, 5e-3))),
    )
    return shapes[int(rng.integers(len(shapes)))]


def _drive(rng: np.random.Generator, sliding: float) -> Effect:
    """A path of force and moment, or of the object's place."""
    angle, turn = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-np.pi, np.pi)
    first, second = rng.uniform(0.2, 0.85, 2)
    instants = (1.0, 1.5, 2.0)
    x = tuple(float(value) for value in (0.0, first * np.cos(angle), second * np.cos(angle + turn)))
    y = tuple(float(value) for value in (0.0, first * np.sin(angle), second * np.sin(angle + turn)))
    if rng.random() < RARE:
        scale = 2e-4
        return effects.ObjectMotion(instants, tuple(scale * v for v in x), tuple(scale * v for v in y))
    moment = float(rng.uniform(-1.0, 1.0)) * 1e-3 * sliding * (rng.random() < LIKELY)
    forces = (tuple(sliding * v for v in x), tuple(sliding * v for v in y))
    return effects.LoadPath(instants, force_x=forces[0], force_y=forces[1], moment=(0.0, moment, 0.0))


def _others(rng: np.random.Generator, friction: float) -> tuple[Effect, ...]:
    """Effects of friction and of the object."""
    return (
        effects.ElasticObject(float(10.0 ** rng.uniform(5.7, 7.5))),
        effects.FrictionPatch(
            float(rng.uniform(-0.3, 0.3)) * friction,
            (float(rng.uniform(-2e-3, 2e-3)), 0.0),
            float(rng.uniform(1e-3, 3e-3)),
        ),
        effects.RandomFriction(0.1 * friction, float(rng.uniform(1e-3, 3e-3))),
        effects.PressureFriction(float(rng.uniform(-1.0, 0.0)), 5.625e-7),
        effects.VelocityFriction(float(rng.uniform(0.0, 5.0))),
    )
