"""Checks of the contact as a whole: what it feels without load, and whether its markers go with it."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from slipcore.checks.rest import frames_at_rest, passing_noise
from slipcore.checks.subject import Subject
from slipcore.finding import Finding
from slipcore.frames import FloatArray


def load_free_tangential_force(seen: Subject) -> Iterator[Finding]:
    """Crosstalk, or wrong normals: elements feel what the whole contact does not."""
    if seen.forces is None or not seen.held.any():
        return
    held = seen.held
    free = _load_ratio(seen) < seen.limits.no_load
    if not free.any():
        return
    ratio, by_noise = _sideways_shares(seen, np.flatnonzero(held)[free])
    if ratio > seen.limits.sideways_share > by_noise:
        evidence = f"elements feel {ratio:.2f} of the normal force sideways while the whole contact feels none"
        remedy = "calibrate normals and crosstalk by a pure press; single elements' f_t/f_n are not friction here"
        yield Finding("sideways force without load", evidence, remedy)


def _sideways_shares(seen: Subject, frames: NDArray[np.intp]) -> tuple[float, float]:
    """What elements feel sideways in these frames, over their normal force: less noise, and of noise alone."""
    assert seen.forces is not None
    pressed = seen.forces.compressive[frames]
    sideways, count = seen.forces.tangential[frames] * pressed, pressed.sum(axis=(1, 2))
    noise = _tangential_noise(seen)
    share_of_noise = noise**2 * count.sum() / max(float((sideways**2).sum()), np.finfo(float).tiny)
    tangential, by_noise = (
        sideways.sum(axis=(1, 2)),
        np.sqrt(0.25 * np.pi) * noise * count,
    )  # its mean size in the plane
    ratio, ratio_by_noise = (float(np.median(each / seen.total[frames])) for each in (tangential, by_noise))
    return ratio * float(np.sqrt(max(1.0 - share_of_noise, 0.0))), ratio_by_noise


def _tangential_noise(seen: Subject) -> float:
    """Root mean square of what an element reads sideways without contact, N; of passing noise where no rest is seen."""
    assert seen.forces is not None
    assert seen.log.force is not None
    rest = frames_at_rest(seen) & ~seen.history.contact.any(axis=(1, 2))
    if rest.any():
        return float(np.sqrt(np.mean(seen.forces.tangential[rest] ** 2)))
    series = seen.log.force.reshape(len(seen.log), -1, 3).transpose(0, 2, 1)
    return float(np.sqrt(2.0)) * passing_noise(seen, series)


def _load_ratio(seen: Subject) -> FloatArray:
    """|ΣF_t|/F_n and |M_z|/Σ(r f_n) together, of the frames that are held: 0 without load, about μ where all slips.

    Of a contact of one element, which carries no moment by tangential forces, the force alone.
    """
    assert seen.log.force is not None
    held, pressing, total = seen.held, seen.pressing[seen.held], seen.total[seen.held]
    centre = np.einsum("tnm,nmi->ti", pressing / total[:, None, None], seen.log.position[..., :2])
    arm = seen.log.position[None, ..., :2] - centre[:, None, None]
    along = seen.log.force[held][..., :2]
    moment = (arm[..., 0] * along[..., 1] - arm[..., 1] * along[..., 0]).sum(axis=(1, 2))
    limit = (np.hypot(arm[..., 0], arm[..., 1]) * pressing).sum(axis=(1, 2))
    turning = np.divide(moment, limit, out=np.zeros_like(moment), where=(pressing > 0.0).sum(axis=(1, 2)) > 1)
    force = np.hypot(*along.sum(axis=(1, 2)).T)
    return np.asarray(np.hypot(force / total, turning))


def moving_contact(seen: Subject) -> Iterator[Finding]:
    """An object that rolls or rocks takes its contact along and leaves the markers."""
    if not seen.held.any():
        return
    weight = seen.pressing[seen.held] / seen.total[seen.held][:, None, None]
    centre = np.einsum("tnm,nmi->ti", weight, seen.log.position[..., :2])
    below = np.einsum("tnm,tnmi->ti", weight, seen.log.displacement[seen.held][..., :2])
    travel, moved = float(np.ptp(centre, axis=0).max()), float(np.ptp(below, axis=0).max())
    if travel > moved + seen.limits.travel * np.sqrt(seen.log.element_area):
        evidence = f"the contact travels {1e3 * travel:.2g} mm while the markers under it move {1e3 * moved:.2g} mm"
        remedy = "hold the object so that it slides; one that rolls or rocks shows no friction"
        yield Finding("contact travels", evidence, remedy)
