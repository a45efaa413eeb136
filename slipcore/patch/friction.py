"""Friction of a contact from its patches: a value where loads stood on the limit surface, a lower bound otherwise."""

from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

from slipcore.defaults import NORMAL_95, PATCHES, PatchOptions, choose_options
from slipcore.frames import FloatArray
from slipcore.patch_record import ContactFriction, Patch, bounds_of, frames_of, joined


def contact_friction(time: FloatArray, patches: Sequence[Patch], **options: float) -> ContactFriction | None:
    """What the ``patches`` of a log say of friction, at times [t] s; None without forces or contact.

    ``options``: see ``defaults.PatchOptions``; raises ``InvalidInput`` for those that do not exist or are out of range.
    """
    chosen = choose_options(PatchOptions, options)
    if not patches:
        return None
    if any(patch.plateau.any() for patch in patches):
        return _at_limit(time, patches, chosen)
    held, low = _largest(time, patches, chosen)
    if not held > 0.0:
        return None
    reason = _why_none(patches)
    if low < PATCHES.least_known * held:
        reason += f"; of the ratio of {held:.2g} that was held, all but {low:.2g} may be noise of the forces"
    return ContactFriction(held, low * (1.0 - NORMAL_95 * chosen.resultant_error), np.inf, True, reason)


def _at_limit(time: FloatArray, patches: Sequence[Patch], options: PatchOptions) -> ContactFriction:
    plateau, regime = joined(patches, "plateau"), joined(patches, "regime")
    ratio = joined(patches, "load_ratio")[plateau]
    middle = float(np.median(ratio))  # where a plateau begins, the load still grows
    duration = float(np.gradient(time)[frames_of(patches)[plateau]].sum())
    independent = max(duration / options.window, 1.0)  # about one value a window
    scatter = float(ratio.std()) / np.sqrt(independent)
    error = NORMAL_95 * float(np.hypot(scatter, options.resultant_error * middle))
    regimes = [each for each in ("pivoting", "sliding") if (regime == each).any()]
    reason = f"the load grew no more in {len(ratio)} frames of {' and '.join(regimes)}"
    return ContactFriction(middle, middle - error, middle + error, False, reason)


def _largest(time: FloatArray, patches: Sequence[Patch], options: PatchOptions) -> tuple[float, float]:
    """Largest load ratio that was held for about a window beyond noise, and what it was at least (97.5 %, one-sided).

    In each frame the ratio is the largest over all motions, which noise of three loads raises by up to √3 standard
    deviations in the mean: more frames do not average that out. Nor is it one window that is looked at but as many as
    the log has, and that with the largest ratio is taken (Bonferroni).
    """
    from slipcore.patch.local_rates import moving_mean  # compiled: who only holds results goes without

    force, bounds, times = joined(patches, "normal_force"), bounds_of(patches), time[frames_of(patches)]
    least = options.least_force_share * np.fmax.reduceat(force, bounds[:-1])
    held = force >= np.repeat(least, np.diff(bounds))
    ratio, noise = (np.where(held, joined(patches, name), np.nan) for name in ("load_ratio", "ratio_noise"))
    (mean, count), (raised, _), (variance, _) = (
        moving_mean(times, each, bounds, options.window) for each in (ratio, np.sqrt(3.0) * noise, noise**2)
    )
    windows = max(float(np.sum(1.0 / np.fmax(count, 1.0), where=held)), 1.0)
    deviations = -NormalDist().inv_cdf(NormalDist().cdf(-NORMAL_95) / windows)
    independent = np.fmax(count / joined(patches, "noise_frames"), 1.0)
    low = mean - raised - deviations * np.sqrt(np.fmax(variance, 0.0) / independent)
    if not np.isfinite(low).any():
        return 0.0, 0.0
    best = int(np.nanargmax(low))
    return float(mean[best]), max(float(low[best]), 0.0)


def _why_none(patches: Sequence[Patch]) -> str:
    regime = joined(patches, "regime")
    if np.count_nonzero(regime == "rolling") > 0.5 * np.count_nonzero(regime != "none"):
        return "the contact travels without a load at its limit, as of an object that rolls or rocks"
    return "the whole contact never slipped under a load that grew no more"
