"""Friction of a contact from its patches: a value where loads stood on the limit surface, a lower bound otherwise."""

from collections.abc import Sequence

import numpy as np

from slipcore.defaults import NORMAL_95, PatchOptions, choose_options
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
    held = _largest(time, patches, chosen)
    if not held > 0.0:
        return None
    return ContactFriction(held, held * (1.0 - NORMAL_95 * chosen.resultant_error), np.inf, True, _why_none(patches))


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


def _largest(time: FloatArray, patches: Sequence[Patch], options: PatchOptions) -> float:
    """Largest load ratio that was held for about a window."""
    from slipcore.patch.local_rates import moving_mean  # compiled: who only holds results goes without

    force, bounds = joined(patches, "normal_force"), bounds_of(patches)
    least = options.least_force_share * np.fmax.reduceat(force, bounds[:-1])
    held = force >= np.repeat(least, np.diff(bounds))
    ratio = np.where(held, joined(patches, "load_ratio"), np.nan)
    return float(np.nanmax(moving_mean(time[frames_of(patches)], ratio, bounds, options.window), initial=0.0))


def _why_none(patches: Sequence[Patch]) -> str:
    regime = joined(patches, "regime")
    if np.count_nonzero(regime == "rolling") > 0.5 * np.count_nonzero(regime != "none"):
        return "the contact travels without a load at its limit, as of an object that rolls or rocks"
    return "the whole contact never slipped under a load that grew no more"
