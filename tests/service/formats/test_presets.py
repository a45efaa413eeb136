"""Tables of vendors by a preset's name."""

import json
from pathlib import Path

import numpy as np
import pytest

from service import formats
from service.formats.mapping import parse
from slipcore import GraspLog, InvalidInput

PILLARS, FRAMES = 9, 5
VALUES = np.random.default_rng(1).uniform(-0.1, 0.1, (2, FRAMES, PILLARS, 6))
"""Of two arrays: displacement in mm and force in N of each pillar."""
TIME = 1_000_000 + 10_000 * np.arange(FRAMES)


def logger(array: int) -> dict[str, list[str]]:
    """As Contactile's logger writes one array; the second has the same names."""
    told = {"T_us": [str(time) for time in TIME]} if array == 0 else {}
    for pillar in range(PILLARS):
        for k, name in enumerate(("DX", "DY", "DZ", "FX", "FY", "FZ")):
            told[f"P{pillar}_{name}"] = [repr(float(value)) for value in VALUES[array, :, pillar, k]]
        told[f"P{pillar}_isInContact"] = ["1"] * FRAMES
        told[f"P{pillar}_slipState"] = ["-2"] * FRAMES
    return told | {"FrictionEst": ["nan", "nan", "0.61", "0.63", "0.65"]}


def recorder(array: int) -> dict[str, list[str]]:
    """As recorders of its ROS messages write one array: 81 columns, 163 of two arrays with the time."""
    told = {"timestamp": [repr(1e-6 * float(time)) for time in TIME]} if array == 0 else {}
    for pillar in range(PILLARS):
        for k, name in enumerate(("dX", "dY", "dZ", "fX", "fY", "fZ")):
            told[f"{array}_{name}_{pillar}"] = [repr(float(value)) for value in VALUES[array, :, pillar, k]]
        told[f"{array}_incontact_{pillar}"] = ["True"] * FRAMES
        told[f"{array}_slipstate_{pillar}"] = ["0", "0", "0", "1", "1"]
    for name in ("gfX", "gfY", "gfZ", "gtX", "gtY", "gtZ", "target_grip_force", "is_sd_active"):
        told[f"{array}_{name}"] = ["0"] * FRAMES
    return told | {f"{array}_friction_est": ["0.6"] * FRAMES}


def written(path: Path, *arrays: dict[str, list[str]]) -> Path:
    names = [name for array in arrays for name in array]
    columns = [column for array in arrays for column in array.values()]
    path.write_text("\n".join(",".join(row) for row in [names, *zip(*columns, strict=True)]), encoding="utf-8")
    return path


def assert_read(log: GraspLog, array: int) -> None:
    told = VALUES[array].reshape(FRAMES, 3, 3, 6)
    np.testing.assert_allclose(log.displacement, 1e-3 * told[..., :3], rtol=1e-12, err_msg="mm to m")
    assert log.force is not None
    np.testing.assert_allclose(log.force, told[..., 3:] * [1.0, 1.0, -1.0], rtol=1e-12, err_msg="pressure is negative")
    np.testing.assert_allclose(np.diff(log.time), 0.01, rtol=1e-6)


def lower(array: int) -> dict[str, list[str]]:
    """As the manual writes the names in one place."""
    return {name.lower(): told for name, told in recorder(array).items()}


@pytest.mark.parametrize("array", [0, 1])
@pytest.mark.parametrize("write", [logger, recorder, lower])
def test_an_array_of_pillars_is_read_by_name(tmp_path: Path, write: object, array: int) -> None:
    assert callable(write)
    path = written(tmp_path / "log.csv", write(0), write(1))
    log = formats.read(path, mapping=json.dumps({"preset": "papillarray", "array": array}))
    assert_read(log, array)
    assert log.contact is not None
    assert log.contact.all()
    if array == 0:
        assert_read(formats.read(path, "text/csv", mapping="papillarray"), 0)


def test_what_the_vendor_says_of_slip_and_friction_is_kept_as_metadata(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", recorder(0), recorder(1))
    assert len(path.read_text().splitlines()[0].split(",")) == 163
    log = formats.read(path, mapping="papillarray")
    assert log.metadata["slip_state"] == "0 27 times, 1 18 times"
    assert log.metadata["friction_est"] == "0.6 5 times"


def test_what_a_preset_assumes_is_overridden_by_what_is_said_beside_it(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", {name: told for name, told in logger(0).items() if "Contact" not in name})
    log = formats.read(path, mapping=json.dumps({"preset": "papillarray", "pitch": 5e-3, "sensor": {"value": "left"}}))
    assert (log.sensor, log.contact) == ("left", None), "forces tell the contact where it isn't there"
    np.testing.assert_allclose(np.ptp(log.position[..., 0]), 10e-3, rtol=1e-12)


def test_taxels_of_forces_alone_are_read_by_name(tmp_path: Path) -> None:
    force = np.random.default_rng(2).uniform(0.0, 1.0, (3, 16, 3))
    told = {"%time": [str(10**18 + 10**7 * k) for k in range(3)]}
    for k, axis in enumerate("xyz"):
        told |= {f"field.sensors0.forces{e}.{axis}": [repr(float(f)) for f in force[:, e, k]] for e in range(16)}
    log = formats.read(written(tmp_path / "log.csv", told), mapping="uskin")
    np.testing.assert_allclose(log.force, force.reshape(3, 4, 4, 3) * [1.0, 1.0, -1.0], rtol=1e-12)
    assert not log.has_displacement


def test_a_preset_that_does_not_fit_or_is_none_is_refused_by_name(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", {"t": ["0", "1"], "x": ["1", "2"]})
    with pytest.raises(
        InvalidInput, match=r"preset is of columns T_us, .*P\*_FX, .* not there; allowed: the columns t, x"
    ):
        formats.read(path, mapping="papillarray")
    with pytest.raises(InvalidInput, match="preset is 'biotac'; allowed: papillarray, uskin"):
        formats.read(path, mapping='{"preset": "biotac"}')
    with pytest.raises(InvalidInput, match="array is -1; allowed: 0 to 99"):
        formats.read(path, mapping='{"preset": "papillarray", "array": -1}')


def test_a_contact_that_the_caller_names_must_be_there(tmp_path: Path) -> None:
    """Misspelt, it was dropped, and with it the contact that the preset alone would have read."""
    path = written(tmp_path / "log.csv", logger(0))
    with pytest.raises(InvalidInput, match=r"preset is of columns P\*_isInContct, not there"):
        formats.read(path, mapping='{"preset": "papillarray", "contact": "P*_isInContct"}')
    assert formats.read(path, mapping='{"preset": "papillarray"}').contact is not None


@pytest.mark.parametrize("columns", [logger(0), recorder(0)])
def test_a_table_without_a_mapping_is_answered_with_the_preset_that_reads_it(
    tmp_path: Path, columns: dict[str, list[str]]
) -> None:
    path = written(tmp_path / "log.csv", columns)
    for name in (None, "text/csv"):
        with pytest.raises(InvalidInput, match="allowed: mapping papillarray, which reads such columns, or "):
            formats.read(path, name)
    other = written(tmp_path / "other.csv", {"a": ["1"], "P_FX": ["2"], "P0_FX": ["3"]})
    with pytest.raises(InvalidInput, match="allowed: the columns of tracked markers"):
        formats.read(other)


def test_a_name_that_is_no_preset_is_answered_with_those_there_are() -> None:
    with pytest.raises(InvalidInput, match="allowed: a JSON object, or papillarray or uskin"):
        parse("papilarray")
