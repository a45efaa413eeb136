"""What to record next: the grasp that most narrows what a planner is given, per second of robot time.

A c-optimal design, one grasp ahead (Elfving, 1952; Chaloner & Verdinelli, 1995, Statistical Science 10:273): of all
grasps that a robot can make, the one after which the friction at the planner's working point is known best.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.arguments import above_zero, at_least_zero, check_kind, check_number, check_whole
from estimators.defaults import DESIGN, IDENTIFIABILITY
from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel, Scales
from slipcore.arguments import shown

FloatArray = NDArray[np.float64]

GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
"""rad; directions that far apart fill the circle evenly, however many there are."""

NODES, WEIGHTS = np.array([-1.0, 0.0, 1.0]), np.array([1.0, 2.0, 1.0]) / 4.0
"""Of a grasp's places about their mean, in standard deviations over √2."""


SPEEDS, LENGTHS = DESIGN.least_speed * 2.0 ** np.arange(4), DESIGN.least_length * 2.0 ** np.arange(3)
"""Of a probe's slip, m/s and m, that a robot may choose unless another is given."""


def _check_each(name: str, values: object, allowed: str) -> None:
    """Raises ``InvalidSamples`` unless these are one or more numbers above 0."""
    if not isinstance(values, Sequence) or not values:
        raise InvalidSamples(name, shown(values), allowed)
    for value in values:
        check_number(name, value, above_zero, allowed)


def _check_ends(name: str, ends: tuple[float, float], allowed: str) -> None:
    """Raises ``InvalidSamples`` unless these are two numbers above 0, the smaller one first."""
    _check_each(name, ends, allowed)
    if len(ends) != 2 or ends[0] > ends[1]:
        raise InvalidSamples(name, shown(ends), allowed)


@dataclass(frozen=True, slots=True)
class WorkingPoint:
    """What a planner asks of friction: the ``quantile`` of a contact of so many ``elements`` at an element's normal
    force (N) and a tangential velocity (m/s), 0 for a grasp that holds.
    """

    normal_force: float
    tangential_velocity: float = 0.0
    quantile: float = DESIGN.quantile
    elements: int = DESIGN.elements

    def __post_init__(self) -> None:
        check_number("normal_force", self.normal_force, above_zero, "N an element, above 0")
        check_number("tangential_velocity", self.tangential_velocity, at_least_zero, "m/s, at least 0")
        check_number("quantile", self.quantile, lambda value: 0.0 < value < 0.5, "above 0 and below 0.5")
        check_whole("elements", self.elements, 1)


@dataclass(frozen=True, slots=True)
class Probing:
    """What the robot can do, and what a probe is like.

    ``normal_force`` N: least and greatest mean of a contact's elements; ``speed`` m/s and ``length`` m of the slip that
    may be chosen; ``seconds`` for a grasp beside its slip; ``frame_rate`` 1/s of the sensor; ``load`` N that the
    contact bears meanwhile, which it drops with at most ``drop_probability``; parts of a probe: ``slipping`` of the
    contact's elements, whose normal forces and velocities have the standard deviations ``force_spread`` and
    ``velocity_spread``, in parts of their means.
    """

    normal_force: tuple[float, float] | None = None
    speed: tuple[float, ...] = tuple(SPEEDS.tolist())
    length: tuple[float, ...] = tuple(LENGTHS.tolist())
    seconds: float = DESIGN.seconds
    frame_rate: float = DESIGN.frame_rate
    load: float = 0.0
    drop_probability: float = DESIGN.drop_probability
    slipping: float = DESIGN.slipping
    force_spread: float = DESIGN.force_spread
    velocity_spread: float = DESIGN.velocity_spread

    def __post_init__(self) -> None:
        for name, unit in (("speed", "m/s"), ("length", "m")):
            _check_each(name, getattr(self, name), f"one or more, each above 0 {unit}")
        if self.normal_force is not None:
            _check_ends("normal_force", self.normal_force, "N an element, above 0, the least first")
        check_number("seconds", self.seconds, at_least_zero, "s, at least 0")
        check_number("frame_rate", self.frame_rate, above_zero, "1/s, above 0")
        check_number("load", self.load, at_least_zero, "N, at least 0")
        allowed = "above 0, at most 0.5"
        check_number("drop_probability", self.drop_probability, lambda value: 0.0 < value <= 0.5, allowed)
        allowed = "a part of the contact, above 0 and at most 1"
        check_number("slipping", self.slipping, lambda value: 0.0 < value <= 1.0, allowed)
        for name in ("force_spread", "velocity_spread"):
            check_number(name, getattr(self, name), at_least_zero, "a part of the mean, at least 0")


@dataclass(frozen=True, slots=True)
class NextGrasp:
    """The grasp to record: mean ``normal_force`` of an element N, ``slip_length`` m, ``speed`` m/s and ``direction``
    rad of the slip; ``seconds`` that it takes.

    ``uncertainty``: half-width of the 95 % interval of the friction expected at the working point, now and as it is
    expected ``after``; ``conservative_friction`` there now; ``beyond``: a sentence where it presses harder than any
    grasp of the model did.
    """

    normal_force: float
    slip_length: float
    speed: float
    direction: float
    seconds: float
    uncertainty: float
    after: float
    conservative_friction: float
    beyond: str | None = None


def next_grasp(
    model: FrictionModel, working_point: WorkingPoint, probing: Probing | None = None, grasps: int = 0
) -> NextGrasp:
    """The grasp that most narrows friction at the working point per second of robot time.

    ``grasps`` made so far choose its direction, of which the law knows nothing: directions are spread evenly. Raises
    ``InvalidSamples`` where no grasp that the robot can make bears its load, and for arguments of another kind.
    """
    probing = Probing() if probing is None else probing
    check_kind("model", model, FrictionModel)
    check_kind("working_point", working_point, WorkingPoint)
    check_kind("probing", probing, Probing)
    check_whole("grasps", grasps, 0)
    point = np.array([1.0, working_point.tangential_velocity, working_point.normal_force])
    variance = float(point @ model.covariance @ point)
    designs = Designs.of(_forces(model, working_point, probing), working_point.elements, probing)
    if not len(designs.normal_force):
        allowed = f"what friction holds, but for {probing.drop_probability:g} of the grasps: lay it on a table"
        raise InvalidSamples("load", probing.load, allowed)
    left = updated(model.covariance, designs.roots(model))
    after = np.sqrt(np.maximum(point @ left @ point, 0.0))
    best = int(np.argmax((math.sqrt(variance) - after) / designs.seconds))
    score = float(special.stdtrit(model.degrees_of_freedom, IDENTIFIABILITY.ends[1]))
    conservative = model.predict(point[1], point[2], working_point.quantile, "contact", working_point.elements)
    return NextGrasp(
        normal_force=float(designs.normal_force[best]),
        slip_length=float(designs.length[best]),
        speed=float(designs.speed[best]),
        direction=grasps * GOLDEN_ANGLE % (2.0 * math.pi),
        seconds=float(designs.seconds[best]),
        uncertainty=score * math.sqrt(variance),
        after=score * float(after[best]),
        conservative_friction=float(conservative),
        beyond=_beyond(float(designs.normal_force[best]), model.domain.normal_force[1]),
    )


def updated(covariance: FloatArray, roots: FloatArray) -> FloatArray:
    """Covariance [..., 3, 3] of β after data whose information is RᵀR, (Σ⁻¹ + RᵀR)⁻¹, by R [..., 3, 3].

    With Σ = LLᵀ and RL = USVᵀ it is LV(1 + S²)⁻¹VᵀLᵀ: nothing is squared, and Σ [3, 3] or R may be singular.
    """
    root = _root(covariance)
    _, singular, along = np.linalg.svd(roots @ root)
    left = root @ (along.swapaxes(-1, -2) / np.hypot(1.0, singular)[..., None, :])
    return np.asarray(left @ left.swapaxes(-1, -2))


def _root(covariance: FloatArray) -> FloatArray:
    """L [3, 3] with LLᵀ = Σ, whose variances may be of any size."""
    deviation = np.sqrt(np.diag(covariance))
    scale = np.where(deviation > 0.0, deviation, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


@dataclass(frozen=True, slots=True, eq=False)
class Designs:
    """Grasps that could be made, each [d]: mean ``normal_force`` of an element (N), ``speed`` m/s and ``length`` m of
    the slip, of which the contact has so many ``elements``.
    """

    normal_force: FloatArray
    speed: FloatArray
    length: FloatArray
    elements: int
    probing: Probing

    @classmethod
    def of(cls, forces: FloatArray, elements: int, probing: Probing) -> "Designs":
        """All speeds and lengths that the robot can choose at each of the forces [f]."""
        force, speed, length = np.meshgrid(forces, probing.speed, probing.length, indexing="ij")
        return cls(force.ravel(), speed.ravel(), length.ravel(), elements, probing)

    @property
    def seconds(self) -> FloatArray:
        """Robot time [d]."""
        return self.probing.seconds + self.length / self.speed

    def places(self) -> tuple[FloatArray, FloatArray]:
        """x = (1, v, f_n) [d, 9, 3] of a grasp's places, at half of the speed on average, and their numbers [9]."""
        v = 0.5 * np.outer(self.speed, 1.0 + math.sqrt(2.0) * self.probing.velocity_spread * NODES)
        f_n = np.outer(self.normal_force, 1.0 + math.sqrt(2.0) * self.probing.force_spread * NODES)
        x = np.ones((len(v), len(NODES), len(NODES), 3))
        x[..., 1], x[..., 2] = np.maximum(v, 0.0)[:, :, None], f_n[:, None, :]
        count = max(self.probing.slipping * self.elements, 1.0) * np.outer(WEIGHTS, WEIGHTS).ravel()
        return x.reshape(len(v), -1, 3), count

    def roots(self, model: FrictionModel) -> FloatArray:
        """R [d, 3, 3] of what each grasp would say of β, RᵀR: that of its places, less what how grasps vary hides.

        With A = Q₀ᵀQ₀ of its places and scatter τ of the whole law, the information is A − A b bᵀ A τ²/(1 + τ² bᵀ A b),
        b = β (Sherman & Morrison), as in the fit; R = (1 − t a aᵀ) Q₀ with a = Q₀ b, 1 − t aᵀa = 1/√(1 + τ² aᵀa).
        """
        between, places, within = scatter(model)
        x, count = self.places()
        frames = np.maximum(self.probing.frame_rate * self.length / self.speed, 1.0)
        weight = np.sqrt(count / (places**2 + within**2 / frames[:, None]))
        whole = np.linalg.qr(weight[:, :, None] * x, mode="r")
        law = whole @ model.coefficients
        size = np.maximum((law**2).sum(axis=1), np.finfo(float).tiny)
        hidden = (1.0 - 1.0 / np.hypot(1.0, between * np.sqrt(size))) / size
        along = np.einsum("di,dij->dj", law, whole)
        return np.asarray(whole - hidden[:, None, None] * law[:, :, None] * along[:, None, :])


def scatter(model: FrictionModel) -> tuple[float, float, float]:
    """τ, ω and σ of the model; all scatter as that of whole grasps where its method does not separate them.

    Sensors' gains count as scatter of grasps where they are of several: what β is between sensors one grasp does not
    say.
    """
    least = DESIGN.least_scatter * max(abs(float(model.coefficients[0])), DESIGN.least_scatter)
    if model.scales is None:
        middle = [1.0, *(0.5 * sum(ends) for ends in (model.domain.tangential_velocity, model.domain.normal_force))]
        friction = abs(float(np.dot(middle, model.coefficients)))
        return model.scale / max(friction, least), 0.0, max(model.scale, least)
    scales: Scales = model.scales
    gains = 0.0 if scales.between_sensors is None else scales.between_sensors.scale.value
    between = math.hypot(scales.between_grasps.value, gains)
    return between, scales.between_places.value, max(scales.within.value, least)


def _beyond(normal_force: float, most: float) -> str | None:
    """That a grasp presses harder, N an element, than the ``most`` of those before."""
    if normal_force <= most:
        return None
    harder = f"{normal_force:.4g} N an element is more than any grasp had so far ({most:.4g})"
    return f"{harder}: make sure that sensor and object bear it"


def _forces(model: FrictionModel, working_point: WorkingPoint, probing: Probing) -> FloatArray:
    """Mean normal forces of an element, N, at which a grasp bears the load, [f]."""
    asked, (least, most) = working_point.normal_force, model.domain.normal_force
    low, high = probing.normal_force or (min(0.5 * least if least > 0.0 else asked, asked), max(2.0 * most, asked))
    forces = np.append(np.geomspace(low, high, DESIGN.forces), np.clip(working_point.normal_force, low, high))
    held = model.predict(0.0, forces, probing.drop_probability, "contact", working_point.elements)
    return np.asarray(forces[held * forces * working_point.elements >= probing.load])
