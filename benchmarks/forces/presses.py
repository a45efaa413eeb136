"""Gels that are learnt from presses with known forces (`python -m benchmarks.forces --only "gel calibration"`).

A sphere is pressed on a gel with 2, 5 and 10 N, given to 1 %, and held for a second (30 frames); markers are those of
benchmarks/forces/scenes.py, which no reconstruction can represent. Then a later press with 10 N that is sheared is
reconstructed by the true gel, by one that is described wrong, and by the one that was learnt.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.forces.scenes import Lattice, press, repeated, seen
from benchmarks.pages import table
from slipcore import GraspLog
from slipcore.forces import Gel, GelEstimate, calibrate_gel, reconstruct
from slipcore.forces.gel_calibration.calibrate import GIVEN
from slipcore.frames import FloatArray

LATTICE = Lattice((14, 14), 7)
"""Markers 1.05 mm apart."""
FORCES = (2.0, 5.0, 10.0)
FORCE_NOISE, RATIO, HELD = 0.01, 0.49, 30
"""Of a known force; Poisson's ratio; frames of a hold."""
GELS = {"half-space": np.inf, "5 mm": 5e-3, "2 mm": 2e-3}
PLACES = ((0.22e-3, -0.36e-3), (-0.3e-3, 0.14e-3), (0.4e-3, 0.25e-3))
"""Of the three presses, m."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """A gel that was learnt, draw by draw; errors of later forces are relative: tangential, normal."""

    seen: str
    gel: str
    noise: float
    given: float | None
    true: Gel
    estimates: list[tuple[GelEstimate, ...]]
    forces: dict[str, tuple[float, float]]
    seconds: float


def cases() -> Iterator[tuple[bool, str, float, float | None]]:
    """With depth or without, gel, noise in m, and Poisson's ratio where it is given."""
    yield True, "half-space", 1e-6, None
    yield False, "half-space", 1e-6, RATIO
    for with_depth in (True, False):
        yield with_depth, "5 mm", 1e-6, None
        yield with_depth, "5 mm", 10e-6, None
        yield with_depth, "2 mm", 1e-6, None


def calibrated(with_depth: bool, gel: str, noise: float, given: float | None, draws: int) -> Calibration:
    """One case."""
    true, rng = Gel(1e6, RATIO, GELS[gel]), np.random.default_rng(29)
    began, estimates, errors = time.process_time(), [], []
    for _ in range(draws):
        logs = [_press(true, force, place, noise, with_depth, rng) for force, place in zip(FORCES, PLACES, strict=True)]
        told = np.array(FORCES) * (1.0 + FORCE_NOISE * rng.standard_normal(3))
        found = calibrate_gel(logs, list(told), poisson_ratio=given, noise=noise)
        estimates.append(found.estimates)
        wrong = replace(true, young_modulus=1.1e6, thickness=1.1 * true.thickness)
        errors.append(_later(true, {"true": true, "wrong": wrong, "learnt": found.gel}, noise, with_depth, rng))
    seconds = (time.process_time() - began) / draws
    later = {name: tuple(np.mean([each[name] for each in errors], axis=0)) for name in errors[0]}
    return Calibration("with z" if with_depth else "in the plane", gel, noise, given, true, estimates, later, seconds)


def _press(
    gel: Gel, force: float, place: tuple[float, float], noise: float, with_depth: bool, rng: np.random.Generator
) -> GraspLog:
    truth = press("sphere", gel, LATTICE, place, steps=((force / FORCES[-1], 0.0),) * 2)
    return seen(repeated(truth, HELD // 2).log, noise, with_depth, rng)


def _later(
    true: Gel, gels: dict[str, Gel], noise: float, with_depth: bool, rng: np.random.Generator
) -> dict[str, tuple[float, float]]:
    """Errors of the resultant of another press by each description."""
    truth = press("sphere", true, LATTICE, steps=((1.0, 1.0),) * 2)
    log = seen(truth.log, noise, with_depth, rng)
    return {name: _errors(reconstruct(log, gel, noise=noise).resultant, truth.total) for name, gel in gels.items()}


def _errors(found: FloatArray, true: FloatArray) -> tuple[float, float]:
    tangential, normal = (np.linalg.norm((found - true)[:, part]) / np.linalg.norm(true[:, part])
                          for part in (slice(2), slice(2, 3)))  # fmt: skip
    return float(tangential), float(normal)


def calibration_table(found: list[Calibration]) -> str:
    """Errors in percent (Poisson's ratio: its own), half of the interval in brackets, and how many hold the truth."""
    columns = ("seen", "gel", "noise, µm", "E, %", "ν", "thickness", "inside", "forces by the true gel, %",
               "described 10 % wrong, %", "learnt, %", "CPU, s")  # fmt: skip
    rows = [
        (
            each.seen, each.gel, f"{1e6 * each.noise:g}", _relative(each, 0), _ratio(each), _thickness(each),
            _inside(each), *(_percent(each.forces[name]) for name in ("true", "wrong", "learnt")), each.seconds,
        )
        for each in found
    ]  # fmt: skip
    return table(columns, rows)


def _truths(each: Calibration) -> tuple[float, float, float]:
    return each.true.young_modulus, each.true.poisson_ratio, each.true.thickness


def _relative(each: Calibration, k: int) -> str:
    true = _truths(each)[k]
    errors = [100.0 * (estimates[k].value / true - 1.0) for estimates in each.estimates]
    half = max(50.0 * (estimates[k].high - estimates[k].low) / true for estimates in each.estimates)
    return f"{' / '.join(f'{error:+.2g}' for error in errors)} (± {half:.2g})"


def _ratio(each: Calibration) -> str:
    found = [estimates[1] for estimates in each.estimates]
    note = ", the prior's" if any(estimate.note for estimate in found) else ""
    if each.given is not None:
        return GIVEN
    half = max(0.5 * (estimate.high - estimate.low) for estimate in found)
    return f"{' / '.join(f'{estimate.value - RATIO:+.2g}' for estimate in found)} (± {half:.2g}{note})"


def _thickness(each: Calibration) -> str:
    if np.isfinite(each.true.thickness):
        return f"{_relative(each, 2)} %"
    return " / ".join(f"at least {1e3 * estimates[2].low:.3g} mm" for estimates in each.estimates)


def _inside(each: Calibration) -> str:
    pairs = [(e, t) for estimates in each.estimates for e, t in zip(estimates, _truths(each), strict=True)]
    return f"{sum(e.low <= t <= e.high for e, t in pairs)} of {len(pairs)}"


def _percent(errors: tuple[float, float]) -> str:
    return " / ".join(f"{100.0 * error:.2g}" for error in errors)
