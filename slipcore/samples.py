"""Friction samples at slipping points (stage 5: samples)."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from slipcore.defaults import SampleOptions, choose_options
from slipcore.element_forces import ElementForces, element_forces
from slipcore.errors import InvalidInput, NoForces
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.noise import estimate_noise
from slipcore.slip_state import SlipHistory
from slipcore.strain import Lattice, lattice_steps, surface_normal

Scalar = TypeVar("Scalar", bound=np.generic)


@dataclass(frozen=True, slots=True, eq=False)
class FrictionSamples:
    """Friction observed at slipping micro-elements, one entry an element and frame: arrays [k].

    ``friction_coefficient`` f_t/f_n [-], ``tangential_velocity`` m/s (≥ 0), ``normal_force`` N and
    ``tangential_force`` N of the element (paper, eq. 38–39, as magnitudes), ``time`` s, ``element`` row-major index,
    ``weight`` probability that the element did slip, ``element_area`` m².
    """

    friction_coefficient: FloatArray
    tangential_velocity: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    time: FloatArray
    element: NDArray[np.int64]
    weight: FloatArray
    element_area: float

    def __post_init__(self) -> None:
        count = len(self.friction_coefficient)
        for entry in fields(self)[:-1]:
            shape = np.shape(getattr(self, entry.name))
            if shape != (count,):
                raise InvalidInput(entry.name, f"of shape {list(shape)}", f"shape [{count}]")

    def __len__(self) -> int:
        return len(self.friction_coefficient)

    def at_element_area(self, element_area: float) -> "FrictionSamples":
        """The same pressures on elements of another area, m²: forces scale with it, friction and velocity do not."""
        factor = element_area / self.element_area
        return replace(
            self,
            normal_force=self.normal_force * factor,
            tangential_force=self.tangential_force * factor,
            element_area=element_area,
        )

    @classmethod
    def concatenate(cls, parts: Sequence["FrictionSamples"]) -> "FrictionSamples":
        """Join samples, as of elements of the smallest area among them; raises ``InvalidInput`` for no parts."""
        if not parts:
            raise InvalidInput("parts", "none", "at least one")
        area = min(part.element_area for part in parts)
        alike = [part.at_element_area(area) for part in parts]
        joined = {
            entry.name: np.concatenate([getattr(part, entry.name) for part in alike]) for entry in fields(cls)[:-1]
        }
        return cls(**joined, element_area=area)


def collect_samples(log: GraspLog, history: SlipHistory, **options: float) -> FrictionSamples:
    """Observe friction where ``history`` says that elements of ``log`` slip: f_t/f_n, velocity and forces.

    Only at compressed elements in contact, of observable velocity above what noise alone makes (a stuck point's
    f_t/f_n is below the friction coefficient) and of normal force well above its noise. The tangential force is freed
    of what noise adds to a magnitude. A log without (observable) slip gives no samples, of length 0.
    ``options``: see ``defaults.SampleOptions``.
    Raises ``NoForces`` for a log without forces, ``InvalidInput`` for a history of another log and for bad options.
    """
    chosen = choose_options(SampleOptions, options)
    if log.force is None:
        raise NoForces("friction samples need the force on each element, and the log has none")
    _check_same(log, history)
    forces = element_forces(log.force, _normals(log))
    noise = _force_noise(log, forces, chosen)
    speed = np.sqrt(np.vecdot(history.velocity, history.velocity))
    weight = _before(history.probability)
    keep = (
        _before(history.slip)
        & history.contact
        & (weight >= chosen.least_weight)
        & _fast_enough(log, history, speed, chosen)
        & _pressed_enough(forces, noise.normal, chosen)
    )
    frame, element = np.nonzero(keep.reshape(len(log), -1))
    f_n, f_t = forces.normal[keep], _without_noise(forces.tangential[keep], noise.tangential)
    return FrictionSamples(
        friction_coefficient=f_t / f_n,
        tangential_velocity=speed[keep],
        normal_force=f_n,
        tangential_force=f_t,
        time=log.time[frame],
        element=element.astype(np.int64),
        weight=weight[keep],
        element_area=log.element_area,
    )


def _before(field: NDArray[Scalar]) -> NDArray[Scalar]:
    """The field [t, ...] as it was one frame earlier; zero in the first.

    A detector that looks at the forces finds slip where their noise raises f_t/f_n: samples that it chose by their own
    noise would be biased. The noise of the frame before is independent of theirs.
    """
    earlier = np.zeros_like(field)
    earlier[1:] = field[:-1]
    return earlier


def _normals(log: GraspLog) -> FloatArray:
    if log.normal is not None:
        return log.normal
    lattice = Lattice.at_rest(log.position)
    return np.stack([surface_normal(lattice, lattice_steps(u)) for u in log.displacement])


def _check_same(log: GraspLog, history: SlipHistory) -> None:
    expected = (len(log), *log.grid)
    if history.contact.shape != expected:
        raise InvalidInput("history", f"of shape {list(history.contact.shape)}", f"the log's own, {list(expected)}")
    if not np.array_equal(history.time, log.time):
        raise InvalidInput("history", "at other times than the log", "the log's own")


def _fast_enough(log: GraspLog, history: SlipHistory, speed: FloatArray, options: SampleOptions) -> BoolArray:
    interval = np.diff(log.time, prepend=-np.inf)[:, None, None]
    noise = np.sqrt(2.0) * np.nan_to_num(history.noise) / interval
    fast: BoolArray = speed > np.maximum(options.least_velocity, options.velocity_to_noise * noise)
    return fast


class _ForceNoise(NamedTuple):
    """Standard deviation of an element's normal force and of one tangential component, N."""

    normal: float
    tangential: float


def _force_noise(log: GraspLog, forces: ElementForces, options: SampleOptions) -> _ForceNoise:
    if not np.isnan(options.force_noise):
        return _ForceNoise(options.force_noise, options.force_noise)
    assert log.force is not None
    plane = log.force[..., :2].reshape(len(log), -1, 2).swapaxes(1, 2)
    normal = estimate_noise(log.time, forces.pressing.reshape(len(log), 1, -1))
    return _ForceNoise(float(np.nan_to_num(normal)), float(np.nan_to_num(estimate_noise(log.time, plane))))


def _without_noise(tangential: FloatArray, noise: float) -> FloatArray:
    """Noise across a small force only ever lengthens it, by σ²/(2 f_t) on average: 3 % at f_t = 4 σ."""
    return np.sqrt(np.maximum(tangential**2 - noise**2, 0.0))


def _pressed_enough(forces: ElementForces, noise: float, options: SampleOptions) -> BoolArray:
    peak = forces.pressing.max(axis=(1, 2))
    least = np.maximum(options.force_to_noise * noise, options.least_force_share * peak)
    enough: BoolArray = forces.pressing > np.maximum(least, 0.0)[:, None, None]
    return enough
