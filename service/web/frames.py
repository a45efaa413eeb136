"""What the player shows of one log, in one compact file (``service.packed_arrays``).

Its header gives ``rows`` and ``columns`` of the lattice, how many frames of the log one frame shown stands for
(``step``), and what 127 means in ``displacement`` (m) and ``force`` (N). Of contact patches there is, for each in
``patch_frame``, its regime, and in ``patch_place`` its column and row and its direction along them. What is not known,
because the upload was deleted or the log has no forces, is left out.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service import formats
from service.domain.models.stored_results import StoredHistory, StoredPatches, decode_history
from service.formats.lattice import columns_and_rows, lattice_axes
from service.packed_arrays import Arrays, pack_arrays
from slipcore.frames import GraspLog
from slipcore.patch_record import REGIMES
from slipcore.slip_state import element_states

MOST_CELLS = 1_500_000
"""Elements of all frames shown, 5 bytes each; of a log with more only every second, third … frame is shown."""

MOST_EVENTS = 100_000
"""Onsets marked on the time axis, at most."""

FULL_SCALE = 127


def write_frames(history: Path, upload: Path | None, target: Path) -> None:
    """Write the file of a log with this history; ``upload`` is the log itself, None where it was deleted."""
    found = decode_history(history)
    log = None if upload is None else formats.read(upload)
    target.write_bytes(pack(found, log))


def pack(history: StoredHistory, log: GraspLog | None) -> bytes:
    """The content of the file."""
    grid = log.grid if log is not None else history.contact.shape[1:] if history.contact is not None else (0, 0)
    frames = len(history.time)
    step = max(1, -(-frames * grid[0] * grid[1] // MOST_CELLS))
    shown = slice(None, None, step)
    arrays: Arrays = {"time": _single(history.time[shown]), "stick_ratio": _single(history.stick_ratio[shown])}
    arrays["onset"] = _single(history.events.onset.time[:MOST_EVENTS])
    header: dict[str, Any] = {"rows": grid[0], "columns": grid[1], "step": step, "frames": frames}
    if history.contact is not None and history.slip is not None:
        arrays["state"] = element_states(history.contact[shown], history.slip[shown]).ravel()
    if history.patches is not None:
        _add_patches(arrays, header, history.patches, log)
    if log is not None:
        _add_vectors(arrays, header, log, shown)
    return pack_arrays(header, arrays)


def _add_patches(arrays: Arrays, header: dict[str, Any], patches: StoredPatches, log: GraspLog | None) -> None:
    """Of each patch in a frame shown, by time: its regime and, where the lattice is known, its place and direction."""
    rows = np.flatnonzero(patches.frame % header["step"] == 0)
    rows = rows[np.argsort(patches.frame[rows], kind="stable")]
    header["regimes"] = REGIMES
    arrays["patch_frame"], arrays["patch_regime"] = _single(patches.frame[rows] // header["step"]), patches.regime[rows]
    if log is not None:
        x, y, yaw = patches.pose[rows].T
        places = columns_and_rows(log.position, np.stack([x, y], axis=1))
        along = np.stack([np.cos(yaw), np.sin(yaw)], axis=1) @ lattice_axes(log.position)
        arrays["patch_place"] = _single(np.concatenate([places, along], axis=1).ravel())


def _add_vectors(arrays: Arrays, header: dict[str, Any], log: GraspLog, shown: slice) -> None:
    """Displacement and force of each element along columns and rows of the lattice, and the resultants, N."""
    axes = lattice_axes(log.position)
    if log.has_displacement:
        arrays["displacement"], header["displacement"] = _scaled(log.displacement[shown, ..., :2] @ axes)
    if log.force is not None:
        arrays["force"], header["force"] = _scaled(log.force[shown, ..., :2] @ axes)
        total = np.nansum(log.force[shown], axis=(1, 2))
        arrays["normal_force"] = _single(np.abs(total[:, 2]))
        arrays["tangential_force"] = _single(np.hypot(total[:, 0], total[:, 1]))


def _single(values: NDArray[Any]) -> NDArray[np.float32]:
    return np.ascontiguousarray(values, dtype="<f4")


def _scaled(vectors: NDArray[Any]) -> tuple[NDArray[np.int8], float]:
    """Vectors as bytes, and what their full scale is; the unknown are shown as zero."""
    known = np.nan_to_num(vectors)
    largest = float(np.abs(known).max(initial=0.0)) or 1.0
    return np.rint(known * (FULL_SCALE / largest)).astype(np.int8).ravel(), largest
