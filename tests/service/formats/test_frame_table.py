import contextlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service import formats
from service.formats import frame_table
from service.formats.members import of_all_frames
from slipcore import GraspLog, InvalidInput
from slipcore.markers import contact_by_motion

FRAMES, PILLARS = 5, 9
MAPPING: dict[str, Any] = {
    "grid": [3, 3],
    "pitch": 7e-3,
    "time": {"field": "T_us", "unit": "us"},
    "displacement": {"field": ["P*_DX", "P*_DY", "P*_DZ"], "unit": "mm"},
    "force": {"field": ["P*_FX", "P*_FY", "P*_FZ"], "unit": ["N", "N", "-N"]},
    "contact": "P*_isInContact",
}


def columns(rng: np.random.Generator) -> dict[str, list[str]]:
    """One sensor of pillars as its logger writes it: numbers as text, with much that no log needs."""
    told = {
        f"P{p}_{kind}{axis}": [f"{value:.6f}" for value in 0.1 * rng.standard_normal(FRAMES)]
        for kind in "DF"
        for p in range(PILLARS)
        for axis in "XYZ"
    }
    told |= {f"GG_{kind}{axis}": ["0.0"] * FRAMES for kind in "FT" for axis in "XYZ"}
    told |= {"isSDActive": ["1"] * FRAMES, "isRefLoad": ["0"] * FRAMES}
    told |= {f"P{p}_isInContact": [str(int(p < 3 or k > 2)) for k in range(FRAMES)] for p in range(PILLARS)}
    told |= {f"P{p}_slipState": ["-2"] * FRAMES for p in range(PILLARS)}
    return told | {"FrictionEst": ["nan"] * FRAMES}


def written(path: Path, *sensors: dict[str, list[str]], delimiter: str = ",") -> Path:
    time = [str(1_000_000 + 10_000 * k) for k in range(FRAMES)]
    names = ["T_us", *(name for sensor in sensors for name in sensor)]
    table = [time, *(column for sensor in sensors for column in sensor.values())]
    lines = [delimiter.join(line) for line in [names, *zip(*table, strict=True)]]
    path.write_text("# firmware 1.2\n\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def field(told: dict[str, list[str]], kind: str) -> np.ndarray:
    """Of pillars on their grid, [t, 3, 3, 3]."""
    parts = [[told[f"P{p}_{kind}{axis}"] for axis in "XYZ"] for p in range(PILLARS)]
    return np.asarray(parts, dtype=float).transpose(2, 0, 1).reshape(FRAMES, 3, 3, 3)


def read(path: Path, content_type: str | None = "text/csv", **changes: Any) -> GraspLog:
    return formats.read(path, content_type, mapping=json.dumps(MAPPING | changes))


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("content_type", [None, "text/csv", "application/octet-stream"])
def test_an_array_of_pillars_is_read_from_its_loggers_table(
    tmp_path: Path, delimiter: str, content_type: str | None
) -> None:
    told = columns(np.random.default_rng(1))
    log = read(written(tmp_path / "log.csv", told, delimiter=delimiter), content_type)
    np.testing.assert_allclose(log.displacement, 1e-3 * field(told, "D"), rtol=1e-12, err_msg="mm to m")
    assert log.force is not None
    np.testing.assert_allclose(log.force, field(told, "F") * [1.0, 1.0, -1.0], rtol=1e-12, err_msg="z is turned")
    np.testing.assert_allclose(np.diff(log.time), 0.01, rtol=1e-9, err_msg="µs to s")
    np.testing.assert_allclose(log.position[2, 0, :2] - log.position[0, 0, :2], [14e-3, 0.0], rtol=0, atol=1e-12)
    assert log.element_area == pytest.approx(49e-6, rel=1e-9)
    assert log.contact is not None
    assert log.contact.reshape(FRAMES, -1).sum(axis=1).tolist() == [3, 3, 3, 9, 9]


def test_a_note_does_not_overwrite_what_the_metadata_say(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", columns(np.random.default_rng(1)))
    told = {"metadata": {"value": {"robot": "one"}}}
    noted = read(path, **told, notes={"state": "P*_slipState"}).metadata
    assert (noted["robot"], noted["state"]) == ("one", "-2 45 times")
    with pytest.raises(InvalidInput, match="notes is of the name 'robot'; allowed: names that the metadata do not"):
        read(path, **told, notes={"robot": "P*_slipState"})


def test_a_column_is_the_grippers_force(tmp_path: Path) -> None:
    told = columns(np.random.default_rng(1)) | {"grip": ["0", "1500", "2500", "2500", "2400"]}
    log = read(written(tmp_path / "log.csv", told), gripper_force={"field": "grip", "unit": "mN"})
    np.testing.assert_allclose(log.gripper_force, [0.0, 1.5, 2.5, 2.5, 2.4], rtol=1e-12)


def test_a_second_sensors_columns_have_its_number(tmp_path: Path) -> None:
    first, second = (columns(np.random.default_rng(seed)) for seed in (1, 2))
    path = written(tmp_path / "log.csv", first, second)
    log = read(path, displacement={"field": [f"P*_D{axis}.1" for axis in "XYZ"], "unit": "mm"})
    np.testing.assert_allclose(log.displacement, 1e-3 * field(second, "D"), rtol=1e-12, err_msg="the second's")
    assert log.force is not None
    np.testing.assert_allclose(log.force[..., 0], field(first, "F")[..., 0], rtol=1e-12, err_msg="the first's")


def test_a_column_that_is_missing_is_no_element_less(tmp_path: Path) -> None:
    """All elements after it would be taken for their neighbours."""
    path = tmp_path / "log.csv"
    path.write_text("t,P0_X,P1_X,P3_X\n0,0,0,0\n1,0,0,0\n")
    mapping = {"time": "t", "displacement": ["P*_X"] * 3, "grid": [1, 3], "pitch": 1e-3}
    with pytest.raises(InvalidInput, match="is of elements 1 and 3, not 2; allowed: numbers without a gap"):
        formats.read(path, "text/csv", mapping=json.dumps(mapping))


def test_elements_may_be_numbered_by_row_and_column(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,P11_X,P12_X,P21_X,P22_X\n0,0,0,0,0\n1,1e-4,2e-4,3e-4,4e-4\n")
    mapping = {"time": "t", "displacement": ["P*_X"] * 3, "grid": [2, 2], "pitch": 1e-3}
    log = formats.read(path, "text/csv", mapping=json.dumps(mapping))
    assert log.displacement[1, ..., 0].tolist() == [[1e-4, 2e-4], [3e-4, 4e-4]]


def test_elements_come_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    order = (10, 2, 1, 0, 3, 4, 5, 6, 7, 8, 9, 11)
    lines = [["t", *(f"u{k}" for k in order)], *([t, *map(str, order)] for t in "01")]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(map(",".join, lines)))
    mapping = {"grid": [3, 4], "pitch": 1e-2, "time": "t", "displacement": {"field": ["u*"] * 3, "unit": "um"}}
    log = formats.read(path, "text/csv", mapping=json.dumps(mapping))
    assert (1e6 * log.displacement[0, ..., 0]).round(9).ravel().tolist() == list(range(12))


def test_a_log_written_as_a_table_comes_back(tmp_path: Path, log: GraspLog) -> None:
    """Every number of a log to its last digit, by columns named after nothing but their order."""
    n, m = log.grid
    flat = np.concatenate([log.time[:, None], log.displacement.reshape(len(log), -1)], axis=1)
    path = tmp_path / "log.csv"
    np.savetxt(path, flat, "%.17g", ",", header=",".join(["t", *(f"u{k}" for k in range(3 * n * m))]), comments="")
    mapping = {
        "grid": [n, m],
        "time": "t",
        "displacement": "u*",
        "position": {"value": log.position.tolist()},
        "element_area": {"value": log.element_area},
    }
    back = formats.read(path, "text/csv", mapping=json.dumps(mapping))
    np.testing.assert_array_equal(back.displacement, log.displacement)
    np.testing.assert_array_equal(back.time, log.time)


def test_only_a_mapping_makes_text_a_table_of_frames(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", columns(np.random.default_rng(1)))
    given = {"mapping": "{}"}
    assert formats.identify(path, "text/csv", given) == "frame table"
    assert formats.identify(path, "application/octet-stream", given) == "frame table"
    assert formats.identify(path, "text/csv") == "tracked markers"
    assert formats.identify(path, formats.FORMATS["frame table"].content_type) == "frame table"
    with pytest.raises(InvalidInput, match="only beside a table of tracked markers"):
        formats.read(path, "text/csv", mapping="{}", scale=1e-5)
    with pytest.raises(formats.UnsupportedFormat, match="a mapping that says which columns are what"):
        formats.read(path)
    for content in (b"\x00\x01,\x02", b"one column\n1\n", b"1,2\n3,4\n", b""):
        assert not frame_table.looks_like(content)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "file is without a header"),
        ("t,a\n", "file is without rows of what is looked for; it has the columns t, a"),
        ("x,y\n1,2\n", "file is without rows of what is looked for; it has the columns x, y"),
        ("t,a\n0,1\n1,x\n", "line 3, a is 'x'; allowed: a finite number"),
        ("t,a\n0,1\n1,inf\n", "line 3, a is 'inf'"),
        ("t,a\n0,1\n1,1_0\n", "line 3, a is '1_0'"),
        ("t,a\n0,1\n1,١\n", "line 3, a is '١'"),
        ("t,t.1,t\n0,1,1\n", r"file is with two columns 't\.1'"),
        ("t,a\n0,1\n1\n", "line 3 is of 1 cells; allowed: 2"),
        ("t,b\n0,1\n1,2\n", r"displacement is not there \(a, a, a\); allowed: the columns t, b"),
        ("t,a\n0,1\n,2\n", "time"),
        ("t,a\n1,1\n0,2\n", "time"),
        ("t,a\n0,1\n1,\n", "displacement"),
        ("t,a\n0,1\n1,True\n", "line 3, a is 'True'; allowed: a finite number"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(content)
    mapping = {"time": "t", "displacement": ["a"] * 3, "grid": [1, 1], "pitch": 1e-3, "element_area": {"value": 1e-6}}
    with pytest.raises(InvalidInput, match=message):
        formats.read(path, "text/csv", mapping=json.dumps(mapping))


@pytest.mark.parametrize(
    "names", [["P0_X", "P1_X", "P1_Y", "P2_Y"], ["P0_X", "P00_X", "P0_Y", "P1_Y"], ["P0_X", "P1_X", "P0_Y"]]
)
def test_components_of_different_elements_are_refused(tmp_path: Path, names: list[str]) -> None:
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(["t", *names]), *(",".join([t, *"0" * len(names)]) for t in "01")]))
    mapping = {"time": "t", "displacement": ["P*_X", "P*_Y", "P*_Y"], "grid": [1, 2], "pitch": 1e-3}
    with pytest.raises(InvalidInput, match=r"displacement is of the elements .*; allowed: the same in each component"):
        formats.read(path, "text/csv", mapping=json.dumps(mapping))


@given(
    st.lists(st.sampled_from(["t", "u0", "u1", "u2", "u10", "u", "", "t.1"]), max_size=8),
    st.lists(
        st.lists(st.sampled_from(["", "nan", "0", "1", "1e300", "-inf", "x", '"', "\x00"]), max_size=8), max_size=5
    ),
)
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_table_does_worse_than_be_refused(tmp_path: Path, names: list[str], rows: list[list[str]]) -> None:
    path = tmp_path / "any.csv"
    path.write_text("\n".join(",".join(cells) for cells in [names, *rows]))
    mapping = json.dumps({"time": "t", "displacement": "u*", "grid": [1, 1], "pitch": 1e-3})
    with contextlib.suppress(InvalidInput):
        assert np.isfinite(formats.read(path, "text/csv", mapping=mapping).displacement).all()


LONG: dict[str, Any] = {
    "element": "marker",
    "grid": [2, 3],
    "time": {"field": "t_ms", "unit": "ms"},
    "position": {"field": ["x_mm", "y_mm"], "unit": "mm"},
    "displacement": {"field": ["dx_mm", "dy_mm"], "unit": "mm"},
    "force": {"field": ["fx", "fy", "fz"], "unit": ["N", "N", "-N"]},
}


def long_table(path: Path, leave_out: int | None = None) -> tuple[Path, np.ndarray]:
    """A row a marker and frame, in any order, as a spreadsheet has it; and the numbers [t, marker, column]."""
    rng = np.random.default_rng(3)
    told = rng.uniform(0.01, 0.1, (4, 6, 7))
    told[..., 5:] = np.stack(np.meshgrid([0.0, 1.5], [0.0, 1.5, 3.0], indexing="ij"), axis=-1).reshape(6, 2)
    rows = [
        [10 + marker, fz, dy, 33 * frame, fx, fy, dx, x, y]
        for frame, markers in enumerate(told)
        for marker, (dx, dy, fx, fy, fz, x, y) in enumerate(markers)
    ]
    rng.shuffle(rows)
    lines = [";".join(map(repr, map(float, row))) for row in rows[leave_out:]]
    path.write_text("marker;fz;dy_mm;t_ms;fx;fy;dx_mm;x_mm;y_mm\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path, told


def test_a_table_with_a_row_for_each_marker_and_frame_is_read(tmp_path: Path) -> None:
    path, told = long_table(tmp_path / "log.csv")
    log = formats.read(path, mapping=json.dumps(LONG))
    np.testing.assert_allclose(log.time, [0.0, 0.033, 0.066, 0.099], rtol=1e-12)
    lattice = told.reshape(4, 2, 3, 7)
    np.testing.assert_allclose(log.displacement[..., :2], 1e-3 * lattice[..., :2], rtol=1e-12)
    assert not log.displacement[..., 2].any(), "along the normal nothing is told"
    np.testing.assert_allclose(log.force, lattice[..., 2:5] * [1.0, 1.0, -1.0], rtol=1e-12)
    np.testing.assert_allclose(log.position[..., :2], 1e-3 * lattice[0, ..., 5:], rtol=1e-12)
    assert log.contact is None, "forces tell it"


def test_markers_seen_from_above_without_forces_touch_where_they_move(tmp_path: Path) -> None:
    path, _ = long_table(tmp_path / "log.csv")
    mapping = {name: value for name, value in LONG.items() if name != "force"}
    log = formats.read(path, mapping=json.dumps(mapping))
    assert log.contact is not None
    np.testing.assert_array_equal(log.contact, contact_by_motion(log.time, log.displacement))
    assert log.metadata["contact"] == "estimated from motion"


def test_a_missing_row_or_column_of_a_long_table_is_refused_by_name(tmp_path: Path) -> None:
    path, _ = long_table(tmp_path / "log.csv", leave_out=1)
    row = "element is 23 rows of 4 times and 6 elements, none of element 10 at 0; allowed: a row for each"
    with pytest.raises(InvalidInput, match=row):
        formats.read(path, mapping=json.dumps(LONG))
    with pytest.raises(InvalidInput, match=r"element is without id; allowed: the columns marker, fz, "):
        formats.read(path, mapping=json.dumps(LONG | {"element": "id"}))


@pytest.mark.parametrize(
    ("told", "odd"),
    [
        ("0,0 0,1 1,0 1,1 0,1", "5 rows of 2 times and 2 elements, several of element 1 at 0;"),
        ("0,0 0,1 1,0 1,0", "4 rows of 2 times and 2 elements, several of element 0 at 1;"),
        ("0,0 0,1 1,1", "3 rows of 2 times and 2 elements, none of element 0 at 1;"),
        ("1,1 0,0 0,1", "3 rows of 2 times and 2 elements, none of element 0 at 1;"),
        ("0,0 0,1 1,0", "3 rows of 2 times and 2 elements, none of element 1 at 1;"),
        ("0,0 0,1 1,0 1,nan", "4 rows of 2 times and 3 elements, one without a number;"),
    ],
)
def test_a_row_too_many_or_too_few_is_named(tmp_path: Path, told: str, odd: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,e,x,y\n" + "".join(f"{row},0,0\n" for row in told.split()), encoding="utf-8")
    mapping = {"time": "t", "element": "e", "displacement": ["x", "y"], "grid": [1, 2], "pitch": 1e-3}
    with pytest.raises(InvalidInput, match=odd):
        formats.read(path, mapping=json.dumps(mapping))


def test_a_marker_that_is_said_to_be_lost_needs_no_displacement(tmp_path: Path) -> None:
    rows = [f"{frame},{marker},1e-5,{marker}e-6,1" for frame in range(3) for marker in range(4)]
    rows[5] = "1,1,,,0"
    path = tmp_path / "log.csv"
    path.write_text("t,e,x,y,seen\n" + "\n".join(rows), encoding="utf-8")
    mapping = {"time": "t", "element": "e", "displacement": ["x", "y"], "grid": [2, 2], "pitch": 1e-3}
    with pytest.raises(InvalidInput, match=r"displacement is nan at index \[1, 0, 1, 0\]"):
        formats.read(path, mapping=json.dumps(mapping))
    log = formats.read(path, mapping=json.dumps(mapping | {"observed": "seen"}))
    assert log.observed is not None
    assert np.argwhere(~log.observed).tolist() == [[1, 0, 1]]
    assert log.displacement[1, 0, 1].tolist() == [0.0, 0.0, 0.0]


def test_rows_of_a_frame_state_its_gripper_force_alike(tmp_path: Path) -> None:
    """That of the lowest element had been taken."""
    path, _ = long_table(tmp_path / "log.csv")
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    mapping = json.dumps(LONG | {"gripper_force": "grip"})

    def read(rise: float) -> GraspLog:
        stated = [f"{row};{3.0 + rise * (float(row.split(';')[0]) - 10.0)}" for row in rows]
        path.write_text("\n".join([f"{header};grip", *stated]), encoding="utf-8")
        return formats.read(path, mapping=mapping)

    np.testing.assert_array_equal(read(0.0).gripper_force, 3.0)
    with pytest.raises(InvalidInput, match=r"gripper_force is 3 and 3\.5 in rows of frame 0; allowed: one value in"):
        read(0.5)


def test_a_position_that_changes_is_refused(tmp_path: Path) -> None:
    """The first frame's had been taken."""
    path, _ = long_table(tmp_path / "log.csv")
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    last = max(range(len(rows)), key=lambda k: float(rows[k].split(";")[3]))
    rows[last] = ";".join([*rows[last].split(";")[:-1], "9.0"])
    path.write_text("\n".join([header, *rows]), encoding="utf-8")
    with pytest.raises(InvalidInput, match="position is other in frame 3 than in frame 0; allowed: one value of the"):
        formats.read(path, mapping=json.dumps(LONG))


def test_what_frames_state_alike_of_a_log_is_taken_once() -> None:
    stated = np.array([[1.0, np.nan]] * 3)
    np.testing.assert_array_equal(of_all_frames("element_area", stated), stated[0])
    stated[2, 1] = 2.0
    with pytest.raises(InvalidInput, match="element_area is other in frame 2 than in frame 0"):
        of_all_frames("element_area", stated)


def test_a_component_without_columns_is_named(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", columns(np.random.default_rng(1)))
    with pytest.raises(InvalidInput, match=r"force is not there \(P\*_FN\); allowed: the columns T_us, P\*_DX, P\*_DY"):
        read(path, force=["P*_FX", "P*_FY", "P*_FN"])


def test_the_lattice_that_is_missing_is_suggested(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", columns(np.random.default_rng(1)))
    mapping = {name: value for name, value in MAPPING.items() if name != "grid"}
    with pytest.raises(InvalidInput, match=r'`grid` in the mapping, such as "grid": \[3, 3\]'):
        formats.read(path, mapping=json.dumps(mapping))


def test_taxels_that_tell_forces_alone_make_a_log_without_displacement(tmp_path: Path) -> None:
    told = {name: column for name, column in columns(np.random.default_rng(3)).items() if "_D" not in name}
    mapping = {name: MAPPING[name] for name in ("grid", "pitch", "time", "force", "contact")}
    path = written(tmp_path / "taxels.csv", told)
    log = formats.read(path, "text/csv", mapping=json.dumps(mapping))
    assert not log.has_displacement
    assert not log.displacement.any()
    np.testing.assert_array_equal(log.force, field(told, "F") * [1.0, 1.0, -1.0])
    with pytest.raises(InvalidInput, match="displacement"):
        formats.read(path, "text/csv", mapping=json.dumps(MAPPING))


@pytest.mark.parametrize(("rest", "frame"), [("least contact", 2), (1, 1), ("first", 0)])
def test_displacement_is_from_the_frame_that_a_mapping_chooses(tmp_path: Path, rest: str | int, frame: int) -> None:
    told = columns(np.random.default_rng(1)) | {f"P{p}_isInContact": list("11011") for p in range(PILLARS)}
    path = written(tmp_path / "log.csv", told)
    log, plain = read(path, rest=rest), read(path)
    np.testing.assert_allclose(log.displacement, plain.displacement - plain.displacement[frame], rtol=0, atol=1e-18)
    assert log.metadata["rest"] == f"frame {frame}"
    given = formats.read(path, "text/csv", mapping=json.dumps(MAPPING), rest=str(rest))
    np.testing.assert_array_equal(given.displacement, log.displacement)


def test_places_of_markers_become_displacement_by_a_frame_at_rest(tmp_path: Path) -> None:
    path, told = long_table(tmp_path / "log.csv")
    mapping = {name: value for name, value in LONG.items() if name != "force"}
    place = {"field": ["x_mm", "y_mm"], "unit": "mm"}
    log = formats.read(path, mapping=json.dumps(mapping | {"position": place, "displacement": place, "rest": 1}))
    places = 1e-3 * told.reshape(4, 2, 3, 7)[..., 5:]
    np.testing.assert_allclose(log.position[..., :2], places[1], rtol=1e-12)
    np.testing.assert_allclose(log.displacement[..., :2], places - places[1], rtol=0, atol=1e-15)


def test_a_file_of_the_sensor_alone_tells_what_a_mapped_table_moves_from(tmp_path: Path) -> None:
    told = columns(np.random.default_rng(1))
    path, alone = (
        written(tmp_path / "log.csv", told),
        written(tmp_path / "alone.csv", columns(np.random.default_rng(2))),
    )
    log = formats.read(path, "text/csv", mapping=json.dumps(MAPPING), rest=alone)
    zero = np.median(read(alone).displacement, axis=0)
    np.testing.assert_allclose(log.displacement, read(path).displacement - zero, rtol=0, atol=1e-18)
    assert log.metadata["rest"] == "alone.csv"


def test_pressure_alone_is_refused_with_what_to_record(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,P0,P1,P2,P3\n0,1,1,1,1\n1,1,1,1,2\n", encoding="utf-8")
    mapping = {"grid": [2, 2], "pitch": 1e-3, "time": "t"}
    for name in ("force", "pressure"):
        with pytest.raises(InvalidInput, match=r"no tangential force.*neither slip nor friction.*Record"):
            formats.read(path, mapping=json.dumps(mapping | {name: "P*"}))
