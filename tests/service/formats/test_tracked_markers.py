import contextlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service import formats
from service.formats import tracked_markers
from slipcore import InvalidInput, UnknownScale, collect_samples, detect_slip

DOTS = Path(__file__).parent / "tracked_dots.csv"
Write = Callable[[str | bytes], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def make(content: str | bytes) -> Path:
        path = tmp_path / "dots.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return make


def table(*, head: str = "# scale: 1e-4\n", header: str = "time,marker,x,y", rows: list[str] | None = None) -> str:
    """Nine dots, 10 px apart, in three frames; the middle one moves by a pixel a frame."""
    return head + "\n".join([header, *(square() if rows is None else rows)]) + "\n"


def square(separator: str = ",") -> list[str]:
    return [
        separator.join([f"{0.1 * frame:.1f}", f"dot {i}{j}", f"{10 * i + frame * (i == j == 1)}", f"{10 * j}"])
        for frame in range(3)
        for i in range(3)
        for j in range(3)
    ]


def test_a_trackers_file_becomes_a_log_in_metres() -> None:
    log, content = formats.read(DOTS), DOTS.read_text(encoding="utf-8")
    assert (len(log), log.sensor, log.metadata["scale"]) == (31, "fingertip camera", "2.5e-05 m per pixel")
    assert log.grid == (6, 6)
    np.testing.assert_allclose(np.diff(log.time), 1 / 30, rtol=1e-9)
    assert log.time[0] == pytest.approx(117 / 30)
    assert log.observed is not None
    assert log.contact is not None
    assert 0.9 < log.observed.mean() < 1.0
    assert int(log.metadata["lost_places"]) == 31 * 36 - 1086 + content.count("nan") // 2 == 40
    assert log.metadata["columns_left_out"] == "mass"
    assert not log.contact[0].any()
    assert log.element_area == pytest.approx((1.5e-3) ** 2, rel=0.2)
    assert np.abs(log.displacement[..., :2]).max() < 1e-3
    history = detect_slip(log, "filter")
    assert history.observed is not None
    assert 0.0 < history.slip[-5:].sum() / history.contact[-5:].sum() < 1.0


@pytest.mark.parametrize("content_type", [None, "text/csv", "text/csv; charset=utf-8", "application/octet-stream"])
def test_a_table_of_markers_is_recognised(content_type: str | None) -> None:
    assert formats.identify(DOTS, content_type) == "tracked markers"


def test_places_and_motion_are_those_of_the_file(write: Write) -> None:
    log = formats.read(write(table()))
    np.testing.assert_allclose(log.position[:, 0, 0], [0.0, 1e-3, 2e-3], atol=1e-15)
    np.testing.assert_allclose(log.displacement[:, 1, 1, 0], [0.0, 1e-4, 2e-4], atol=1e-15)
    assert not log.displacement[:, 0].any()
    np.testing.assert_array_equal(log.time, [0.0, 0.1, 0.2])
    assert log.observed is not None
    assert log.observed.all()


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_columns_may_be_in_any_order_and_rows_too(write: Write, separator: str) -> None:
    rows = [separator.join(reversed(row.split(separator))) for row in square(separator)]
    shuffled = [rows[k] for k in np.random.default_rng(1).permutation(len(rows))]
    header = separator.join(["y", "X ", '"Track_ID"', "time"])
    one = formats.read(write("\ufeff" + table(header=header, rows=shuffled)))
    other = formats.read(write(table()))
    np.testing.assert_array_equal(one.displacement, other.displacement)


@pytest.mark.parametrize("lost", ["nan", "", "NaN", None])
def test_a_lost_marker_is_masked_and_never_invented(write: Write, lost: str | None) -> None:
    rows = square()
    middle = next(k for k, row in enumerate(rows) if row.startswith("0.1,dot 11"))
    if lost is None:
        del rows[middle]
    else:
        rows[middle] = f"0.1,dot 11,{lost},{lost}"
    log = formats.read(write(table(rows=rows)))
    assert log.observed is not None
    assert np.argwhere(~log.observed).tolist() == [[1, 1, 1]]
    assert log.metadata["lost_places"] == "1"
    np.testing.assert_array_equal(log.displacement[1, 1, 1], 0.0)  # as those around it, and marked as a placeholder
    assert np.isnan(detect_slip(log, "filter").velocity[1:, 1, 1]).all()


def test_a_marker_that_is_not_there_at_rest_is_left_out_and_told(write: Write) -> None:
    log = formats.read(write(table(rows=[*square(), "0.2,late,5,5"])))
    assert (log.metadata["markers"], log.metadata["markers_left_out"]) == ("9", "1 (not in the first frame)")


def test_without_height_and_contact_those_touch_that_move_more_than_around_them(write: Write) -> None:
    log = formats.read(write(table()))
    assert log.contact is not None
    assert np.argwhere(log.contact).tolist() == [[1, 1, 1], [2, 1, 1]], "the only dot that moves"
    assert log.metadata["contact"] == "estimated from motion"


def test_with_height_contact_is_left_to_the_shape(write: Write) -> None:
    rows = [f"{row},{-3.0 if row.startswith('0.2,dot 11') else 0.0}" for row in square()]
    log = formats.read(write(table(header="time,marker,x,y,z", rows=rows)))
    assert log.contact is None
    assert log.displacement[2, 1, 1, 2] == pytest.approx(-3e-4)


def test_contact_holds_while_it_is_not_told(write: Write) -> None:
    told = {"0.0": "1", "0.1": "", "0.2": "0"}
    rows = [f"{row},{told[row[:3]]}" for row in square()]
    log = formats.read(write(table(header="time,marker,x,y,contact", rows=rows)))
    assert log.contact is not None
    assert [bool(mask.all()) for mask in log.contact] == [True, True, False]


@pytest.mark.parametrize("rows", ["all", "one"], ids=["in each row", "in one row of a frame"])
def test_a_column_is_the_grippers_force(write: Write, rows: str) -> None:
    told = [f"{row},{'' if rows == 'one' and k % 9 else 1.5 * (k // 9)}" for k, row in enumerate(square())]
    head = "# scale: 1e-4\n# gripper_force_deviation: 0.2\n"
    log = formats.read(write(table(head=head, header="time,marker,x,y,gripper_force", rows=told)))
    assert (log.gripper_force_deviation, "columns_left_out" in log.metadata) == (0.2, False)
    np.testing.assert_array_equal(log.gripper_force, [0.0, 1.5, 3.0])


@pytest.mark.parametrize("again", ["scale", "Scale", " SCALE "])
def test_a_setting_that_stands_twice_is_refused(write: Write, again: str) -> None:
    """The first had counted."""
    with pytest.raises(InvalidInput, match="line 2, scale is a second time; allowed: each setting once"):
        formats.read(write(table(head=f"# scale: 2e-4\n#{again}: 1e-4\n")))


def test_an_unknown_scale_is_told_and_friction_refused(write: Write) -> None:
    log = formats.read(write(table(head="")))
    assert not log.is_scaled
    assert (log.metadata["scale"], log.metadata["assumed_scale"]) == ("unknown", "0.00075 m per pixel")
    history = detect_slip(log, "filter")
    with pytest.raises(UnknownScale, match="velocities in m/s"):
        collect_samples(log, history)


def test_slip_is_found_without_a_scale_much_as_with_one() -> None:
    known = detect_slip(formats.read(DOTS), "filter")
    text = DOTS.read_text(encoding="utf-8")
    assert "# scale" in text
    lines = text.replace("# scale", "# not scale").splitlines()
    log = tracked_markers.read_lines(iter(f"{line}\n" for line in lines))
    assert not log.is_scaled
    unknown = detect_slip(log, "filter")
    both, either = (known.slip & unknown.slip).sum(), (known.slip | unknown.slip).sum()
    assert both / either > 0.8


def test_a_scale_by_which_a_sensor_were_as_large_as_a_room_is_refused_by_name(write: Write) -> None:
    """It had been the place of a marker that was refused."""
    path = write(table())
    with pytest.raises(InvalidInput, match=r"^scale is 0\.5 m per pixel, by which markers lie up to .*is it in m\?"):
        formats.read(path, scale=0.5)


def test_what_is_given_goes_before_what_the_file_says(write: Write) -> None:
    path = write(table(header="frame,marker,x,y", rows=[f"{round(10 * float(r[:3]))}{r[3:]}" for r in square()]))
    with pytest.raises(
        InvalidInput, match=r"frame_rate is missing; allowed: .* the file counts frames \(--frame-rate 30"
    ):
        formats.read(path)
    log = formats.read(path, scale=5e-5, frame_rate=20.0)
    np.testing.assert_allclose(log.time, [0.0, 0.05, 0.1])
    assert log.metadata["scale"] == "5e-05 m per pixel"
    path.write_bytes(path.read_bytes().replace(b"# scale: 1e-4\n", b"# scale: 5e-05\n# frame_rate: 20.0\n"))
    np.testing.assert_array_equal(formats.read(path).displacement, log.displacement)


def test_a_scale_beside_another_format_is_refused(npz_log: Path) -> None:
    with pytest.raises(InvalidInput, match=r"scale is 0\.1 with npz; allowed: only beside a table of tracked markers"):
        formats.read(npz_log, scale=0.1)


@pytest.fixture
def npz_log(log: object, tmp_path: Path) -> Path:
    from stiction_client import container

    return container.write(log, tmp_path / "log.npz")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "file is without a header"),
        ("# scale: 1\n", "file is without a header"),
        ("time,x,y\n", "line 1 is a header without marker"),
        ("a,b\n1,2\n", "line 1 is a header without time or frame, marker, x, y"),
        ("time,marker,x,y\n", "file is a header without rows"),
        ("time,id,marker,x,y\n", "line 1 is two columns of marker"),
        (table(rows=[*square(), "0.3,a,1"]), r"line 30 is of 3 cells; allowed: 4"),
        (table(rows=[*square(), "0.3,a,1,x"]), r"line 30, y is 'x'; allowed: a finite number"),
        (table(rows=[*square(), "0.3,a,inf,1"]), r"line 30, x is 'inf'"),
        (table(rows=[*square(), "nan,a,1,1"]), r"line 30, time is 'nan'"),
        (table(rows=[*square(), "0.3,,1,1"]), r"line 30, marker is empty"),
        (table(rows=[*square(), "0.2,dot 11,1,1"]), r"line 30 is marker 'dot 11' again in one frame"),
        (table(head="# scale: big\n"), r"scale is 'big'; allowed: 1e-09 to 1 m per pixel"),
        (table(head="# scale: -1\n"), r"scale is '-1'"),
        (table(rows=square()[:9]), "time is 1 frame"),
        (table(rows=[row for row in square() if "dot 0" in row]), "markers is of shape"),
        (table(rows=["0.0,a,nan,nan", *square()[9:]]), "first frame is without any marker"),
        (table(header="time,marker,x,y,contact", rows=[f"{row},2" for row in square()]), "line 3, contact is '2'"),
        (
            table(header="time,marker,x,y,gripper_force", rows=[f"{row},{k // 12}" for k, row in enumerate(square())]),
            "line 15, gripper_force is 1 N; allowed: 0 N, as in the frame's other rows",
        ),
        (
            table(
                header="time,marker,x,y,gripper_force", rows=[f"{row},{'' if '0.1' in row else 1}" for row in square()]
            ),
            "gripper_force is missing in frame 1; allowed: a number of N in a row of each frame",
        ),
        (table(head="# scale: 1e-4\n# gripper_force_deviation: x\n"), "gripper_force_deviation is 'x'; allowed: 0 to"),
        (table(head="# scale: 1e-4\n# gripper_force_deviation: 1\n"), "given without gripper_force"),
        (table().encode() + b"\xff\xfe\n", "line 30 is not UTF-8"),
        (table() + '0.3,"' + "x" * 200_000 + '",1,1\n', "line 30 is not a row of text"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(write: Write, content: str | bytes, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        formats.read(write(content), "text/csv")


def test_a_small_file_cannot_claim_a_huge_log(write: Write) -> None:
    rows = [f"{k},{k},{k % 7},{k % 11}" for k in range(9000)]  # 9000 frames of 9000 markers would take 2 GB
    with pytest.raises(InvalidInput, match="9000 frames of 9000 markers"):
        formats.read(write(table(rows=rows)))


CELLS = st.one_of(
    st.sampled_from(["", "nan", "0", "1", "-1", "0.5", "1e300", "-inf", "1e-320", "x", '"', "#", "\x00", "0x1", "1_0"]),
    st.floats(allow_nan=True).map(str),
    st.text(max_size=4),
)


@given(
    st.lists(st.sampled_from(["time", "frame", "marker", "x", "y", "z", "contact", "mass", " X"]), max_size=7),
    st.lists(st.lists(CELLS, max_size=7), max_size=12),
    st.binary(max_size=20),
    st.sampled_from([b"", b"# scale: 1e-4\n", b"# frame_rate: 30\n# scale: x\n", b"\xef\xbb\xbf"]),
)
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_file_does_worse_than_be_refused(
    tmp_path: Path, columns: list[str], rows: list[list[str]], tail: bytes, head: bytes
) -> None:
    path = tmp_path / "any.csv"
    text = "\n".join([",".join(columns), *(",".join(row) for row in rows)])
    path.write_bytes(head + text.encode("utf-8", errors="replace") + tail)
    try:
        log = formats.read(path, "text/csv")
    except InvalidInput:
        return
    assert np.isfinite(log.displacement).all()


@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_file_is_read_or_refused(tmp_path: Path, seed: int, damages: int) -> None:
    generator = np.random.default_rng(seed)
    content = bytearray(b"".join(DOTS.read_bytes().splitlines(keepends=True)[:120]))
    for _ in range(damages):
        content[generator.integers(len(content))] = generator.integers(256)
    path = tmp_path / "damaged.csv"
    path.write_bytes(content)
    with contextlib.suppress(InvalidInput):
        assert len(formats.read(path, "text/csv")) > 1


def pressed(order: list[int]) -> list[str]:
    """A lattice of 9 × 9 dots, bulging sideways by frame as ``order`` tells, in 0.1 px at most a step."""
    along = np.arange(9.0) - 4.0
    x, y = np.meshgrid(along, along, indexing="ij")
    bulge = np.exp(-(x**2 + y**2) / 4.0) * (np.abs(x) < 4) * (np.abs(y) < 4)
    return [
        f"{k},{i}-{j},{10 * i + step * x[i, j] * bulge[i, j]},{10 * j + step * y[i, j] * bulge[i, j]}"
        for k, step in enumerate(order)
        for i in range(9)
        for j in range(9)
    ]


@pytest.mark.parametrize(("rest", "frame"), [("first", 0), ("least contact", 2), ("1", 1), (None, 0)])
def test_rest_is_the_frame_that_is_chosen(write: Write, rest: str | None, frame: int) -> None:
    path = write(table(rows=pressed([2, 1, 0, 3])))
    log = formats.read(path, rest=rest)
    assert not log.displacement[frame].any()
    assert log.metadata.get("rest") == (f"frame {frame}" if frame else None)
    np.testing.assert_allclose(np.abs(log.displacement).max(axis=(1, 2, 3)) > 0, np.arange(4) != frame, rtol=0)


def test_a_file_may_say_which_frame_is_at_rest_and_what_is_given_goes_before(write: Write) -> None:
    path = write(table(head="# scale: 1e-4\n# rest: least contact\n", rows=pressed([2, 1, 0, 3])))
    assert formats.read(path).metadata["rest"] == "frame 2"
    assert not formats.read(path, rest="3").displacement[3].any()


def test_the_frame_of_least_contact_is_that_of_the_fewest_dots_that_touch(write: Write) -> None:
    touching = {"0.0": "1", "0.1": "0", "0.2": "1"}
    rows = [f"{row},{touching[row[:3]]}" for row in square()]
    log = formats.read(write(table(header="time,marker,x,y,contact", rows=rows)), rest="least contact")
    assert log.metadata["rest"] == "frame 1"


def test_a_file_of_the_sensor_alone_tells_the_rest(write: Write, tmp_path: Path) -> None:
    alone = tmp_path / "alone.csv"
    alone.write_text(table(rows=pressed([0, 0])), encoding="utf-8")
    path = write(table(rows=pressed([2, 1, 3])))
    log, whole = formats.read(path, rest=alone), formats.read(write(table(rows=pressed([0, 2, 1, 3]))))
    np.testing.assert_allclose(log.displacement, whole.displacement[1:], rtol=0, atol=1e-15, err_msg="rounding")
    assert log.metadata["rest"] == "file of rest"
    alone.write_text(table(rows=["0.0,elsewhere,1,2"]), encoding="utf-8")
    with pytest.raises(InvalidInput, match="file of rest is without any marker of the log"):
        formats.read(path, rest=alone)


@pytest.mark.parametrize(
    ("rest", "message"),
    [("9", "rest is frame 9 of 3; allowed: 0 to 2"), ("last", "rest is 'last'; allowed: first, least contact, or"),
     ("-1", "rest is '-1'"), ("1" * 10, "rest is '1111111111'")],
)  # fmt: skip
def test_a_frame_that_there_is_not_is_refused(write: Write, rest: str, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        formats.read(write(table()), rest=rest)


def test_dots_on_no_lattice_tell_no_frame_of_least_contact(write: Write) -> None:
    dots = np.random.default_rng(1).uniform(0, 100, (60, 2))
    rows = [f"{t},{k},{x},{y}" for t in (0, 1) for k, (x, y) in enumerate(dots)]
    with pytest.raises(InvalidInput, match="least contact, of dots on no lattice without contact or force"):
        formats.read(write(table(rows=rows)), rest="least contact")


def test_forces_of_markers_are_kept(write: Write) -> None:
    rows = [f"{row},0.1,{0.01 * k},-1.5" for k, row in enumerate(square())]
    log = formats.read(write(table(header="time,marker,x,y,fx,force_y,fz", rows=rows)))
    assert log.force is not None
    np.testing.assert_allclose(log.force[..., 0], 0.1, rtol=1e-12)
    np.testing.assert_allclose(log.force[..., 1].ravel(), 0.01 * np.arange(27), rtol=1e-12)
    assert (log.contact, "columns_left_out" in log.metadata) == (None, False), "forces tell the contact"
    part = formats.read(write(table(header="time,marker,x,y,fx,mass,fz", rows=rows)))
    assert (part.force, part.metadata["columns_left_out"]) == (None, "fx, mass, fz"), "friction needs all three"


def test_the_force_of_a_lost_marker_is_as_it_was_told_last(write: Write) -> None:
    rows = [f"{row},0.1,0,{-1.0 - float(row[:3])}" for row in square() if not row.startswith("0.2,dot 11")]
    log = formats.read(write(table(header="time,marker,x,y,fx,fy,fz", rows=rows)))
    assert log.force is not None
    np.testing.assert_allclose(log.force[:, 1, 1, 2], [-1.0, -1.1, -1.1], rtol=1e-12)


def test_a_table_of_rows_and_columns_as_gelsights_trackers_write_it_is_read(write: Write) -> None:
    rows = [
        f"{t},{i},{j},{10 * i},{10 * j},{10 * i + t * (i == j == 1)},{10 * j}"
        for t in range(3)
        for i in range(3)
        for j in range(3)
    ]
    log = formats.read(write("frameno,row,col,Ox,Oy,Cx,Cy\n" + "\n".join(rows)), scale=1e-4, frame_rate=25.0)
    np.testing.assert_allclose(log.displacement[:, 1, 1, 0], [0.0, 1e-4, 2e-4], rtol=0, atol=1e-15)
    assert (log.grid, log.metadata["columns_left_out"]) == ((3, 3), "ox, oy")
