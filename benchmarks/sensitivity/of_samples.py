"""What is measured of friction samples, and of what is found in a field: the end of a sensor's range, its smoothing."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.ndimage import gaussian_filter

import estimators
from benchmarks.end_to_end import __main__ as of_grasps
from benchmarks.forces import saturation
from benchmarks.sensitivity.rows import Known, Row, of_tables, rows
from slipcore import GraspLog, SampleOptions, SlipHistory, collect_samples, detect_slip
from slipcore import defaults as of_slipcore
from slipcore.collection import collect_friction
from slipcore.frames import FloatArray
from slipcore.saturation import saturated
from slipcore.surface import smoothing

Seen = tuple[GraspLog, SlipHistory]
SETTINGS = (
    of_grasps.Setting(grasps=3),
    of_grasps.Setting(grasps=3, marker_noise=1e-5, force_noise=5e-3),
    of_grasps.Setting(grasps=3, side=12, force_noise=3.5e-3),
)
"""Grasps as they usually are, with much noise, and of few elements."""
MATERIALS = (9101, 9102)
"""Seeds of no other benchmark."""
SMEARED = (0.5, 1.0, 1.5, 2.0)
"""Standard deviations, elements, of what smooths forces in the plane."""
WIDTHS = (0.0, 0.7, 1.2)
"""Of kernels that a field is smoothed with, elements."""
NOISE = 1e-6
SHOWN = ((0.0, 0.0), (1e-6, 1e-6), (1e-6, 5e-6))
"""Noise of markers and what they are rounded to, m, where they reach the end of their range."""
ENDS = (0.9, 0.7)


@cache
def slipping() -> list[tuple[of_grasps.Setting, int, list[Seen]]]:
    """Grasps of each setting and material with what is said of their slip, which no default of samples changes."""
    return [
        (setting, seed, [_seen(setting, seed, number) for number in range(setting.grasps)])
        for setting in SETTINGS
        for seed in MATERIALS
    ]


def _seen(setting: of_grasps.Setting, seed: int, number: int) -> Seen:
    log = of_grasps.seen(
        of_grasps.simulated(seed, number, setting.side), setting, np.random.default_rng([seed, number])
    )
    return log, detect_slip(log)


def sampled(**chosen: float) -> dict[str, float]:
    """Error of friction at the working point, width of its interval, and number of samples, in logarithms."""
    errors, widths, counts = [], [], []
    for setting, seed, grasps in slipping():
        samples = [collect_samples(log, history, **chosen) for log, history in grasps]
        error, half = of_grasps.error_and_half_width(estimators.fit(samples, "auto", seed=1), setting, seed)
        errors.append(error)
        widths.append(half)
        counts.append(sum(map(len, samples)))
    error = np.log(np.mean(np.square(errors))) / 2
    return {"error": float(error), "width": float(np.mean(np.log(widths))), "samples": float(np.mean(np.log(counts)))}


def of_samples(known: Known) -> list[Row]:
    """Which slipping elements give a sample; noise of forces is estimated unless it is given."""
    left = known | {("SampleOptions", "force_noise")}
    return list(rows("SampleOptions", SampleOptions, lambda name, value: sampled(**{name: value}), sampled(), left))


def trusted() -> dict[str, float]:
    """Shares of grasps whose elements are left out: as they are, and with smeared forces."""
    shares = {}
    for name, smeared_by in (("true left out", (0.0,)), ("smeared left out", SMEARED)):
        told = [
            collect_friction(smeared(log, width), history)
            for _, _, grasps in slipping()
            for log, history in grasps
            for width in smeared_by
        ]
        shares[name] = float(np.mean([each.elements_left_out is not None for each in told]))
    return shares


def smeared(log: GraspLog, width: float) -> GraspLog:
    """The log with forces in the plane that are smoothed over elements, as normal ones are not."""
    assert log.force is not None
    plane = gaussian_filter(log.force[..., :2], (0.0, width, width, 0.0))
    return replace(log, force=np.concatenate([plane, log.force[..., 2:]], axis=-1))


def of_collection(known: Known) -> list[Row]:
    """When the contact is trusted and its elements are not."""
    return of_tables(of_slipcore, ("COLLECTION",), trusted, known)


@cache
def pressed() -> list[FloatArray]:
    """Fields of displacement [t, n, m, 3], m, of presses that the defaults were not chosen on."""
    return [field for _, field in saturation.fields()][::5]


def ended() -> dict[str, float]:
    """Shares of ends of a range that are found, and of fields without one that seem to have it."""
    rng = np.random.default_rng(59)
    found: list[bool] = []
    falsely: list[bool] = []
    for field in pressed():
        for noise, step in SHOWN:
            noisy = field + noise * rng.standard_normal(field.shape)
            shown = np.round(noisy / step) * step if step else noisy
            falsely.append(bool(saturated(shown).any()))
            found += [_is_found(shown, level, step) for level in ENDS]
    return {"found": float(np.mean(found)), "falsely": float(np.mean(falsely))}


def _is_found(shown: FloatArray, level: float, step: float) -> bool:
    seen, is_cut = saturation.cut(shown, slice(2, 3), level, step)
    return bool(saturated(seen)[is_cut].mean() > saturation.FOUND)


def of_saturation(known: Known) -> list[Row]:
    """When readings are the end of a sensor's range."""
    return of_tables(of_slipcore, ("SATURATION",), ended, known)


def smoothed() -> dict[str, float]:
    """Error of the kernel's width, elements, and of the field without it over what smoothing did to the field."""
    told, left = [], []
    for field in pressed():
        for width, noisy in zip(WIDTHS, _through(field), strict=True):
            told.append(smoothing.kernel_width(np.arange(len(field), dtype=float), noisy, NOISE / 10) - width)
            if width:
                smoothing._inverse.cache_clear()
                done, undone = (each - field for each in (noisy, smoothing.unsmoothed(noisy, width, NOISE / 100)))
                left.append(np.linalg.norm(undone) / np.linalg.norm(done))
    return {"width": float(np.sqrt(np.mean(np.square(told)))), "field": float(np.log(np.mean(left)))}


def _through(field: FloatArray) -> Sequence[FloatArray]:
    """The field with noise as a sensor shows it that smooths by each width."""
    rng = np.random.default_rng(61)
    noisy = field + NOISE * rng.standard_normal(field.shape)
    return [gaussian_filter(noisy, (0.0, width, width, 0.0)) if width else noisy for width in WIDTHS]


def of_smoothing(known: Known) -> list[Row]:
    """How a sensor's smoothing is found and undone."""
    return of_tables(of_slipcore, ("SMOOTHING",), smoothed, known)
