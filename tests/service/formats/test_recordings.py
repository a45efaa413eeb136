"""Recordings as their own libraries write them: MCAP, ROS bags, HDF5, Parquet and JSON."""

import json
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import lz4.frame
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, text_format
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Bag1
from rosbags.rosbag2 import StoragePlugin

from service import formats
from service.formats import mcap, parquet, protobuf, unpack
from service.formats.assemble import as_array
from slipcore import GraspLog, InvalidInput
from stiction_client import container


def assert_same(back: GraspLog, log: GraspLog, rtol: float = 4e-16) -> None:
    """Equal but for the rounding of a change of units."""
    for name in ("position", "displacement", "force", "object_pose", "normal", "gripper_force"):
        expected = getattr(log, name)
        if expected is None:
            assert getattr(back, name) is None, name
        else:
            np.testing.assert_allclose(getattr(back, name), expected, rtol=rtol, atol=0.0, err_msg=name)
    np.testing.assert_allclose(back.time, log.time, rtol=0.0, atol=1e-9)  # a stamp is a whole number of ns
    assert back.element_area == pytest.approx(log.element_area, rel=1e-12)


@pytest.mark.parametrize("compression", [None, Bag1.CompressionFormat.BZ2, Bag1.CompressionFormat.LZ4])
def test_a_rosbag1_is_read_by_its_mapping(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path, compression: Bag1.CompressionFormat | None
) -> None:
    path = write.bag1(robot_log, tmp_path / "grasp.bag", compression)
    back = formats.read(path, mapping=json.dumps(write.mapping))
    assert_same(back, robot_log)
    assert formats.identify(path) == "rosbag1"
    assert back.metadata["start_time"] == "1700000000000000000 / 1000000000 s"
    assert json.loads(back.metadata["mapping"]) == write.mapping


@pytest.mark.parametrize("plugin", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
@pytest.mark.parametrize("form", ["folder", "storage file", "zip"])
def test_a_rosbag2_is_read_as_folder_file_or_zip(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path, plugin: StoragePlugin, form: str
) -> None:
    path = write.bag2(robot_log, tmp_path / "grasp", plugin)
    storage = next(file for file in path.iterdir() if file.suffix in (".db3", ".mcap"))
    if form == "zip":
        with zipfile.ZipFile(tmp_path / "grasp.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            for file in path.iterdir():
                archive.write(file, f"grasp/{file.name}")
    chosen = {"folder": path, "storage file": storage, "zip": tmp_path / "grasp.zip"}[form]
    assert formats.identify(chosen) == ("mcap" if chosen.suffix == ".mcap" else "rosbag2")
    assert_same(formats.read(chosen, mapping=json.dumps(write.mapping)), robot_log)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_an_mcap_of_json_is_read_by_the_mapping_in_it(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path, compression: CompressionType
) -> None:
    mapping = json.dumps({"topic": "/tactile", "displacement": "displacement", "position": "rest"})
    path = write.json_mcap(robot_log, tmp_path / "log", mapping, compression=compression, chunk_size=2000)
    back = formats.read(path)
    assert_same(back, replace(robot_log, force=None, object_pose=None), rtol=0.0)
    assert back.metadata["element_area"] == "mean of the cells between the markers"
    unchunked = write.json_mcap(robot_log, tmp_path / "plain", mapping, use_chunking=False)
    assert_same(formats.read(unchunked), back, rtol=0.0)


PROTOBUF = {
    "topic": "/tactile", "grid": [3, 4], "pitch": 1e-3, "time": "stamp", "force": "markers.force",
    "displacement": ["markers.moved.x", "markers.moved.y", "markers.moved.z"],
}  # fmt: skip


def test_an_mcap_of_protocol_buffers_is_read(robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path) -> None:
    back = formats.read(write.protobuf_mcap(robot_log, tmp_path / "log"), mapping=json.dumps(PROTOBUF))
    assert back.force is not None
    np.testing.assert_allclose(back.force, robot_log.force, rtol=1e-7, atol=0.0)  # float32 in the message
    np.testing.assert_array_equal(back.displacement, robot_log.displacement)
    np.testing.assert_allclose(back.time, robot_log.time, rtol=0.0, atol=1e-9)
    for wrong, told in (("markers.nothing", "force is not there"), ("stamp.nothing", "force is not there")):
        with pytest.raises(InvalidInput, match=told):
            formats.read(tmp_path / "log", mapping=json.dumps(PROTOBUF | {"force": wrong}))


@pytest.mark.parametrize(
    ("definition", "content", "told"),
    [
        (b"\xff\xff\xff", b"", "definition of lab.Tactile is not readable"),
        (b"", b"", "definition of lab.Tactile is not readable"),
        (b"\n" * (2**20 + 1), b"", "is 1048577 bytes; allowed: at most 1048576"),
        (None, b"\xff\xff", r"/tactile is a message that does not fit its type \(DecodeError"),
    ],
    ids=["garbage", "nothing", "too large", "message"],
)
def test_damaged_protocol_buffers_are_refused_by_name(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path, definition: bytes | None, content: bytes, told: str
) -> None:
    sound = write.protobuf_mcap(robot_log, tmp_path / "sound")
    with sound.open("rb") as stream:
        (schema,) = make_reader(stream).get_summary().schemas.values()
    with (tmp_path / "log").open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        number = writer.register_schema("lab.Tactile", "protobuf", schema.data if definition is None else definition)
        writer.add_message(writer.register_channel("/tactile", "protobuf", number), 1, content, 1)
        writer.finish()
    with pytest.raises(InvalidInput, match=told):
        formats.read(tmp_path / "log", mapping=json.dumps(PROTOBUF))


def test_a_timestamp_that_is_none_is_refused_by_name(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path
) -> None:
    path = write.protobuf_mcap(robot_log, tmp_path / "log", use_chunking=False)
    path.write_bytes(path.read_bytes().replace(b"seconds", b"sec_nds"))
    with pytest.raises(InvalidInput, match=r"time is not there \(stamp of /tactile\)"):
        formats.read(path, mapping=json.dumps(PROTOBUF))


MAPS = """
name: "maps.proto" package: "lab" syntax: "proto3"
message_type {
  name: "Point"
  field { name: "x" number: 1 type: TYPE_DOUBLE label: LABEL_REPEATED }
}
message_type {
  name: "Tactile"
  nested_type {
    name: "FingersEntry" options { map_entry: true }
    field { name: "key" number: 1 type: TYPE_STRING label: LABEL_OPTIONAL }
    field { name: "value" number: 2 type: TYPE_MESSAGE type_name: ".lab.Point" label: LABEL_OPTIONAL }
  }
  nested_type {
    name: "CountsEntry" options { map_entry: true }
    field { name: "key" number: 1 type: TYPE_INT32 label: LABEL_OPTIONAL }
    field { name: "value" number: 2 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
  }
  field { name: "fingers" number: 1 type: TYPE_MESSAGE type_name: ".lab.Tactile.FingersEntry" label: LABEL_REPEATED }
  field { name: "counts" number: 2 type: TYPE_MESSAGE type_name: ".lab.Tactile.CountsEntry" label: LABEL_REPEATED }
}
"""


def test_a_map_of_protocol_buffers_is_one_of_names() -> None:
    types = descriptor_pb2.FileDescriptorSet()
    text_format.Parse(MAPS, types.file.add())
    pool = descriptor_pool.DescriptorPool()
    pool.Add(types.file[0])
    sent: Any = message_factory.GetMessageClass(pool.FindMessageTypeByName("lab.Tactile"))(counts={7: 2.0})
    sent.fingers["left"].x.append(0.5)
    message = protobuf.deserializer("lab.Tactile", types.SerializeToString())(sent.SerializeToString())
    assert message["fingers"]["left"]["x"] == [0.5]
    assert message["counts"] == {"7": 2.0}
    with pytest.raises(InvalidInput, match="fingers is not an array"):
        as_array("fingers", message["fingers"])


def test_the_uploads_mapping_goes_before_the_files(robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path) -> None:
    path = write.json_mcap(robot_log, tmp_path / "log", json.dumps({"topic": "/nothing", "displacement": "x"}))
    given = json.dumps({"topic": "/tactile", "displacement": "displacement", "pitch": 2e-3})
    back = formats.read(path, mapping=given)
    np.testing.assert_allclose(back.position[1, 0] - back.position[0, 0], [2e-3, 0.0, 0.0], rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(back.position.mean(axis=(0, 1)), 0.0, atol=1e-18)
    with pytest.raises(
        InvalidInput, match=r"displacement is not there \(x of /nothing\); allowed: the topics /tactile"
    ):
        formats.read(path)


def test_hdf5_is_read_by_the_members_own_names(log: GraspLog, write: SimpleNamespace, tmp_path: Path) -> None:
    back = formats.read(write.hdf5(log, tmp_path / "log"))
    assert_same(back, log, rtol=0.0)
    np.testing.assert_array_equal(back.time, log.time)
    assert back.sensor == log.sensor
    assert back.gripper_force_deviation == log.gripper_force_deviation


def test_hdf5_is_read_by_a_mapping_of_paths_and_attributes(log: GraspLog, tmp_path: Path) -> None:
    mapping = {
        "time": {"field": "clock", "unit": "ms"},
        "displacement": {"field": "finger/markers", "unit": "mm"},
        "position": {"field": "finger/rest", "unit": "mm"},
        "element_area": {"field": "finger@area", "unit": "mm²"},
        "gripper_force": {"field": "gripper/effort", "unit": "mN"},
        "gripper_force_deviation": {"value": 50.0, "unit": "mN"},
    }
    with h5py.File(tmp_path / "log", "w") as file:
        file["clock"] = 1e3 * log.time
        file["finger/markers"] = 1e3 * log.displacement
        file["finger/rest"] = 1e3 * log.position
        file["gripper/effort"] = 1e3 * np.asarray(log.gripper_force)
        file["finger"].attrs["area"] = 1e6 * log.element_area
        file.attrs["stiction_mapping"] = json.dumps(mapping)
    back = formats.read(tmp_path / "log")
    assert_same(back, replace(log, force=None, normal=None, object_pose=None, truth=None))
    assert back.gripper_force_deviation == pytest.approx(0.05, rel=1e-12)


def test_a_grippers_force_is_that_of_the_nearest_message(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path
) -> None:
    path = write.bag1(robot_log, tmp_path / "grasp.bag")
    gripper = {"gripper_force": {"topic": "/object", "field": "x", "unit": "N"}}
    back = formats.read(path, mapping=json.dumps(write.mapping | gripper))
    assert robot_log.object_pose is not None
    np.testing.assert_array_equal(back.gripper_force, robot_log.object_pose[:, 0])


def test_an_episode_of_a_lerobot_dataset_is_read(log: GraspLog, write: SimpleNamespace, tmp_path: Path) -> None:
    path = write.lerobot(log, tmp_path / "file-000.parquet")
    mapping = {"episode": 1, "position": {"value": log.position.tolist()}, "element_area": {"value": 1e-6}}
    back = formats.read(path, mapping=json.dumps(mapping))
    np.testing.assert_array_equal(back.force, -np.asarray(log.force))
    np.testing.assert_array_equal(back.time, log.time.astype(np.float32))
    with pytest.raises(InvalidInput, match="episode is missing; allowed: one of 0, 1"):
        formats.read(path)


def test_an_episode_that_is_no_number_is_refused_by_name(
    robot_log: GraspLog, tmp_path: Path, write: SimpleNamespace
) -> None:
    path = write.lerobot(robot_log, tmp_path / "file-000.parquet")
    table = pq.read_table(path)
    lists = pa.array([[number, number] for number in table["episode_index"].to_pylist()])
    pq.write_table(table.set_column(table.column_names.index("episode_index"), "episode_index", lists), path)
    with pytest.raises(InvalidInput, match="episode is a column episode_index of lists; allowed: one number a row"):
        formats.read(path, mapping=json.dumps({"episode": 1}))


@pytest.mark.parametrize("by", ["columns", "frames"])
def test_json_is_read_as_columns_or_as_frames(log: GraspLog, write: SimpleNamespace, tmp_path: Path, by: str) -> None:
    path = write.json(log, tmp_path / "log.json")
    if by == "frames":
        columns = json.loads(path.read_text())
        named = ("time", "displacement", "force", "object_pose", "gripper_force")
        frames = [{name: columns[name][k] for name in named} for k in range(len(log))]
        path.write_text(json.dumps({"frames": frames, "position": columns["position"], "sensor": "left"}))
    back = formats.read(path)
    assert_same(back, replace(log, normal=None), rtol=0.0)
    assert back.sensor == "left"


@pytest.mark.parametrize("member", ["force", "gripper_force", "contact"])
@pytest.mark.parametrize("is_null", [True, False])
def test_json_with_a_member_in_some_frames_alone_is_refused_by_name(
    log: GraspLog, write: SimpleNamespace, tmp_path: Path, member: str, is_null: bool
) -> None:
    """Without it in all of them, friction might come from what was not measured."""
    columns = json.loads(write.json(log, tmp_path / "log.json").read_text())
    columns["contact"] = np.ones(log.displacement.shape[:3], bool).tolist()
    frames = [{name: columns[name][k] for name in ("time", "displacement", member)} for k in range(len(log))]
    if is_null:
        frames[1][member] = None
    else:
        del frames[1][member]
    path = tmp_path / "frames.json"
    path.write_text(json.dumps({"frames": frames, "position": columns["position"], "element_area": 1e-6}))
    with pytest.raises(InvalidInput, match=f"{member} is in 4 of 5 frames; allowed: in each of them, or in none"):
        formats.read(path)


def test_json_frames_may_lack_what_the_object_has(log: GraspLog, write: SimpleNamespace, tmp_path: Path) -> None:
    path = write.json(log, tmp_path / "log.json")
    columns = json.loads(path.read_text())
    frames = [{name: columns[name][k] for name in ("time", "displacement")} for k in range(len(log))]
    path.write_text(json.dumps({**columns, "frames": frames, "time": columns["time"]}))
    with pytest.raises(InvalidInput, match="time is in the object and in its frames; allowed: in one of the two"):
        formats.read(path)
    del columns["time"], columns["displacement"]
    path.write_text(json.dumps({**columns, "frames": frames}))
    assert_same(formats.read(path), replace(log, normal=None), rtol=0.0)


def same_bytes(log: GraspLog) -> bytes:
    return container.encode(log)


@pytest.mark.parametrize("writer", [mcap, parquet])
@pytest.mark.parametrize("kept", ["everything", "what is required", "masks"])
def test_what_is_written_is_read_back_bit_for_bit(log: GraspLog, tmp_path: Path, writer: Any, kept: str) -> None:
    masks = np.random.default_rng(1).random((2, 5, 3, 4)) < 0.5
    chosen = {
        "everything": log,
        "what is required": GraspLog(log.time, log.position, log.displacement, log.element_area),
        "masks": replace(log, contact=masks[0], observed=masks[1], truth=None),
    }[kept]
    writer.write(chosen, tmp_path / "log")
    assert same_bytes(formats.read(tmp_path / "log")) == same_bytes(chosen)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time": "clock"}, r"time is not there \(clock of /tactile\); allowed: the topics /object, /tactile"),
        ({"grid": [4, 4]}, r"displacement is of shape \[5, 36\]; allowed: \[5, 4, 4, 3\] or as many numbers"),
        ({"displacement": "displacement"}, "displacement is .* at its largest; allowed: .*is it in m"),
        ({"object_pose": {"topic": "/object", "field": ["x", "y"]}}, r"object_pose is of shape \[5, 2\]"),
        ({"object_pose": {"topic": "/object", "field": "x"}, "tolerance": 1e-3}, "object_pose is 0.003 s away from fr"),
        ({"force": "header.frame_id"}, "force is of dtype <U6; allowed: an array of real numbers"),
        ({"element_area": {"value": 1.0}}, "element_area is 1 m²"),
        ({"position": {"topic": "/nowhere", "field": "data"}}, r"position is not there \(data of /nowhere\)"),
        ({"contact": {"field": "force"}}, "contact is of dtype float64; allowed: truth values"),
        ({"gripper_force": "force"}, r"gripper_force is of shape \[5, 36\]; allowed: shape \[5\]"),
        ({"gripper_force_deviation": {"value": 0.1}}, "gripper_force_deviation is given without gripper_force"),
    ],
)
def test_a_mapping_that_does_not_fit_is_refused_by_name(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    path = write.bag1(robot_log, tmp_path / "grasp.bag")
    with pytest.raises(InvalidInput, match=message):
        formats.read(path, mapping=json.dumps(write.mapping | change))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[]", "mapping is .*; allowed: a JSON object"),
        ("{", "mapping is not JSON"),
        ('{"forces": "f"}', "mapping is of the unknown 'forces'; allowed: time, position"),
        ('{"force": {"unit": "N"}}', "mapping of force is .*; allowed: a field"),
        ('{"force": {"field": "f", "unit": "kg"}}', "unit of force is 'kg'; allowed: N, mN"),
        ('{"object_pose": {"field": "p", "unit": "mm"}}', "unit of object_pose"),
        ('{"force": 3}', "mapping of force is 3; allowed: a text"),
        ('{"grid": [3]}', r"grid is \[3\]; allowed: two whole numbers"),
        ('{"pitch": -1}', "pitch is -1; allowed: a number above 0"),
        ('{"episode": 1.5}', "episode is 1.5; allowed: a whole number"),
        ('{"topic": ""}', "topic is ''; allowed"),
        ('{"sensor": {"value": "' + "x" * 70_000 + '"}}', "mapping is .* characters; allowed: at most 65536"),
        ("[" * 100_000, "mapping is"),
    ],
)
def test_a_mapping_that_is_none_is_refused_by_name(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path, text: str, message: str
) -> None:
    path = write.json_mcap(robot_log, tmp_path / "log")
    with pytest.raises(InvalidInput, match=message):
        formats.read(path, mapping=text)


def test_settings_of_another_format_are_refused(log: GraspLog, tmp_path: Path) -> None:
    path = container.write(log, tmp_path / "log.npz")
    with pytest.raises(InvalidInput, match=r"mapping is .* with npz; allowed: only beside a format of topics"):
        formats.read(path, mapping="{}")
    with pytest.raises(InvalidInput, match="scale is 1 with npz"):
        formats.read(path, scale=1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda log: {"time": log.time[::-1].tolist()}, "time is 0.1 s at frame 1, after 0.2 s"),
        (lambda log: {"displacement": [None, *log.displacement.tolist()[1:]]}, "displacement is not an array"),
        (lambda log: {"displacement": log.displacement.tolist()[1:]}, r"displacement is of shape \[4, 3, 4, 3\]"),
        (lambda log: {"force": np.full(log.displacement.shape, np.nan).tolist()}, r"force is nan at index \[0, 0, 0"),
        (lambda _: {"time": [1e400, 2, 3, 4, 5]}, "time is inf at index"),
        (lambda _: {"displacement": "text"}, "displacement is of dtype"),
        (lambda _: {"position": []}, r"position is of shape \[0\]"),
        (lambda _: {"sensor": 4}, "sensor is"),
    ],
    ids=["unsorted time", "a missing frame", "a frame too few", "NaN", "infinity", "text", "nothing", "a number"],
)  # fmt: skip
def test_what_cannot_be_a_log_is_refused_whatever_the_format(
    log: GraspLog, write: SimpleNamespace, tmp_path: Path, change: Any, message: str
) -> None:
    path = write.json(log, tmp_path / "log.json")
    path.write_text(json.dumps(json.loads(path.read_text()) | change(log)))
    with pytest.raises(InvalidInput, match=message):
        formats.read(path)


def test_a_missing_library_is_answered_with_the_extra_that_brings_it(
    log: GraspLog, write: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write.hdf5(log, tmp_path / "log")
    monkeypatch.delitem(__import__("sys").modules, "service.formats.hdf5", raising=False)
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(
        formats.UnsupportedFormat,
        match=r"library of hdf5 is h5py, .*; allowed: the extra `formats`",
    ):
        formats.read(path)


def test_a_message_type_cannot_smuggle_code_in(tmp_path: Path) -> None:
    """The library that decodes messages executes code made of the types' names."""
    path = tmp_path / "log"
    for name in ('a/msg/B:\n  x = print("run")', 'a/msg/B"""\nimport os', "../x", "a/msg/B; y"):
        with path.open("wb") as stream:
            writer = McapWriter(stream)
            writer.start(profile="ros2")
            schema = writer.register_schema(name, "ros2msg", b"float64[] displacement")
            channel = writer.register_channel("/stiction/frame", "cdr", schema)
            writer.add_message(channel, 0, b"\0\1\0\0\0\0\0\0", 0)
            writer.finish()
        with pytest.raises(InvalidInput, match="message type is"):
            formats.read(path)


@pytest.mark.parametrize(
    ("definition", "message"),
    [
        (b"float64[999999999999] displacement", "arrays of at most"),
        (b"nothing", "definition of a/msg/B is not readable"),
        (b"a/B displacement", "/stiction/frame is a message that does not fit|definition of a/msg/B"),
        (b"float64[] displacement", "/stiction/frame is a message that does not fit its type"),
    ],
)
def test_a_message_definition_that_lies_is_refused(tmp_path: Path, definition: bytes, message: str) -> None:
    path = tmp_path / "log"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="ros2")
        schema = writer.register_schema("a/msg/B", "ros2msg", definition)
        channel = writer.register_channel("/stiction/frame", "cdr", schema)
        writer.add_message(channel, 0, b"\0\1\0\0\xff\xff\xff\x0f\0\0\0\0", 0)
        writer.finish()
    with pytest.raises(InvalidInput, match=message):
        formats.read(path)


def test_a_chunk_that_unpacks_to_more_than_it_says_is_refused() -> None:
    bomb = lz4.frame.compress(bytes(50_000_000))
    with pytest.raises(InvalidInput, match="chunk is 1001 bytes or more; allowed: at most 1000 bytes unpacked"):
        unpack.Unpacker().unpack(bomb, "lz4", 1000)
    with pytest.raises(InvalidInput, match=r"chunk is .* bytes by its header"):
        unpack.Unpacker().unpack(b"", "zstd", 2**40)


def test_many_chunks_that_unpack_to_too_much_together_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unpack, "MAX_UNPACKED_BYTES", 2500)
    unpacker = unpack.Unpacker()
    chunk = lz4.frame.compress(bytes(1000))
    for _ in range(2):
        unpacker.unpack(chunk, "lz4", 1000)
    with pytest.raises(InvalidInput, match="2500 in all"):
        unpacker.unpack(chunk, "lz4", 1000)


@pytest.mark.parametrize("kind", ["external link", "soft link", "external storage", "virtual", "huge", "huge chunks"])
def test_hdf5_that_points_elsewhere_or_claims_too_much_is_refused(log: GraspLog, tmp_path: Path, kind: str) -> None:
    secret = tmp_path / "secret"
    with h5py.File(secret, "w") as file:
        file["time"] = log.time
    with h5py.File(tmp_path / "log", "w") as file:
        file["displacement"] = log.displacement
        if kind == "external link":
            file["time"] = h5py.ExternalLink(str(secret), "/time")
        elif kind == "soft link":
            file["time"] = h5py.SoftLink("/displacement")
        elif kind == "external storage":
            file.create_dataset("time", (5,), "f8", external=[(str(secret), 0, 40)])
        elif kind == "virtual":
            layout = h5py.VirtualLayout((5,), "f8")
            layout[:] = h5py.VirtualSource(str(secret), "time", (5,))
            file.create_virtual_dataset("time", layout)
        elif kind == "huge":
            file.create_dataset("time", (10**9,), "f8", chunks=(1000,))
        else:
            file.create_dataset("time", (5,), "f8", maxshape=(None,), chunks=(2**24,))
    with pytest.raises(InvalidInput, match=r"time is .*; allowed: (a dataset in this file|at most)"):
        formats.read(tmp_path / "log")


def test_a_table_of_uneven_rows_is_refused_by_row(log: GraspLog, tmp_path: Path) -> None:
    rows = log.displacement.reshape(5, -1).tolist()
    rows[3] = rows[3][:-1]
    pq.write_table(pa.table({"time": log.time, "displacement": pa.array(rows)}), tmp_path / "log")
    with pytest.raises(InvalidInput, match="displacement is a list of another length at row 3"):
        formats.read(tmp_path / "log")


@pytest.mark.parametrize(
    ("name", "column", "message"),
    [
        ("displacement", [None, *[[0.0] * 3] * 4], "displacement is null in the rows from 0 on; allowed: a list in"),
        ("displacement", [b"x"] * 5, "displacement is of type binary; allowed: numbers, truth values or moments"),
        ("displacement", ["x"] * 5, "displacement is of dtype <U1; allowed: an array of real numbers"),
        ("time", ["now"] * 5, r"time is <U3 of shape \[5\]; allowed: one number a frame"),
        ("episode_index", [[0]] * 5, "episode is a column episode_index of lists; allowed: one number a row"),
    ],
)
def test_a_column_of_something_else_is_refused_by_name(
    log: GraspLog, tmp_path: Path, name: str, column: list[Any], message: str
) -> None:
    table = {"time": log.time, "displacement": log.displacement.reshape(5, -1).tolist()}
    pq.write_table(pa.table(table | {name: pa.array(column)}), tmp_path / "log")
    with pytest.raises(InvalidInput, match=message):
        formats.read(tmp_path / "log")


def test_a_column_that_stands_twice_is_named(log: GraspLog, tmp_path: Path) -> None:
    rows = pa.array(log.displacement.reshape(5, -1).tolist())
    columns, names = [pa.array(log.time), rows, rows], ["time", "displacement", "displacement"]
    pq.write_table(pa.Table.from_arrays(columns, names=names), tmp_path / "log")
    with pytest.raises(InvalidInput, match="displacement is column displacement, which stands 2 times; allowed: each"):
        formats.read(tmp_path / "log")


@pytest.mark.parametrize(
    ("notes", "mapping", "message"),
    [
        ("{", None, "stiction_log is not JSON .*; allowed: a JSON object"),
        ("[]", None, r"stiction_log is JSON of a list; allowed: a JSON object"),
        ("{}", '{"episode": 1}', "episode is 1; allowed: a table with a column episode_index"),
        ("{}", None, "time is without rows; allowed: at least 2 frames"),
    ],
)
def test_a_table_that_is_no_log_is_refused(tmp_path: Path, notes: str, mapping: str | None, message: str) -> None:
    empty = {"time": pa.array([], pa.float64()), "displacement": pa.array([], pa.list_(pa.float64()))}
    pq.write_table(pa.table(empty, metadata={parquet.LOG_KEY: notes}), tmp_path / "log")
    with pytest.raises(InvalidInput, match=message):
        formats.read(tmp_path / "log", mapping=mapping)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("a group", r"time is a group \(time\); allowed: a dataset"),
        ("packed", "time is packed by filter 6; allowed: gzip, lzf, shuffle, fletcher32"),
        ("text", "time is of dtype .*; allowed: numbers, truth values or one text"),
        ("nothing", "time is not there.* the file has the datasets and groups displacement"),
        ("long", "sensor is 70.* bytes; allowed: at most 65536"),
    ],
)
def test_hdf5_of_something_else_is_refused_by_name(log: GraspLog, tmp_path: Path, kind: str, message: str) -> None:
    with h5py.File(tmp_path / "log", "w", libver="latest") as file:
        file["displacement"] = log.displacement
        if kind == "a group":
            file.create_group("time")
        elif kind == "packed":
            file.create_dataset("time", data=np.arange(5), scaleoffset=0)
        elif kind == "text":
            file["time"] = ["now"] * 5
        elif kind == "long":
            file["time"], file["position"] = log.time, log.position
            file.attrs["sensor"] = np.full(70_000, b"x")
    with pytest.raises(InvalidInput, match=message):
        formats.read(tmp_path / "log")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[1]", "file is JSON of a list; allowed: a JSON object"),
        ('{"time": [0]}', "the file has the keys time"),
        ('{"time": [0], "time": [1]}', "file is with the key 'time' more than once"),
        ('{"frames": [{"force": 1, "force": 2}]}', "file is with the key 'force' more than once"),
        ('{"mapping": {"pitch": 1, "pitch": 2}}', "file is with the key 'pitch' more than once"),
    ],
)
def test_json_of_something_else_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "log.json").write_text(text)
    with pytest.raises(InvalidInput, match=message):
        formats.read(tmp_path / "log.json", formats.FORMATS["json"].content_type)


@pytest.mark.parametrize(
    ("messages", "mapping", "told"),
    [
        ([{"d": [0.0] * 12}, {}], {}, "displacement is in 1 of 2 messages of /tactile; allowed: d in each of them"),
        (
            [{"d": [0.0] * 12}, {"d": [0.0] * 9}],
            {},
            r"displacement is float64 of shape \[9\] at frame 1; allowed: float64 of shape \[12\], as at frame 0",
        ),
        ([{}], {"topic": None}, "mapping of displacement is d of no topic; allowed: a field with the topic it is in"),
    ],
)
def test_messages_that_make_no_column_are_refused_by_name(
    tmp_path: Path, messages: list[dict[str, Any]], mapping: dict[str, Any], told: str
) -> None:
    with (tmp_path / "log").open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        channel = writer.register_channel("/tactile", "json", writer.register_schema("tactile", "jsonschema", b"{}"))
        for received, message in enumerate(messages):
            writer.add_message(channel, received, json.dumps(message).encode(), received)
        writer.finish()
    wanted = {name: value for name, value in ({"topic": "/tactile"} | mapping).items() if value is not None}
    with pytest.raises(InvalidInput, match=told):
        formats.read(tmp_path / "log", mapping=json.dumps({"displacement": "d", "grid": [2, 2], **wanted}))


def test_messages_that_never_come_are_told_with_the_frame(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path
) -> None:
    path = write.bag1(replace(robot_log, time=np.array([0.0, 0.03, 0.07, 0.1, 9.0])), tmp_path / "grasp.bag")
    mapping = write.mapping | {"force": {"topic": "/tactile/rest", "field": "data"}}
    with pytest.raises(InvalidInput, match=r"force is 9.002 s away from frame 4 in /tactile/rest; allowed: a mess"):
        formats.read(path, mapping=json.dumps(mapping))


def test_any_cut_of_a_recording_is_refused_by_name(robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path) -> None:
    mapping = json.dumps(write.mapping)
    bag2 = write.bag2(robot_log, tmp_path / "bag2")
    whole = [
        (write.bag1(robot_log, tmp_path / "bag1"), mapping),
        (next(bag2.glob("*.db3")), mapping),
        (write.json_mcap(robot_log, tmp_path / "mcap", "{}"), None),
        (write.protobuf_mcap(robot_log, tmp_path / "protobuf"), json.dumps(PROTOBUF)),
        (write.hdf5(robot_log_with_normals(robot_log), tmp_path / "hdf5"), None),
        (write.lerobot(robot_log, tmp_path / "lerobot"), None),
        (write.json(robot_log, tmp_path / "json"), None),
    ]
    cut = tmp_path / "cut"
    for path, given in whole:
        content = path.read_bytes()
        for part in (0.02, 0.3, 0.7, 0.99):
            cut.write_bytes(content[: int(part * len(content))])
            with pytest.raises(InvalidInput) as refused:
                formats.read(cut, mapping=given)
            assert str(tmp_path) not in str(refused.value), "the place of a file on the server"


def robot_log_with_normals(log: GraspLog) -> GraspLog:
    normal = np.zeros_like(log.displacement)
    normal[..., 2] = 1.0
    return replace(log, normal=normal, gripper_force=np.ones(len(log)), gripper_force_deviation=0.1)


def test_a_message_of_an_impossible_time_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "log").open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        channel = writer.register_channel("/stiction/frame", "json", writer.register_schema("a", "jsonschema", b"{}"))
        writer.add_message(channel, 2**64 - 1, b"{}", 0)
        writer.finish()
    with pytest.raises(InvalidInput, match="/stiction/frame is of a message received at 18446744073709551615 ns"):
        formats.read(tmp_path / "log")
