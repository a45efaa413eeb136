"""Faults of real sensors, put into logs: each by its strength, drawn from a generator, and nothing else changed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter

from slipcore.frames import FloatArray, GraspLog

Fault = Callable[[GraspLog, np.random.Generator], GraspLog]


def moved(log: GraspLog, by: FloatArray) -> GraspLog:
    """With something added to the displacement."""
    return replace(log, displacement=log.displacement + by)


def shake(size: float) -> Fault:
    """All markers move alike, as under a camera that shakes: white, ``size`` m along x and along y."""
    return lambda log, rng: moved(log, size * rng.standard_normal((len(log), 1, 1, 3)) * [1.0, 1.0, 0.0])


def pose_noise(size: float) -> Fault:
    """The given pose is off by white noise of ``size`` m, and the same at 3 mm from its middle."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        if log.object_pose is None:
            return log
        noise = size * rng.standard_normal(log.object_pose.shape) * [1.0, 1.0, 1.0 / 3e-3]
        return replace(log, object_pose=log.object_pose + noise)

    return fault


def correlated(size: float, memory: float = 0.9) -> Fault:
    """Each coordinate errs by an autoregressive process of standard deviation ``size`` m."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        noise = size * rng.standard_normal(log.displacement.shape)
        for k in range(1, len(log)):
            noise[k] = memory * noise[k - 1] + np.sqrt(1.0 - memory**2) * noise[k]
        return moved(log, noise)

    return fault


def rounded(step: float) -> Fault:
    """Displacement is reported in steps, m."""
    return lambda log, _: replace(log, displacement=step * np.round(log.displacement / step))


def smoothed(width: float) -> Fault:
    """Displacement and forces are smoothed by a Gaussian kernel, standard deviation in elements."""

    def fault(log: GraspLog, _: np.random.Generator) -> GraspLog:
        over = (0.0, width, width, 0.0)
        force = None if log.force is None else gaussian_filter(log.force, over, mode="nearest")
        return replace(log, displacement=gaussian_filter(log.displacement, over, mode="nearest"), force=force)

    return fault


def smoothed_then_noisy(width: float, size: float) -> Fault:
    """Smoothed as by ``smoothed``, and white noise of ``size`` m in displacement after that."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        seen = smoothed(width)(log, rng)
        return moved(seen, size * rng.standard_normal(log.displacement.shape))

    return fault


def lagging(share: float, time: float) -> Fault:
    """A share of the markers is reported as it was so many seconds before."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        then = np.maximum(np.searchsorted(log.time, log.time - time, side="right") - 1, 0)
        lag, displacement = rng.random(log.grid) < share, log.displacement.copy()
        displacement[:, lag] = log.displacement[then][:, lag]
        return replace(log, displacement=displacement)

    return fault


def lost(share: float) -> Fault:
    """A share of the markers is lost from the beginning, and said to be."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        seen = rng.random(log.grid) >= share
        return replace(log, observed=np.broadcast_to(seen, log.displacement.shape[:3]).copy())

    return fault


def frozen(share: float) -> Fault:
    """A share of the markers stays where it was at half of the time."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        displacement, still, half = log.displacement.copy(), rng.random(log.grid) < share, len(log) // 2
        displacement[half:, still] = displacement[half, still]
        return replace(log, displacement=displacement)

    return fault


def hysteresis(size: float) -> Fault:
    """A marker follows its place only beyond ``size`` m: the play operator, along each axis."""

    def fault(log: GraspLog, _: np.random.Generator) -> GraspLog:
        displacement = log.displacement.copy()
        for k in range(1, len(log)):
            displacement[k] = np.clip(displacement[k - 1], displacement[k] - size, displacement[k] + size)
        return replace(log, displacement=displacement)

    return fault


def changed_forces(change: Callable[[FloatArray], FloatArray]) -> Fault:
    """With other forces, where there are any."""
    return lambda log, _: log if log.force is None else replace(log, force=change(log.force))


def tilted(angle: float) -> Fault:
    """Forces are reported in a frame that is turned about y by an angle in degrees: all normals err by so much."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return changed_forces(lambda force: force @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]))


def dome_forces(angle: float) -> Fault:
    """Forces on a dome are reported as if it were flat: they are tilted outwards by an angle in degrees at its edge."""

    def fault(log: GraspLog, _: np.random.Generator) -> GraspLog:
        if log.force is None:
            return log
        out = log.position[..., :2] - log.position[..., :2].mean(axis=(0, 1))
        far = np.hypot(*np.moveaxis(out, -1, 0))
        tilt, out = np.radians(angle) * far / far.max(), out / np.maximum(far, 1e-12)[..., None]
        radial, normal = (log.force[..., :2] * out).sum(axis=-1), log.force[..., 2]
        more = np.cos(tilt) * radial + np.sin(tilt) * normal - radial
        sideways = log.force[..., :2] + more[..., None] * out
        return replace(
            log, force=np.concatenate([sideways, (np.cos(tilt) * normal - np.sin(tilt) * radial)[..., None]], axis=-1)
        )

    return fault


def faded(components: slice) -> Fault:
    """The gain of some components falls evenly to a half from the first frame to the last."""

    def change(force: FloatArray) -> FloatArray:
        faint = force.copy()
        faint[..., components] *= np.linspace(1.0, 0.5, len(force))[:, None, None, None]
        return faint

    return changed_forces(change)


def late(time: float) -> Fault:
    """Forces are those of so many seconds before."""

    def fault(log: GraspLog, _: np.random.Generator) -> GraspLog:
        then = np.maximum(np.searchsorted(log.time, log.time - time, side="right") - 1, 0)
        return log if log.force is None else replace(log, force=log.force[then])

    return fault


def stuck(force: FloatArray) -> FloatArray:
    """Forces that stay as they are at half of the time."""
    half = len(force) // 2
    return np.concatenate([force[:half], np.broadcast_to(force[half], force[half:].shape)])


def crosstalk(share: float) -> Fault:
    """A share of each element's normal force appears along x as well."""
    return changed_forces(
        lambda force: force + share * np.stack([force[..., 2], *np.zeros((2, *force.shape[:3]))], axis=-1)
    )


def dropped(share: float) -> Fault:
    """A share of the frames, chosen at random, is lost."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        kept = round((1.0 - share) * len(log))
        return log.take(np.sort(rng.choice(len(log), kept, replace=False)))

    return fault
