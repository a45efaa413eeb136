"""A press of a body straight down: which frames are free of contact, which are pressed, and whether it is pure."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from slipcore.arguments import number, of_kind, shown
from slipcore.calibration.defaults import PRESS
from slipcore.calibration.zero import Zero, elapsed, find_zero
from slipcore.defaults import DEVIATION_TO_SIGMA, LIMITS
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.surface.log_normals import normals_of


class InvalidPress(InvalidInput):
    """Logs that are no pure presses; ``evidence`` says by the log's number what was seen."""

    def __init__(self, evidence: dict[int, str]) -> None:
        self.evidence = evidence
        listed = "; ".join(f"log {number + 1}: {seen}" for number, seen in evidence.items())
        super().__init__("logs", listed, "a body pressed straight down and lifted, without load sideways")

    def __str__(self) -> str:
        return f"no pure press is {self.value}; allowed: {self.allowed}"

    def __reduce__(self) -> tuple[type["InvalidPress"], tuple[dict[int, str]]]:
        return type(self), (self.evidence,)


def check_kinds(logs: Sequence[GraspLog]) -> None:
    """Raises ``InvalidInput`` unless ``logs`` is a list of logs, and has one or more."""
    if isinstance(logs, GraspLog) or not isinstance(logs, Sequence):
        raise InvalidInput("logs", shown(logs), "a list of logs")
    if not logs:
        raise InvalidInput("logs", "none", "at least one press")
    for log in logs:
        of_kind("logs", log, GraspLog)


def known_forces(logs: Sequence[GraspLog], known_force: Sequence[float | None] | None) -> list[float | None]:
    """The normal force of each press, N, None where it is not known; ``known_force`` of None: of none.

    Raises ``InvalidInput`` without logs, for a press that is there twice, which would count as two that agree, where
    there are more or fewer forces than logs, and for one out of range.
    """
    check_kinds(logs)
    for at, log in enumerate(logs):
        same = next((k for k in range(at) if _is_same(log, logs[k])), None)
        if same is not None:
            raise InvalidInput("logs", f"number {at + 1}, the same press as number {same + 1}", "each press once")
    if known_force is None:
        return [None] * len(logs)
    given = known_force.tolist() if isinstance(known_force, np.ndarray) else known_force
    if not isinstance(given, list | tuple):
        raise InvalidInput("known_force", shown(known_force), "a list of one force or None for each log, or None")
    known = [None if force is None else _press_force(force) for force in given]
    if len(known) != len(logs):
        raise InvalidInput("known_force", f"{len(known)} forces", f"one for each of {len(logs)} logs, or None")
    return known


def _press_force(force: float) -> float:
    least, most = LIMITS.press
    allowed = f"{least:g} to {most:g} N"
    value = number("known_force", force, allowed)
    if not least <= value <= most:
        raise InvalidInput("known_force", force, allowed)
    return value


def _is_same(log: GraspLog, other: GraspLog) -> bool:
    return all(
        np.array_equal(getattr(log, name), getattr(other, name))  # None is equal to None alone
        for name in ("time", "displacement", "force")
    )


@dataclass(frozen=True, slots=True, eq=False)
class PressLog:
    """A log of a press; ``free``, ``pressed`` [t]: frames without contact, and those with most of the load.

    With forces and free frames: their ``zero``. ``split`` [t, n, m, 3] N: forces without it, first their tangential
    parts along x and y, then the pressing one; None without forces. ``footprint`` [n, m]: elements that the body
    presses. ``normal_force`` [t] and ``tangential_force`` [t, 2] N: sums over the footprint.
    """

    log: GraspLog
    level: FloatArray
    free: BoolArray
    zero: Zero | None = field(init=False)
    split: FloatArray | None = field(init=False)
    footprint: BoolArray = field(init=False)
    normal_force: FloatArray = field(init=False)
    tangential_force: FloatArray = field(init=False)
    pressed: BoolArray = field(init=False)

    def __post_init__(self) -> None:
        zero = find_zero(self.log, self.free)
        split = _split(self.log, zero)
        pressing = -self.log.displacement[..., 2] if split is None else split[..., 2]
        peak = pressing[self.held].mean(axis=0)
        footprint = peak >= PRESS.footprint_share * peak.max()
        normal = self.level if split is None else pressing[:, footprint].sum(axis=1)
        tangential = np.zeros((len(self.log), 2)) if split is None else split[:, footprint, :2].sum(axis=1)
        values = zero, split, footprint, normal, tangential, normal >= PRESS.pressed_share * normal.max()
        names = "zero", "split", "footprint", "normal_force", "tangential_force", "pressed"
        for name, value in zip(names, values, strict=True):
            object.__setattr__(self, name, value)  # the record is frozen; this is its own constructor

    @property
    def held(self) -> BoolArray:
        """Frames in which the body is in furthest, [t]; by the level, so that noise of forces has no part in it."""
        held: BoolArray = self.level >= PRESS.held_share * self.level.max()
        return held

    @property
    def reaches_edge(self) -> bool:
        """Whether the body presses on the outermost elements, and perhaps beyond them."""
        inner = self.footprint[1:-1, 1:-1]
        return int(inner.sum()) < int(self.footprint.sum())

    @property
    def depth(self) -> float:
        """Greatest indentation, m; 0 where the sensor does not see it."""
        return float(np.maximum(-self.log.displacement[..., 2], 0.0).max())


def find_press(log: GraspLog) -> PressLog:
    """The log as a press, pure or not."""
    field = -log.displacement[..., 2]
    if not field.any() and log.force is not None:
        field = log.force[0, ..., 2] - log.force[..., 2]
    level, noise = _level(field.reshape(len(log), -1))
    touched = level > max(PRESS.free_share * level.max(), PRESS.free_noise * noise)
    for _ in range(PRESS.guard):
        before = touched.copy()
        touched[1:] |= before[:-1]
        touched[:-1] |= before[1:]
    return PressLog(log, level, ~touched)


def _level(field: FloatArray) -> tuple[FloatArray, float]:
    """How far the body is in, [t], from a field [t, k], and the standard deviation of its noise."""
    peak = int(np.argmax(field.mean(axis=1)))
    count = max(1, round(PRESS.core_share * field.shape[1]))
    level = field[:, np.argsort(field[peak])[-count:]].mean(axis=1)
    return level, _noise(level)


def _split(log: GraspLog, zero: Zero | None) -> FloatArray | None:
    if log.force is None:
        return None
    force = log.force if zero is None else zero.taken_from(log)
    normal = normals_of(log)
    along = np.vecdot(force, normal)[..., None]
    return np.concatenate([(force - along * normal)[..., :2], -along], axis=-1)


def press_fault(press: PressLog) -> str | None:
    """What makes a press unfit to calibrate by; None where nothing does."""
    return next(_impurities(press), None)


def _impurities(press: PressLog) -> Iterator[str]:
    if press.level.max() <= 0.0 or not press.pressed.any():
        yield "nothing presses"
        return
    if press.split is not None:
        noise = _noise(press.normal_force)
        if press.normal_force.max() <= PRESS.least_force_to_noise * noise:
            yield f"nothing presses: {press.normal_force.max():.3g} N at most, with noise of {noise:.2g} N"
            return
        yield from _load_sideways(press)
    yield from _motion_sideways(press)


def _load_sideways(press: PressLog) -> Iterator[str]:
    """Tangential load that is no share of the normal load."""
    largest, (terms, load) = press.normal_force.max(), load_terms(press)
    residual = np.hypot(*(load - terms @ np.linalg.lstsq(terms, load)[0]).T)
    limit = max(PRESS.load_change * largest, PRESS.stray_noise * _noise(press.tangential_force.T))
    if residual.max() > limit:
        yield f"the load sideways changes by {residual.max():.3g} N beside a normal load of {largest:.3g} N"


def load_terms(press: PressLog) -> tuple[FloatArray, FloatArray]:
    """Normal load in free and pressed frames, beside an offset and a drift where they are known, [k, 1 to 3], and
    tangential load [k, 2] N in them.
    """
    seen, zero = press.free | press.pressed, press.zero
    columns = [press.normal_force]
    if zero is not None:  # else no free frames separate an offset from a share of an even load
        columns.append(np.ones(len(press.log)))
        columns += [elapsed(press.log)] if zero.around else []
    return np.stack(columns, axis=1)[seen], press.tangential_force[seen]


def _motion_sideways(press: PressLog) -> Iterator[str]:
    """Markers that go along the surface, or turn, as they would with a body that is pushed or turned."""
    sideways, turn = marker_motion(press)
    limit = PRESS.sideways * press.depth
    far = float(np.hypot(*sideways.T).max())
    if press.depth > 0.0 and far > limit:
        yield f"markers go {1e6 * far:.3g} µm sideways while they are pressed {1e6 * press.depth:.3g} µm in"
    if press.depth > 0.0 and np.abs(turn).max() > limit:
        yield f"markers turn by {1e6 * np.abs(turn).max():.3g} µm at the rim of the contact"


def marker_motion(press: PressLog) -> tuple[FloatArray, FloatArray]:
    """Mean motion of the footprint's markers along x and y, and its turn times its radius, in pressed frames, m."""
    place = press.log.position[press.footprint][:, :2]
    moved = press.log.displacement[:, press.footprint, :2]
    before = moved[press.free].mean(axis=0) if press.free.any() else 0.0
    moved = (moved - before)[press.pressed]
    arm = place - place.mean(axis=0)
    moment = (arm[:, 0] * moved[..., 1] - arm[:, 1] * moved[..., 0]).sum(axis=1)
    square = float((arm**2).sum())
    radius = np.sqrt(square / len(arm))
    return moved.mean(axis=1), radius * moment / max(square, np.finfo(float).tiny)


def _noise(series: FloatArray) -> float:
    """Standard deviation of white noise in series [..., t], by second differences."""
    second = np.abs(np.diff(series, 2))
    return float(DEVIATION_TO_SIGMA * np.median(second) / np.sqrt(6.0)) if second.size else 0.0
