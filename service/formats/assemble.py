"""From what a mapping points at to a grasp log: units, lattice, checks."""

import json
import math
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from service.formats import height_maps, rest
from service.formats.lattice import element_area, flat_lattice
from service.formats.mapping import COMPONENTS, PRESSURE_ALONE, FieldMapping, Origin
from service.formats.members import DTYPES, FLAG, FLOAT, ONCE, REQUIRED, TEXT, Members, grasp_log, stated_metadata
from service.formats.npy import MAX_ARRAY_BYTES
from slipcore.errors import InvalidInput
from slipcore.frames import (
    ALONG_NORMAL,
    BY_MOTION,
    NONE,
    BoolArray,
    FloatArray,
    GraspLog,
    check_element_area,
    check_mask,
    check_position,
)

MAX_CONTENT_BYTES = MAX_ARRAY_BYTES // 2
"""Bytes of all that is read of one file: they are held twice while the log is made of them."""

VECTORS = ("displacement", "position", "force", "normal")
FLAT = ("position", "displacement")
"""Vectors of which x and y may stand alone: what moves along the normal is then not known."""

MASKS = tuple(name for name, dtypes in DTYPES.items() if dtypes == FLAG)


class Recording(Protocol):
    """A file of named fields."""

    def column(self, name: str, topic: str | None, field: str, once: bool) -> NDArray[Any] | None:
        """A field as an array, one entry a frame or ``once`` for the log; None where it isn't there."""

    def grid(self) -> tuple[int, int] | None:
        """Markers along the two axes of the lattice, where the file gives it beside the arrays' shapes."""

    def contents(self) -> str:
        """What is there, for an error's message."""


def assemble(recording: Recording, mapping: FieldMapping) -> GraspLog:
    """The log that ``mapping`` finds in a recording; raises ``InvalidInput`` naming the member that is wrong."""
    members: dict[str, NDArray[Any]] = {}
    metadata: dict[str, str] = {"mapping": mapping.text} if mapping.text else {}
    for name, origin in mapping.origins.items():
        if name == "position" and mapping.is_of_places:
            continue
        array = _read(recording, name, origin)
        if array is None and origin.explicit:
            raise InvalidInput(name, f"not there ({origin})", recording.contents())
        if array is not None:
            members[name] = _in_si(name, array, origin, metadata)
    return _log(members, mapping, metadata, recording)


def _log(
    members: dict[str, NDArray[Any]], mapping: FieldMapping, metadata: dict[str, str], recording: Recording
) -> GraspLog:
    grid = mapping.grid or recording.grid()
    if "force" in members:
        _check_no_pressure(members["force"], mapping, grid)
    if "force" in members and "displacement" not in members:
        if "height" in members:
            raise InvalidInput("height", "beside force alone", "displacement of markers beside both, or either alone")
        members["displacement"] = np.zeros(members["force"].shape)
        metadata["displacement"] = NONE
    flat = len(mapping.origins["displacement"].fields) == 2
    for name in (*VECTORS, *MASKS):
        if name in members:
            members[name] = _on_grid(name, members[name], grid)
    for name in members.keys() & FLAT:
        if members[name].shape[-1:] == (2,):
            members[name] = np.concatenate([members[name], np.zeros((*members[name].shape[:-1], 1))], axis=-1)
            flat |= name == "displacement"
    if mapping.rest == rest.ALL_FRAMES and members.get("time", np.empty(0)).shape == (1,):
        members |= _held(members)
    if "displacement" in members and "observed" in members:
        members["displacement"] = _with_placeholders(members["displacement"], members["observed"])
    has_height = "height" in members
    if has_height:
        _from_heights(members, mapping, grid, metadata)
    for name in ("displacement", "time"):
        _require(name, members, recording)
    if "position" not in members and mapping.pitch is not None:
        members["position"] = flat_lattice(members["displacement"].shape[1:3], mapping.pitch)
        metadata["position"] = f"a flat lattice of pitch {mapping.pitch:g} m"
    if not has_height and (mapping.rest is not None or mapping.is_of_places):
        _from_rest(members, mapping, metadata)
    _require("position", members, recording)
    unseen = flat and not has_height and not {"force", "contact"} & members.keys()
    if unseen:
        metadata["contact"] = BY_MOTION
    if "element_area" not in members:
        members["element_area"] = np.array(element_area("position", members["position"]))
        metadata["element_area"] = "mean of the cells between the markers"
    if metadata:
        members["metadata"] = _with(members, metadata)
    log = grasp_log(members)
    if not unseen:
        return log
    from slipcore.markers import contact_by_motion  # loads scipy.spatial, which few files need

    return replace(log, contact=contact_by_motion(log.time, log.displacement))


def _held(members: Members) -> dict[str, NDArray[Any]]:
    """What one frame tells, for two, which a log has at least: of the sensor alone one is enough."""
    of_frames = {name: each for name, each in members.items() if name not in ONCE and each.shape[:1] == (1,)}
    return {name: np.repeat(each, 2, axis=0) for name, each in of_frames.items()} | {"time": np.array([0.0, 1.0])}


def _with_placeholders(moved: NDArray[Any], observed: NDArray[Any]) -> NDArray[Any]:
    """Displacement or place [t, n, m, c], 0 in place of NaN where no marker is ``observed`` [t, n, m]."""
    unknown = np.isnan(moved) & ~check_mask("observed", observed, moved.shape[:-1])[..., None]
    return np.where(unknown, 0.0, moved) if unknown.any() else moved


def _from_heights(
    members: dict[str, NDArray[Any]], mapping: FieldMapping, grid: tuple[int, int] | None, metadata: dict[str, str]
) -> None:
    """Displacement along z by maps of height, after that of markers from rest in the same frame.

    Elements are where the markers are, or divide the map. Without markers nothing is known along the surface.
    """
    height = height_maps.maps_of(members.pop("height"), mapping.pixels)
    pixels = (height.shape[1], height.shape[2])
    if mapping.pixel is None or mapping.pitch is not None:
        raise InvalidInput("height", "with a pitch" if mapping.pitch else "without pixel", "pixel in the mapping, in m")
    if isinstance(mapping.rest, rest.SensorAlone) or mapping.rest == rest.ALL_FRAMES:
        raise InvalidInput("rest", "a file", "a frame: of maps of height no file of the sensor alone is read")
    frame = height_maps.frame_at_rest(mapping.rest, height, members)
    if "displacement" in members and (mapping.rest is not None or mapping.is_of_places):
        _from_rest(members, mapping.at_rest(str(frame)), metadata)
    elements = _elements_of(members, mapping.pixel, grid, pixels)
    risen, seen = height_maps.rise(height, frame, elements, mapping.pixel)
    if not seen.any():
        raise InvalidInput(
            "height", f"of {pixels[0]} × {pixels[1]} pixels, none of an element", "maps over the elements"
        )
    shape = (len(height), *elements.position.shape[:2])
    if "displacement" not in members:
        members["displacement"], metadata["displacement"] = np.zeros((*shape, 3)), ALONG_NORMAL
    moved = np.array(members["displacement"], dtype=np.float64)
    if moved.shape != (*shape, 3) or np.nan_to_num(moved[..., 2]).any():
        raise InvalidInput("displacement", f"of shape {list(moved.shape)}", f"{[*shape, 3]} beside height, with no z")
    moved[..., 2] = risen.reshape(shape)
    members["displacement"] = moved
    observed = members.get("observed", np.ones(shape, dtype=bool))
    members["observed"] = check_mask("observed", observed, shape) & seen.reshape(shape)
    members.setdefault("position", elements.position)
    members.setdefault("element_area", np.array(elements.area))
    metadata["rest"] = f"frame {frame}"


def _elements_of(
    members: Members, pixel: float, grid: tuple[int, int] | None, pixels: tuple[int, int]
) -> height_maps.Elements:
    """Squares about the markers at rest, or all of a map of so many pixels, a ``pixel`` m wide."""
    if "position" in members:
        position = check_position(members["position"])
        stated = members.get("element_area")
        area = element_area("position", position) if stated is None else check_element_area(stated)
        return height_maps.Elements(position, (math.sqrt(area),) * 2)
    if grid is None:
        raise InvalidInput("grid", "not there", "the number of elements into which height is divided")
    if grid[0] > pixels[0] or grid[1] > pixels[1]:
        raise InvalidInput("grid", str(list(grid)), f"at most {list(pixels)}, the pixels of a map of height")
    return height_maps.Elements.dividing(pixels, pixel, grid)


def _from_rest(members: dict[str, NDArray[Any]], mapping: FieldMapping, metadata: dict[str, str]) -> None:
    """Displacement from rest, which is the first frame's where none is named of markers' places.

    Of an element that is not observed at rest no displacement is known in any frame: it counts as observed in none.
    """
    moved = np.asarray(members["displacement"], dtype=np.float64)
    if moved.ndim < 2 or not moved.size:
        raise InvalidInput("displacement", f"of shape {moved.shape}", "frames, elements and components, one at least")
    if mapping.rest == rest.ALL_FRAMES and not mapping.is_of_places:
        return
    seen = _observed(members, moved, mapping.is_of_places)
    zero, known, metadata["rest"] = _at_rest(members, mapping, moved, seen)
    if mapping.is_of_places:
        members["position"] = zero
    members["displacement"] = np.where(known[..., None], moved - zero, 0.0)
    if not known.all():
        members["observed"] = seen & known


def _observed(members: Members, moved: FloatArray, places: bool) -> BoolArray:
    """Which elements ``moved`` [t, n, m, c] are seen [t, n, m]; one that never is has no place."""
    observed = members.get("observed")
    seen = np.ones(moved.shape[:-1], bool) if observed is None else check_mask("observed", observed, moved.shape[:-1])
    if places and not seen.any(axis=0).all():
        element = np.argwhere(~seen.any(axis=0))[0].tolist()
        raise InvalidInput("position", f"of element {element} observed in no frame", "a place of each element")
    return seen


def _at_rest(
    members: Members, mapping: FieldMapping, moved: FloatArray, seen: BoolArray
) -> tuple[FloatArray, BoolArray, str]:
    """What of elements ``moved`` [t, n, m, c] counts as 0 [n, m, c], of which of them that is known, and its source."""
    places = mapping.is_of_places
    if isinstance(mapping.rest, rest.SensorAlone):
        return *mapping.rest.zero(moved.shape[1:], places), mapping.rest.name
    if mapping.rest == rest.ALL_FRAMES:
        return *rest.unmoved(moved, seen), rest.ALL_FRAMES
    frame = _frame_at_rest(members, mapping.rest, moved, None if places else members.get("position"), seen)
    known = seen[frame]
    if not known.any():
        raise InvalidInput("rest", f"frame {frame}, with no element observed", "a frame in which some are observed")
    otherwise = rest.unmoved(moved, seen)[0] if places else 0.0
    return np.where(known[..., None], moved[frame], otherwise), known, f"frame {frame}"


def _frame_at_rest(
    members: Members, chosen: str | None, moved: FloatArray, position: NDArray[Any] | None, seen: BoolArray
) -> int:
    """The frame that is at rest, of elements ``moved`` [t, n, m, c] from a ``position`` [n, m, c] if known."""
    at = moved if position is None or position.shape != moved.shape[1:] else position + moved
    shown = np.where(seen[..., None], at, np.nan).reshape(len(moved), -1, moved.shape[-1])
    load = rest.load_of(members)
    if load is not None and load.shape == moved.shape[:1]:
        load = np.where(seen.reshape(len(seen), -1).any(axis=1), load, np.inf)
    return rest.frame_of(chosen or rest.FIRST, len(moved), load, shown)


def _require(name: str, members: Members, recording: Recording) -> None:
    if name not in members:
        allowed = f"{', '.join(REQUIRED)} by a mapping or by name; the file has {recording.contents()}"
        raise InvalidInput(name, "not there", allowed)


def _read(recording: Recording, name: str, origin: Origin) -> NDArray[Any] | None:
    """A member as it is in the file; components stacked on its last axis."""
    if origin.value is not None:
        return as_array(name, origin.value)
    parts = []
    for field in origin.fields:
        part = recording.column(name, origin.topic, field, name in ONCE)
        if part is None:
            return None
        parts.append(part)
    if len(parts) == 1:
        return parts[0]
    if len({part.shape for part in parts}) > 1:
        shapes = ", ".join(str(list(part.shape)) for part in parts)
        raise InvalidInput(name, f"of components of shapes {shapes}"[:200], "components of one shape")
    if name in FLAT and len(parts) == 2:
        parts.append(np.zeros_like(parts[0]))
    return np.stack(parts, axis=-1)


def as_array(name: str, value: Any) -> NDArray[Any]:
    """Numbers, truth values or text, nested as they may be; null is NaN among numbers. Raises ``InvalidInput``."""
    try:
        if isinstance(value, dict):
            return np.array(json.dumps(value))
        array = np.asarray(value)
        if array.dtype == object:
            array = np.asarray(value, dtype=np.float64)
        if array.dtype.kind in "iuf" and _has_truth_values(value):
            raise ValueError("of numbers and truth values")  # which numpy takes for 0 and 1
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise InvalidInput(name, f"not an array ({str(error)[:80]})", "an array of real numbers") from error
    return array


def _has_truth_values(value: Any) -> bool:
    """Whether ``true`` or ``false`` is anywhere in nested lists."""
    if not isinstance(value, list):
        return isinstance(value, bool)
    kinds = set(map(type, value))
    return bool in kinds or (list in kinds and any(map(_has_truth_values, value)))


def _in_si(name: str, array: NDArray[Any], origin: Origin, metadata: dict[str, str]) -> NDArray[Any]:
    if name == "time":
        return _seconds(array, origin, metadata)
    dtypes = DTYPES.get(name, FLOAT)
    if dtypes == TEXT:
        if array.dtype.kind != "U":
            raise InvalidInput(name, f"of dtype {array.dtype}", "text")
        return array
    if dtypes == FLAG:
        return _truth_values(name, array)
    if array.dtype.kind not in "iuf":
        raise InvalidInput(name, f"of dtype {array.dtype}", "an array of real numbers")
    if origin.factors is None:
        return array
    return np.asarray(array * _factors(name, array, origin.factors))


def _factors(name: str, array: NDArray[Any], factors: tuple[float, ...]) -> NDArray[np.float64]:
    """One factor, or those of the components on the last axis, which may have the elements' one behind the other."""
    if len(factors) == 1 or not array.ndim:
        return np.array(factors[0])
    flat = name in VECTORS and array.ndim == (1 if name in ONCE else 2)
    elements, rest = divmod(array.shape[-1], len(factors))
    if rest or (elements != 1 and not flat):
        raise InvalidInput(name, f"of shape {list(array.shape)}", f"shape [any, {len(factors)}]")
    return np.tile(factors, elements)


def _seconds(time: NDArray[Any], origin: Origin, metadata: dict[str, str]) -> NDArray[np.float64]:
    """Seconds; whole numbers (nanoseconds since 1970, as a rule) count from the first, lest they lose digits."""
    factor = origin.factors[0] if origin.factors else 1.0
    if time.dtype.kind == "M":
        time, factor = time.astype("datetime64[ns]").astype(np.int64), 1e-9
    if time.ndim != 1 or time.size == 0 or time.dtype.kind not in "iuf":
        raise InvalidInput("time", f"{time.dtype} of shape {list(time.shape)}", "one number a frame")
    if time.dtype.kind == "f":
        return np.asarray(time * factor, dtype=np.float64)
    if factor < 1.0 and time[0]:
        metadata["start_time"] = f"{int(time[0])} / {1.0 / factor:.0f} s"
        time = time.astype(np.int64) - np.int64(time[0])
    return np.asarray(time / (1.0 / factor), dtype=np.float64)


def _truth_values(name: str, array: NDArray[Any]) -> NDArray[np.bool_]:
    if array.dtype != np.bool_ and (array.dtype.kind not in "iu" or ((array != 0) & (array != 1)).any()):
        raise InvalidInput(name, f"of dtype {array.dtype}", "truth values, or whole numbers 0 and 1")
    return array.astype(np.bool_)


def _on_grid(name: str, array: NDArray[Any], grid: tuple[int, int] | None) -> NDArray[Any]:
    """A field on its lattice: [t, n, m, 3] (masks [t, n, m], position [n, m, 3]) from any flatter shape; of ``FLAT``
    with two components where it has no more.
    """
    ndim = (0 if name in ONCE else 1) + 2 + (1 if name in VECTORS else 0)
    if array.ndim >= ndim:
        return array
    if grid is None:
        raise InvalidInput(name, f"of shape {list(array.shape)}", f"{ndim} axes, or a {_likely_grid(name, array)}")
    lead = () if name in ONCE else array.shape[:1]
    shape = (*lead, *grid, *((3,) if name in VECTORS else ()))
    if name in FLAT and array.size == np.prod((*lead, *grid, 2), dtype=object):
        shape = (*lead, *grid, 2)
    if array.size != np.prod(shape, dtype=object):
        raise InvalidInput(name, f"of shape {list(array.shape)}", f"{list(shape)} or as many numbers")
    return array.reshape(shape)


def _check_no_pressure(force: NDArray[Any], mapping: FieldMapping, grid: tuple[int, int] | None) -> None:
    """Raises ``InvalidInput`` for forces of one component."""
    single = len(mapping.origins["force"].fields) == 1
    elements = force.size // max(1, len(force)) if force.ndim else 0
    if single and (elements == math.prod(grid) if grid else elements % len(COMPONENTS["force"])):
        raise InvalidInput("force", f"one component an element (shape {list(force.shape)})", PRESSURE_ALONE)


def _likely_grid(name: str, array: NDArray[Any]) -> str:
    """What a mapping would say of the lattice, by the number of elements where that is a square."""
    lead = array.shape[: 0 if name in ONCE else 1]
    elements = array.size // max(1, math.prod(lead)) // (3 if name in VECTORS else 1)
    side = math.isqrt(elements)
    if side**2 != elements:
        return f"`grid` of {elements} elements in the mapping, such as [20, 20]"
    return f'`grid` in the mapping, such as "grid": [{side}, {side}]'


def _with(members: Members, metadata: dict[str, str]) -> NDArray[Any]:
    """The file's metadata with what the reader has to say."""
    return np.array(json.dumps({**stated_metadata(members), **metadata}))
