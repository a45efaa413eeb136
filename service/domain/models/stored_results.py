"""Results of the numerics in the form in which they are stored, and back."""

import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import estimators
import slipcore
import stiction_client
from db.blobs import disk_errors_named
from db.records import ContactFriction, Detection, Finding, NewModel, SampleSummary, Scale, Scales, StoredModel
from service.formats.npy import HEADER_LOCK
from slipcore.frames import BoolArray, FloatArray
from slipcore.patch_record import REGIMES, Patch, bounds_of, frames_of, joined
from slipcore.samples import FrictionSamples
from slipcore.slip_state import EventList, SlipEvents, SlipHistory

if TYPE_CHECKING:
    from estimators import FrictionModel

EVENT_KINDS = ("onset", "end", "touch", "release")
MAPS = 3
"""Arrays that the maps of contact and slip are stored as."""
SAMPLE_ARRAYS = FrictionSamples.arrays()
"""Of these the last but one, the kind, is stored as whether it is "contact"; older versions stored none. Whether
velocities are relative is the same for all elements of a log, and one number."""


@dataclass(frozen=True, slots=True, eq=False)
class StoredPatches:
    """What is kept of contact patches, end to end: of which ``frame`` each entry [k] is and which ``patch``, the
    ``pose`` [k, 3] as ``slipcore.Patch`` has it, and the ``regime`` as its place in ``REGIMES``.
    """

    frame: NDArray[np.int64]
    patch: NDArray[np.int64]
    pose: FloatArray
    regime: NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class StoredHistory:
    """What is kept of a slip history: ``time`` [t] s, ``stick_ratio`` [t] (NaN without contact), the events, and which
    elements were in ``contact`` and in ``slip`` [t, n, m]; older versions kept no such maps (None), and no ``patches``.
    """

    time: FloatArray
    stick_ratio: FloatArray
    events: SlipEvents
    contact: BoolArray | None
    slip: BoolArray | None
    patches: StoredPatches | None = None


def encode_history(history: SlipHistory) -> bytes:
    """A history as bytes, the same for the same history."""
    events = [getattr(history.events, kind) for kind in EVENT_KINDS]
    parts = [part for each in events for part in (each.element, each.time)]
    maps = [np.array(history.contact.shape), np.packbits(history.contact), np.packbits(history.slip)]
    return _pack([history.time, history.stick_ratio, *parts, *maps, *_patch_arrays(history.patches)])


def decode_history(path: Path, *, with_maps: bool = True) -> StoredHistory:
    """The history in a blob; ``with_maps`` of contact and slip, which take 16 times their bytes in the blob."""
    time, stick_ratio, *parts = _unpack(path, None if with_maps else 2 + 2 * len(EVENT_KINDS))
    lists, maps = parts[: 2 * len(EVENT_KINDS)], parts[2 * len(EVENT_KINDS) :]
    events = SlipEvents(*(EventList(*pair) for pair in zip(lists[0::2], lists[1::2], strict=True)))
    if not maps:
        return StoredHistory(time, stick_ratio, events, None, None)
    shape = tuple(maps[0].tolist())
    contact, slip = (np.unpackbits(bits, count=math.prod(shape)).reshape(shape).astype(bool) for bits in maps[1:MAPS])
    patches = StoredPatches(*maps[MAPS:]) if len(maps) > MAPS else None
    return StoredHistory(time, stick_ratio, events, contact, slip, patches)


def _patch_arrays(patches: Sequence[Patch]) -> list[NDArray[Any]]:
    """The arrays of ``StoredPatches``."""
    if not patches:
        return [np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 3)), np.empty(0, np.uint8)]
    number = np.repeat(np.arange(len(patches)), np.diff(bounds_of(patches)))
    regime = joined(patches, "regime")
    codes = np.zeros(len(regime), np.uint8)
    for code, name in enumerate(REGIMES):
        codes[regime == name] = code
    return [frames_of(patches), number, joined(patches, "pose"), codes]


def encode_samples(samples: FrictionSamples) -> bytes:
    """Samples as bytes, the same for the same samples."""
    is_relative = float(samples.velocity_is_relative.any())
    common = np.array([samples.element_area, samples.normal_force_noise, is_relative, samples.velocity_noise])
    numbers = [getattr(samples, name) for name in SAMPLE_ARRAYS[:-2]]
    return _pack([*numbers, samples.kind == "contact", common])


def decode_samples(path: Path) -> FrictionSamples:
    """The samples in a blob; those stored by older versions have no noise of f_n and of v, and are all of elements
    whose velocities count as the object's own: nobody noted whether its motion was known. Of which sensor they are, the
    log's record says.
    """
    *arrays, common = _unpack(path)
    of_contact = arrays.pop() if len(arrays) == len(SAMPLE_ARRAYS) - 1 else np.zeros(len(arrays[0]), bool)
    element_area, noise, is_relative, velocity_noise = (*np.atleast_1d(common).tolist(), 0.0, 0.0, 0.0)[:4]
    derived = [np.where(of_contact, "contact", "element"), ~of_contact & bool(is_relative)]
    columns: dict[str, Any] = dict(zip(SAMPLE_ARRAYS, [*arrays, *derived], strict=True))
    return FrictionSamples(
        **columns,
        element_area=element_area,
        normal_force_noise=noise,
        velocity_noise=velocity_noise,
    )


def summarise_history(
    history: SlipHistory,
    seconds: float,
    blob: str,
    findings: Sequence[slipcore.Finding] = (),
    contact: slipcore.ContactFriction | None = None,
    *,
    is_scaled: bool = True,
) -> Detection:
    """A history in numbers, with the ``findings`` against its log and the friction of its ``contact``.

    A length only where it is in metres (``is_scaled``).
    """
    in_contact = ~np.isnan(history.stick_ratio)
    events = history.events
    return Detection(
        method=history.method,
        noise=finite_or_none(history.noise) if is_scaled else None,
        stick_ratio_min=float(history.stick_ratio[in_contact].min()) if in_contact.any() else None,
        contact_frames=int(in_contact.sum()),
        macro_slip_frames=int(history.macro_slip.sum()),
        onsets=len(events.onset),
        ends=len(events.end),
        touches=len(events.touch),
        releases=len(events.release),
        seconds=seconds,
        history_blob=blob,
        findings=stored_findings(findings),
        contact_friction=None if contact is None else _stored_contact(contact),
    )


def stored_findings(findings: Iterable[slipcore.Finding]) -> tuple[Finding, ...]:
    """What is kept of findings."""
    return tuple(Finding(each.name, each.evidence, each.remedy) for each in findings)


def _stored_contact(contact: slipcore.ContactFriction) -> ContactFriction:
    known = contact.coefficient, contact.low, finite_or_none(contact.high)
    return ContactFriction(*known, contact.is_bound, contact.reason)


def summarise_samples(samples: FrictionSamples, none_because: str | None, blob: str) -> SampleSummary:
    """Samples in numbers."""
    return SampleSummary(
        count=len(samples),
        none_because=none_because,
        element_area=samples.element_area,
        friction_coefficient_mean=float(samples.friction_coefficient.mean()) if len(samples) else None,
        tangential_velocity=_range(samples.tangential_velocity),
        normal_force=_range(samples.normal_force),
        samples_blob=blob,
        moments=estimators.Moments.from_samples(samples).to_bytes() if len(samples) else None,
        velocity_is_relative=bool(samples.velocity_is_relative.any()) if len(samples) else None,
    )


def to_new_model(model: "FrictionModel") -> NewModel:
    """A fitted model as it is stored."""
    return NewModel(
        method=model.method,
        coefficients=tuple(model.coefficients.tolist()),
        covariance=tuple(tuple(line) for line in model.covariance.tolist()),
        scale=float(model.scale),
        n=int(model.n),
        degrees_of_freedom=finite_or_none(model.degrees_of_freedom),
        scatter_degrees_of_freedom=finite_or_none(model.scatter_degrees_of_freedom),
        tangential_velocity=model.domain.tangential_velocity,
        normal_force=model.domain.normal_force,
        identifiable=tuple(model.identifiable.tolist()),
        element_area=float(model.element_area),
        diagnostics={name: _plain(value) for name, value in model.diagnostics.items()},
        cost_seconds=float(model.cost.seconds),
        monte_carlo_error=float(model.cost.monte_carlo_error),
        scales=None if model.scales is None else _stored_scales(model.scales),
    )


def to_friction_model(stored: NewModel) -> "FrictionModel":
    """A stored model as one that predicts; its draws are not kept, nor scales by versions that stored none."""
    return estimators.FrictionModel(
        method=stored.method,
        coefficients=np.array(stored.coefficients),
        covariance=np.array(stored.covariance),
        scale=stored.scale,
        n=stored.n,
        degrees_of_freedom=_or_infinite(stored.degrees_of_freedom),
        scatter_degrees_of_freedom=_or_infinite(stored.scatter_degrees_of_freedom),
        domain=estimators.Domain(stored.tangential_velocity, stored.normal_force),
        identifiable=np.array(stored.identifiable),
        element_area=stored.element_area,
        cost=estimators.Cost(stored.cost_seconds, stored.monte_carlo_error),
        diagnostics={name: _or_nan(value) for name, value in stored.diagnostics.items()},
        scales=None if stored.scales is None else _scales(stored.scales),
    )


def to_client_model(stored: StoredModel) -> "stiction_client.FrictionModel":
    """A stored model as planners have it, who get it as the service's answer: the numbers of the fit, and whose it is.

    What the diagnostics could not say in JSON stays None.
    """
    model = to_friction_model(stored.model)
    return replace(
        stiction_client.FrictionModel.of(model, stored.material, stored.version),
        current=stored.current,
        outdated=stored.outdated,
        created_at=stored.created_at.isoformat(),
    )


def _stored_scales(scales: "estimators.Scales") -> Scales:
    each = (scales.between_grasps, scales.between_places, scales.within)
    grasps, places, within = (Scale(float(scale.value), finite_or_none(scale.degrees_of_freedom)) for scale in each)
    sensors = scales.between_sensors
    return Scales(grasps, places, within, None if sensors is None else sensors.to_json())


def _scales(stored: Scales) -> "estimators.Scales":
    each = (stored.between_grasps, stored.between_places, stored.within)
    plain = (estimators.Scale(scale.value, _or_infinite(scale.degrees_of_freedom)) for scale in each)
    grasps, places, within = plain
    sensors = stored.between_sensors
    between_sensors = None if sensors is None else estimators.SensorScale.from_json(sensors)
    return estimators.Scales(grasps, places, within, between_sensors)


def _or_infinite(degrees_of_freedom: float | None) -> float:
    return math.inf if degrees_of_freedom is None else degrees_of_freedom


def finite_or_none(value: float) -> float | None:
    """The value, or None where JSON and SQL have no word for it."""
    return float(value) if math.isfinite(value) else None


def _plain(value: float | str) -> float | str | None:
    return value if isinstance(value, str) else finite_or_none(value)


def _or_nan(value: float | str | None) -> float | str:
    return math.nan if value is None else value


def _range(values: FloatArray) -> tuple[float, float] | None:
    return (float(values.min()), float(values.max())) if len(values) else None


def _pack(arrays: Sequence[NDArray[Any]]) -> bytes:
    """Arrays one after the other in the .npy format; unlike a zip, it holds no moment of writing."""
    buffer = io.BytesIO()
    for array in arrays:
        np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def _unpack(path: Path, most: int | None = None) -> list[NDArray[Any]]:
    """All arrays of a blob, or the first ones."""
    arrays: list[NDArray[Any]] = []
    with disk_errors_named(), path.open("rb") as stream, HEADER_LOCK:
        while stream.peek(1) and len(arrays) != most:
            arrays.append(np.load(stream, allow_pickle=False))
    return arrays
