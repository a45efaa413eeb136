"""Friction of a contact from its patches: a value where loads stood on the limit surface, a lower bound otherwise."""

from collections.abc import Sequence

import numpy as np

from slipcore.defaults import NORMAL_95, PatchOptions, choose_options
from slipcore.frames import FloatArray
from slipcore.patch.local_rates import moving_mean
from slipcore.patch_record import ContactFriction, Patch


def contact_friction(time: FloatArray, patches: Sequence[Patch], **options: float) -> ContactFriction | None:
    """What the ``patches`` of a log tell of friction, at times [t] s; None without forces or contact.

    ``options``: see ``defaults.PatchOptions``; raises ``InvalidInput`` for those that do not exist or are out of range.
    """
    chosen = choose_options(PatchOptions, options)
    at_limit = [patch.load_ratio[patch.plateau] for patch in patches]
    ratio = np.concatenate([*at_limit, np.empty(0)])
    if len(ratio):
        return _at_limit(ratio, _independent(time, patches, chosen), patches, chosen)
    bounds = [bound for patch in patches if (bound := _largest(time, patch, chosen)) > 0.0]
    if not bounds:
        return None
    held = max(bounds)
    return ContactFriction(held, held * (1.0 - NORMAL_95 * chosen.resultant_error), np.inf, True, _why_none(patches))


def _at_limit(
    ratio: FloatArray, independent: float, patches: Sequence[Patch], options: PatchOptions
) -> ContactFriction:
    middle = float(np.median(ratio))  # where a plateau begins, the load still grows
    scatter = float(ratio.std()) / np.sqrt(max(independent, 1.0))
    error = NORMAL_95 * float(np.hypot(scatter, options.resultant_error * middle))
    regimes = [regime for regime in ("pivoting", "sliding") if any((patch.regime == regime).any() for patch in patches)]
    reason = f"the load grew no more in {len(ratio)} frames of {' and '.join(regimes)}"
    return ContactFriction(middle, middle - error, middle + error, False, reason)


def _independent(time: FloatArray, patches: Sequence[Patch], options: PatchOptions) -> float:
    """How many values on the plateaus are about independent: one a window."""
    interval = np.gradient(time)
    return float(sum(interval[patch.frames][patch.plateau].sum() for patch in patches)) / options.window


def _largest(time: FloatArray, patch: Patch, options: PatchOptions) -> float:
    """Largest load ratio that was held for about a window."""
    held = patch.normal_force >= options.least_force_share * np.nanmax(patch.normal_force)
    mean = moving_mean(time[patch.frames], np.where(held, patch.load_ratio, np.nan), options.window)
    return float(np.nanmax(mean, initial=0.0))


def _why_none(patches: Sequence[Patch]) -> str:
    rolls = sum(int((patch.regime == "rolling").sum()) for patch in patches)
    frames = sum(int((patch.regime != "none").sum()) for patch in patches)
    if rolls > 0.5 * frames:
        return "the contact travels without a load at its limit, as of an object that rolls or rocks"
    return "the whole contact never slipped under a load that grew no more"
