"""Whether a log's own forces are compared with those by its gel."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from service.cli.inspection import COMPARED_FRAMES, comparison, inspect_log
from slipcore import FrictionSamples, GraspLog, InvalidInput
from slipcore.contact.tiers.ramp import tangential_ramp
from slipcore.forces import Gel, compare_forces, reconstruct

PLACE = 1e-3 * np.stack(np.meshgrid(np.arange(3.0), np.arange(3.0), [0.0], indexing="ij"), axis=-1)[:, :, 0]
STILL = np.zeros((2, 3, 3, 3))


def test_forces_are_compared_where_there_are_both(tmp_path: Path) -> None:
    gel = tmp_path / "gel.json"
    gel.write_text("{}", encoding="utf-8")
    plain = GraspLog(np.arange(2.0), PLACE, STILL, 1e-6)
    assert comparison(plain, gel) is None
    assert comparison(GraspLog(np.arange(2.0), PLACE, STILL, 1e-6, force=STILL), None) is None
    found = GraspLog(np.arange(2.0), PLACE, STILL, 1e-6, force=STILL, metadata={"force": "reconstructed"})
    assert comparison(found, gel) is None  # with themselves all forces agree
    alone = GraspLog(np.arange(2.0), PLACE, STILL, 1e-6, force=STILL, metadata={"displacement": "none"})
    with pytest.raises(InvalidInput, match="gel is given for a log of forces alone; allowed: a log with displacement"):
        comparison(alone, gel)


def test_some_frames_of_a_log_compare_as_all_of_them_do(tmp_path: Path) -> None:
    """Its noise is that from each frame to the next, not to one a tenth of a second later."""
    log = tangential_ramp(points=6, pitch=2e-3, marker_noise=1e-6, seed=1)
    assert len(log) > 5 * COMPARED_FRAMES
    gel = Gel(young_modulus=1e5, poisson_ratio=0.4)
    path = tmp_path / "gel.json"
    path.write_text(json.dumps(gel.to_json()), encoding="utf-8")
    some, whole = comparison(log, path), compare_forces(log, reconstruct(log, gel))
    assert some is not None
    # frames of the pull have another share of 20 than of all: three seeds differ by .021 (tangential) and .009 at most
    for name in ("normal", "tangential", "total_normal", "total_tangential"):
        np.testing.assert_allclose(getattr(some, name).ratio, getattr(whole, name).ratio, rtol=0.03)
        np.testing.assert_allclose(getattr(some, name).correlation, getattr(whole, name).correlation, atol=0.02)
    still = replace(log, displacement=np.zeros_like(log.displacement))
    nothing = comparison(still, path)
    assert nothing is not None
    assert np.isnan(nothing.total_normal.ratio)


def test_what_is_too_unsure_for_samples_is_told_and_speaks_neither_for_nor_against_friction(tmp_path: Path) -> None:
    """Checks go by the samples that friction goes by: those of forces that noise hides would follow force."""
    gel = tmp_path / "gel.json"
    gel.write_text('{"young_modulus": 1e6, "poisson_ratio": 0.5}', encoding="utf-8")
    log = tangential_ramp(points=8, pitch=1.5e-3, normal_force=6.0, marker_noise=2e-5, seed=1)
    seen = inspect_log(replace(log, force=None).take(np.arange(0, len(log), 2)), gel=gel)
    found, because = seen.friction()
    assert len(found.samples) == 0
    assert because is not None
    assert "too unsure for samples; let all of the contact slide" in because
    assert [each.name for each in seen.findings(found)] == ["reconstructed forces"]
    force = np.linspace(0.1, 1.0, 40)
    falling = FrictionSamples(1.0 - 0.5 * force, 0 * force, force, force, force, np.arange(40), 1.0 + 0 * force, 1e-6)
    assert "friction follows force" in [each.name for each in seen.findings(found._replace(elements=falling))]
