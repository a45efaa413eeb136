"""How slip by sensor is measured and told."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from benchmarks.forces import slip
from benchmarks.forces.slip import GELS, LATTICES, NOISES, Outcome, scene, slip_table
from slipcore.contact.effects import FiniteLayer


def made(gel: str, markers: str, noise: float) -> Iterator[Outcome]:
    for seen in ("with z", "in the plane"):
        yield Outcome(seen, gel, markers, noise, (0.9, 0.95, 0.97), (0.92, 0.9, 0.98))


def test_each_sensor_is_measured_once_and_those_with_depth_come_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slip, "outcomes", made)
    path = tmp_path / "forces-slip.jsonl"
    found = slip.campaign(path)
    assert len(found) == 2 * len(GELS) * len(LATTICES) * len(NOISES)
    assert [each.seen for each in found] == sorted((each.seen for each in found), reverse=True)
    monkeypatch.setattr(slip, "outcomes", None)
    assert [(each.gel, each.noise) for each in slip.campaign(path)] == [(each.gel, each.noise) for each in found]


def test_a_row_tells_what_reconstructed_forces_gain() -> None:
    row = slip_table(list(made("5 mm", "10 × 7", 3e-6))).splitlines()[-1]
    assert [cell.strip() for cell in row.strip("|").split("|")] == [
        "in the plane", "5 mm", "10 × 7", "3", "0.900", "0.950", "0.970", "+0.050", "0.920", "0.900", "0.980", "-0.020",
    ]  # fmt: skip


def test_a_half_space_has_no_base() -> None:
    layers = [[e.thickness for e in scene(gel, "10 × 7").effects if isinstance(e, FiniteLayer)] for gel in GELS]
    assert layers == [[] if np.isinf(thickness) else [thickness] for thickness in GELS.values()]
