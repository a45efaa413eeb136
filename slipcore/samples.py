"""Friction samples at slipping points (stage 5: samples)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipcore.defaults import SampleOptions, choose_options
from slipcore.element_forces import ElementForces, element_forces
from slipcore.errors import InvalidInput, NoForces, UnknownScale
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.repeated_frames import of_own
from slipcore.slip_state import SlipHistory
from slipcore.surface.log_normals import normals_of

if TYPE_CHECKING:
    from slipcore.labelled import DataFrame, Dataset

Scalar = TypeVar("Scalar", bound=np.generic)
KIND = "<U7"
"""Of the names of kinds."""

UNITS = {"tangential_velocity": "m/s", "normal_force": "N", "tangential_force": "N", "time": "s"}
"""Of the arrays that have one."""

NUMBERS = ("element_area", "normal_force_noise", "velocity_noise")
"""What is one number for all samples."""

SENSOR = "sensor"
"""What is one name for all samples."""


@dataclass(frozen=True, slots=True, eq=False)
class FrictionSamples:
    """Friction observed at slipping micro-elements, one entry an element and frame, or of whole contacts: arrays [k].

    ``friction_coefficient`` f_t/f_n [-], ``tangential_velocity`` m/s (≥ 0), ``normal_force`` N and
    ``tangential_force`` N of the element (paper, eq. 38–39, as magnitudes; the normal force as friction averages it,
    see ``element_samples``), ``time`` s, ``element`` row-major index,
    ``weight`` probability that the element did slip, ``element_area`` m², ``normal_force_noise`` N and
    ``velocity_noise`` m/s: standard deviations of the noise that is still in ``normal_force`` and in
    ``tangential_velocity``. ``kind``: "element", or "contact" where the whole of a patch slid or
    pivoted: its ``normal_force`` is then the mean of its elements, weighted by force, and its ``element`` lies beyond
    the lattice. ``velocity_is_relative``: whether the velocity is that relative to what seems to stick, for want of the
    object's motion; once all of the contact slides evenly that is far too small. ``sensor``: the name of the sensor
    that recorded them, or "" where that is not known.
    """

    friction_coefficient: FloatArray
    tangential_velocity: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    time: FloatArray
    element: NDArray[np.int64]
    weight: FloatArray
    element_area: float
    normal_force_noise: float = 0.0
    velocity_noise: float = 0.0
    kind: NDArray[np.str_] = field(default_factory=lambda: np.empty(0, KIND))
    velocity_is_relative: BoolArray = field(default_factory=lambda: np.empty(0, bool))
    sensor: str = ""

    def __post_init__(self) -> None:
        count = len(self.friction_coefficient)
        if len(self.kind) == 0:
            object.__setattr__(self, "kind", np.full(count, "element", KIND))  # the record is frozen
        if len(self.velocity_is_relative) == 0:
            object.__setattr__(self, "velocity_is_relative", np.zeros(count, bool))
        for name in self.arrays():
            shape = np.shape(getattr(self, name))
            if shape != (count,):
                raise InvalidInput(name, f"of shape {list(shape)}", f"shape [{count}]")

    @classmethod
    def arrays(cls) -> tuple[str, ...]:
        """Names of the arrays [k]."""
        return tuple(entry.name for entry in fields(cls) if entry.name not in (*NUMBERS, SENSOR))

    def __len__(self) -> int:
        return len(self.friction_coefficient)

    def take(self, rows: NDArray[np.bool_]) -> "FrictionSamples":
        """Some of the samples."""
        return replace(self, **{name: getattr(self, name)[rows] for name in self.arrays()})

    def to_dataframe(self) -> "DataFrame":
        """One row a sample; raises ``ModuleNotFoundError`` where pandas is not installed."""
        from slipcore.labelled import table

        columns = {name: getattr(self, name) for name in self.arrays()}
        return table(columns, **{name: getattr(self, name) for name in NUMBERS})

    def to_xarray(self) -> "Dataset":
        """Labelled arrays with units; raises ``ModuleNotFoundError`` where xarray is not installed."""
        from slipcore.labelled import dataset

        variables = {name: (("sample",), getattr(self, name), UNITS.get(name, "1")) for name in self.arrays()}
        numbers = zip(("element_area_m2", "normal_force_noise_N", "velocity_noise_m_per_s"), NUMBERS, strict=True)
        return dataset(variables, {}, **{label: getattr(self, name) for label, name in numbers})

    def _repr_html_(self) -> str:
        from slipcore.notebook import summary

        rows: dict[str, object] = {"samples": len(self), "element": f"{1e6 * self.element_area:.3g} mm²"}
        for name in ("friction_coefficient", "tangential_velocity", "normal_force") if len(self) else ():
            low, middle, high = np.quantile(getattr(self, name), (0.25, 0.5, 0.75))
            rows[f"{name} [{UNITS.get(name, '-')}]"] = f"{middle:.3g} ({low:.3g} … {high:.3g})"
        return summary("Friction samples: median and quartiles", rows.items())

    def at_element_area(self, element_area: float) -> "FrictionSamples":
        """The same pressures on elements of another area, m²: forces scale with it, friction and velocity do not."""
        factor = element_area / self.element_area
        return replace(
            self,
            normal_force=self.normal_force * factor,
            tangential_force=self.tangential_force * factor,
            element_area=element_area,
            normal_force_noise=self.normal_force_noise * factor,
        )

    @classmethod
    def concatenate(cls, parts: Sequence["FrictionSamples"]) -> "FrictionSamples":
        """Join samples, as of elements of the smallest area among them; raises ``InvalidInput`` for no parts."""
        if not parts:
            raise InvalidInput("parts", "none", "at least one")
        area = min(part.element_area for part in parts)
        alike = [part.at_element_area(area) for part in parts]
        joined = {name: np.concatenate([getattr(part, name) for part in alike]) for name in cls.arrays()}
        count = [len(part) for part in alike]
        sensors = {part.sensor for part in alike}
        return cls(
            **joined,
            element_area=area,
            normal_force_noise=_root_mean_square([part.normal_force_noise for part in alike], count),
            velocity_noise=_root_mean_square([part.velocity_noise for part in alike], count),
            sensor=sensors.pop() if len(sensors) == 1 else "",
        )


def element_samples(log: GraspLog, history: SlipHistory, **options: float) -> FrictionSamples:
    """Observe friction where ``history`` says that elements of ``log`` slip: f_t/f_n, velocity and forces.

    Only at compressed elements in contact, of observable velocity above what noise alone makes (a stuck point's
    f_t/f_n is below the friction coefficient) and of normal force well above its noise, whose four neighbours touch
    and slip too: over an element at the rim pressure differs too much for one friction coefficient, and of one that the
    slip front crosses a part still sticks, so that its f_t/f_n is too low (by 4 % on average). Noise must not choose
    samples nor stand on both sides of a fit: an element is chosen by the frame before, its velocity is that from the
    frame before to the next, and its normal force is what these two say; f_t/f_n alone is of the frame itself, freed of
    what noise adds to a magnitude and to a quotient. Where pressure p differs over an element, friction that goes with
    it is that of ∫p²/∫p, not of the mean (``_as_friction_averages``). A log without (observable) slip gives no samples,
    of length 0, and repeated frames give none of their own.
    ``options``: see ``defaults.SampleOptions``; of forces that the log's metadata call reconstructed, the noise that
    these tell goes before their defaults.
    Raises ``NoForces`` for a log without forces, ``UnknownScale`` for one whose lengths and velocities are not in
    metres, ``InvalidInput`` for a history of another log and for bad options.
    """
    chosen = choose_options(SampleOptions, {**log.of_samples, **options})
    if not log.is_scaled:
        raise UnknownScale("friction samples need velocities in m/s, and the log's scale is unknown")
    if log.force is None:
        raise NoForces("friction samples need the force on each element, and the log has none")
    _check_same(log, history)
    log, history = of_own(log, history)
    assert log.force is not None
    forces = element_forces(log.force, normals_of(log))
    noise = _force_noise(log, forces, chosen)
    velocity, velocity_noise = _central_velocity(log.time, history.velocity), _velocity_noise(log, history)
    speed = np.sqrt(np.vecdot(velocity, velocity))
    steady = _of_neighbouring_frames(log.time, forces.pressing)
    weight = _one_frame_earlier(history.probability)
    keep = (
        _interior(_one_frame_earlier(history.slip))
        & _interior(history.contact)
        & (weight >= chosen.least_weight)
        & _fast_enough(speed, velocity_noise, chosen)
        & _pressed_enough(steady, forces.pressing, noise.normal, chosen)
    )
    frame, element = np.nonzero(keep.reshape(len(log), -1))
    friction = _ratio(forces.tangential[keep], forces.normal[keep], noise)
    normal = _as_friction_averages(steady, keep, noise.normal / math.sqrt(2.0))
    return FrictionSamples(
        friction_coefficient=friction,
        tangential_velocity=speed[keep],
        normal_force=normal,
        tangential_force=friction * normal,
        time=log.time[frame],
        element=element.astype(np.int64),
        weight=weight[keep],
        element_area=log.element_area,
        normal_force_noise=noise.normal / math.sqrt(2.0),  # the mean of two frames
        velocity_noise=_root_mean_square(velocity_noise[frame], np.ones(len(frame))),
        velocity_is_relative=np.full(len(friction), log.object_pose is None),
        sensor=log.sensor,
    )


def _one_frame_earlier(field: NDArray[Scalar]) -> NDArray[Scalar]:
    """The field [t, ...] as it was one frame earlier; zero in the first.

    A detector that looks at the forces finds slip where their noise raises f_t/f_n: samples that it chose by their own
    noise would be biased. The noise of the frame before is independent of theirs.
    """
    earlier = np.zeros_like(field)
    earlier[1:] = field[:-1]
    return earlier


def _interior(region: BoolArray) -> BoolArray:
    """Elements of a region [t, n, m] whose four neighbours are in it; beyond the lattice nothing says otherwise."""
    around = np.pad(region, ((0, 0), (1, 1), (1, 1)), constant_values=True)
    inside: BoolArray = region & around[:, :-2, 1:-1] & around[:, 2:, 1:-1] & around[:, 1:-1, :-2] & around[:, 1:-1, 2:]
    return inside


def _check_same(log: GraspLog, history: SlipHistory) -> None:
    expected = (len(log), *log.grid)
    if history.contact.shape != expected:
        raise InvalidInput("history", f"of shape {list(history.contact.shape)}", f"the log's own, {list(expected)}")
    if not np.array_equal(history.time, log.time):
        raise InvalidInput("history", "at other times than the log", "the log's own")


def _central_velocity(time: FloatArray, velocity: FloatArray) -> FloatArray:
    """Velocity from the frame before to the next: [t, n, m, 2]; NaN in the first and last frame."""
    central = np.full_like(velocity, np.nan)
    behind, ahead = np.diff(time)[:-1, None, None, None], np.diff(time)[1:, None, None, None]
    central[1:-1] = (behind * velocity[1:-1] + ahead * velocity[2:]) / (behind + ahead)
    return central


def _of_neighbouring_frames(time: FloatArray, field: FloatArray) -> FloatArray:
    """A field [t, n, m] as the frames before and after have it, at the true times; NaN in the first and last frame."""
    between = np.full_like(field, np.nan)
    share = ((time[1:-1] - time[:-2]) / (time[2:] - time[:-2]))[:, None, None]
    between[1:-1] = (1.0 - share) * field[:-2] + share * field[2:]
    return between


def _as_friction_averages(force: FloatArray, keep: BoolArray, noise: float) -> FloatArray:
    """Normal forces [k] of the elements to ``keep``, as a law that is linear in pressure p averages them.

    What an element bears is ∫ μ(p) p dA, so that f_t/f_n is μ at ∫p²/∫p: its mean f_n and its variance over f_n. Of
    pressure with the slope g over a square element that is |g|²/12. Slopes are those between the neighbours, whose
    ``noise`` adds half of its variance to the square of each.
    """
    slope = [np.gradient(force, axis=axis)[keep] for axis in (1, 2) if force.shape[axis] > 1]
    square = np.sum([each**2 - 0.5 * noise**2 for each in slope], axis=0)
    return np.asarray(force[keep] + square / (12.0 * force[keep]))


def _velocity_noise(log: GraspLog, history: SlipHistory) -> FloatArray:
    """Of a component of the velocity from the frame before to the next [t], m/s; 0 in the first and last frame."""
    interval = np.full(len(log), np.inf)
    interval[1:-1] = log.time[2:] - log.time[:-2]
    return np.asarray(math.sqrt(2.0) * np.nan_to_num(_noise_of_motion(log, history)) / interval)


def _noise_of_motion(log: GraspLog, history: SlipHistory) -> float:
    """Marker noise as far as two frames do not have it in common, m: what a motion over them bears.

    White noise counts as a whole. Noise of variance σ² that lasts, r from each frame to the next (an autoregressive
    process), shows three frames a variance of σ² (1 − r)(3 − r)/3, and over two frames σ² (1 − r²) of it changes.
    """
    if not any(finding.name == "lasting noise" for finding in history.findings):
        return history.noise
    from slipcore.noise import estimate_noise  # compiled, as above

    shown = estimate_noise(log.time, np.moveaxis(log.displacement[..., :2], -1, 1).reshape(len(log), 2, -1))
    kept = 2.0 - math.sqrt(1.0 + 3.0 * min(shown / history.noise, 1.0) ** 2)
    return history.noise * math.sqrt(1.0 - kept**2)


def _fast_enough(speed: FloatArray, noise: FloatArray, options: SampleOptions) -> BoolArray:
    least = np.maximum(options.least_velocity, options.velocity_to_noise * noise)
    fast: BoolArray = speed > least[:, None, None]
    return fast


def _root_mean_square(values: ArrayLike, count: ArrayLike) -> float:
    """Of values, each of which counts so often; 0 of none."""
    total = np.sum(count)
    return math.sqrt(float(np.dot(np.square(values), count) / total)) if total > 0 else 0.0


class _ForceNoise(NamedTuple):
    """Standard deviation of an element's normal force and of one tangential component, N."""

    normal: float
    tangential: float


def _force_noise(log: GraspLog, forces: ElementForces, options: SampleOptions) -> _ForceNoise:
    if not np.isnan(options.force_noise):
        return _ForceNoise(options.force_noise, options.force_noise)
    from slipcore.noise import estimate_noise  # compiled, as above

    assert log.force is not None
    plane = log.force[..., :2].reshape(len(log), -1, 2).swapaxes(1, 2)
    normal = estimate_noise(log.time, forces.pressing.reshape(len(log), 1, -1))
    return _ForceNoise(float(np.nan_to_num(normal)), float(np.nan_to_num(estimate_noise(log.time, plane))))


def _ratio(tangential: FloatArray, normal: FloatArray, noise: _ForceNoise) -> FloatArray:
    """f_t/f_n without what noise adds on average: σ²/(2 f_t) to a magnitude (3 % at f_t = 4 σ), (σ/f_n)² to 1/f_n."""
    friction: FloatArray = np.sqrt(np.maximum(tangential**2 - noise.tangential**2, 0.0)) / normal
    return friction * (1.0 - (noise.normal / normal) ** 2)


def _pressed_enough(steady: FloatArray, pressing: FloatArray, noise: float, options: SampleOptions) -> BoolArray:
    """By the ``steady`` normal force; that of the frame itself need only not be lost in noise."""
    peak = pressing.max(axis=(1, 2))
    least = np.maximum(options.force_to_noise * noise, options.least_force_share * peak)
    enough: BoolArray = (steady > np.maximum(least, 0.0)[:, None, None]) & (pressing > 0.5 * steady)
    return enough
