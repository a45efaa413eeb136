"""What a benchmark's data card says of its scenes."""

from dataclasses import replace

from service.slip_benchmark.card import data_card
from service.slip_benchmark.folder import Manifest
from service.slip_benchmark.scenes import FORMAT, VERSION
from tests.service.slip_benchmark.test_folder import ENTRY

LATTICE, CAMERA = "lattice 20x20", "markers 10x7"


def test_scenes_are_counted_by_kind_and_fault() -> None:
    scenes = (
        ENTRY,
        replace(ENTRY, fault="crosstalk 10 %"),
        replace(ENTRY, kind=CAMERA, fault="5 % of markers freeze"),
        replace(ENTRY, kind=CAMERA),
        replace(ENTRY, kind=CAMERA),
    )
    card = data_card(Manifest("5ea1", (LATTICE, CAMERA), "MIT", "stiction 9", scenes))
    rows = [line for line in card.splitlines() if line.startswith("| ")][2:]
    assert rows == [
        "| lattice 20x20 | 2 | displacement (x, y, z) and forces of a gel, as Tac3D | 20 × 20 | 30 |",
        "| markers 10x7 | 3 | displacement in the plane (x, y) and which markers touch, no forces | 10 × 7 | 25 |",
    ]
    assert "measurement.** 5 grasps were simulated" in card
    assert "no noise (3), noise 1 µm (0)" in card
    assert "crosstalk 10 % (1), 5 % of markers freeze (1)." in card
    assert f"Format: `{FORMAT}` version {VERSION}, made by stiction 9. Licence: MIT" in card
    assert "`5ea1`" in card
    assert "--phrase TEXT --scenes 5 --output FOLDER" in card
