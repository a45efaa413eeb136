import io
import json
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, text_format, timestamp_pb2
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Bag1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from slipcore import FrictionLaw, GraspLog, GroundTruth

RECORDINGS = Path(__file__).parents[3] / ".cache/tac3d/PyTac3D/example_data"


def npy(array: object) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.asarray(array), allow_pickle=True)
    return buffer.getvalue()


@pytest.fixture
def as_npy() -> Callable[[object], bytes]:
    return npy


@pytest.fixture
def zip_of(tmp_path: Path) -> Callable[..., Path]:
    """Write members (arrays or raw bytes) into a zip and return its path."""

    def make(members: Mapping[str, object], compression: int = zipfile.ZIP_STORED) -> Path:
        path = tmp_path / "log.zip"
        with zipfile.ZipFile(path, "w", compression) as archive:
            for name, value in members.items():
                archive.writestr(name, value if isinstance(value, bytes) else npy(value))
        return path

    return make


@pytest.fixture
def log() -> GraspLog:
    """A small log with every optional part and a ground truth."""
    generator = np.random.default_rng(3)
    frames, n, m = 5, 3, 4
    x, y = np.meshgrid(np.arange(n) * 1e-3, np.arange(m) * 1e-3, indexing="ij")
    shape = (frames, n, m)
    normal = np.zeros((*shape, 3))
    normal[..., 2] = 1.0
    truth = GroundTruth(
        contact=np.ones(shape, bool),
        slip_kinematic=generator.random(shape) < 0.5,
        slip_contact_factor=generator.random(shape) < 0.5,
        stick_ratio=np.array([np.nan, 1.0, 0.5, 0.25, 0.0]),
        friction=FrictionLaw((0.4, 0.1, -0.2), 0.03),
    )
    return GraspLog(
        time=np.array([0.0, 0.03, 0.07, 0.1, 0.2]),
        position=np.stack([x, y, np.zeros_like(x)], axis=-1),
        displacement=generator.normal(scale=1e-4, size=(*shape, 3)),
        element_area=1e-6,
        force=generator.normal(scale=0.1, size=(*shape, 3)),
        normal=normal,
        object_pose=generator.normal(scale=1e-3, size=(frames, 3)),
        gripper_force=np.array([0.0, 1.0, 2.5, 4.0, 4.0]),
        gripper_force_deviation=0.05,
        sensor="Prüfstand 1",
        metadata={"operator": "Łukasz", "tier": "closed form"},
        truth=truth,
    )


@pytest.fixture
def recording_fields() -> dict[str, np.ndarray]:
    """A synthetic Tac3D recording in its own units: mm, N, one .npy a field; only frames 3 and 4 are in contact."""
    generator = np.random.default_rng(5)
    frames, side = 6, 4
    y, x = np.meshgrid(-np.arange(side, dtype=float), -np.arange(side, dtype=float), indexing="ij")
    rest = np.stack([x, y, 10.0 - 0.05 * (x**2 + y**2)], axis=-1).reshape(-1, 3)
    displacement = generator.normal(scale=0.1, size=(frames, side * side, 3))
    gated = [0, 1, 2, 5]
    displacement[gated] = 0.0
    force = generator.normal(scale=0.05, size=displacement.shape)
    force[gated] = 0.0
    noise = np.zeros_like(displacement)
    noise[gated] = generator.normal(scale=0.02, size=noise[gated].shape)
    normal = np.zeros_like(displacement)
    normal[..., 2] = 1.0
    return {
        "3D_Positions": rest + displacement + noise,
        "3D_Displacements": displacement,
        "3D_Forces": force,
        "3D_Normals": normal,
        "index": np.array([7, 8, 9, 12, 13, 20]),
        "sendTimestamp": np.array([68.0, 68.03, 68.06, 68.2, 68.23, 68.5]),
    }


@pytest.fixture
def folder_of(tmp_path: Path) -> Callable[[Mapping[str, np.ndarray]], Path]:
    """Write a recording's fields as its sensor's software does."""

    def make(fields: Mapping[str, np.ndarray]) -> Path:
        folder = tmp_path / "AD2-0065L"
        folder.mkdir()
        for name, array in fields.items():
            np.save(folder / f"{name}.npy", array)
        return folder

    return make


@pytest.fixture(params=["example_1/AD2-0065L", "example_2/HDL1-GWH0021", "example_2/HDL1-GWH0022"])
def recording(request: pytest.FixtureRequest) -> Path:
    folder = RECORDINGS / request.param
    if not folder.is_dir():
        pytest.skip("the Tac3D example recordings are not in .cache (make recordings)")
    return folder


TACTILE = "std_msgs/Header header\nfloat64[] displacement\nfloat64[] force\n"
ROBOT_MAPPING = {
    "topic": "/tactile",
    "grid": [3, 4],
    "time": "header.stamp",
    "displacement": {"field": "displacement", "unit": "mm"},
    "force": "force",
    "position": {"topic": "/tactile/rest", "field": "data", "unit": "mm"},
    "object_pose": {"topic": "/object", "field": ["x", "y", "theta"]},
    "element_area": {"value": 1.0, "unit": "mm²"},
}
"""What leads from a robot's topics, as ``robot_messages`` makes them, to ``robot_log``."""

START = 1_700_000_000_000_000_000
"""ns since 1970 of the first frame."""


@pytest.fixture
def robot_log(log: GraspLog) -> GraspLog:
    """What a robot's recording of ``log`` is read as: without names and truth, its time from 0."""
    return GraspLog(log.time, log.position, log.displacement, 1e-6, force=log.force, object_pose=log.object_pose)


def robot_messages(log: GraspLog, store: Typestore) -> Iterator[tuple[str, str, int, object]]:
    """Topic, type, time of receipt and message of a robot that publishes a grasp in three topics, in mm."""
    types = store.types
    layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    rest = types["std_msgs/msg/Float64MultiArray"](layout=layout, data=1e3 * log.position.reshape(-1))
    yield "/tactile/rest", "std_msgs/msg/Float64MultiArray", START, rest
    for k, time in enumerate(log.time):
        moment = START + round(time * 1e9)
        stamp = types["builtin_interfaces/msg/Time"](sec=moment // 10**9, nanosec=moment % 10**9)
        sequence = {"seq": k} if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__ else {}
        yield (
            "/tactile",
            "sensor/msg/Tactile",
            moment + 2_000_000,
            types["sensor/msg/Tactile"](
                header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="finger", **sequence),
                displacement=1e3 * log.displacement[k].reshape(-1),
                force=log.force[k].reshape(-1),
            ),
        )
        x, y, theta = log.object_pose[k]
        pose = types["geometry_msgs/msg/Pose2D"](x=x, y=y, theta=theta)
        yield "/object", "geometry_msgs/msg/Pose2D", moment + 5_000_000, pose


def robot_types(stores: Stores) -> Typestore:
    store = get_typestore(stores)
    store.register(get_types_from_msg(TACTILE, "sensor/msg/Tactile"))
    return store


def write_bag1(log: GraspLog, path: Path, compression: Bag1.CompressionFormat | None = None) -> Path:
    store = robot_types(Stores.ROS1_NOETIC)
    bag = Bag1(path)
    if compression is not None:
        bag.set_compression(compression)
    with bag:
        connections = {}
        for topic, kind, moment, message in robot_messages(log, store):
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=store)
            bag.write(connections[topic], moment, store.serialize_ros1(message, kind))
    return path


def write_bag2(log: GraspLog, folder: Path, plugin: StoragePlugin = StoragePlugin.SQLITE3) -> Path:
    store = robot_types(Stores.ROS2_HUMBLE)
    with Bag2(folder, version=9, storage_plugin=plugin) as bag:
        connections = {}
        for topic, kind, moment, message in robot_messages(log, store):
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=store)
            bag.write(connections[topic], moment, store.serialize_cdr(message, kind))
    return folder


def write_json_mcap(log: GraspLog, path: Path, mapping: str = "", **options: Any) -> Path:
    """An MCAP of JSON messages."""
    with path.open("wb") as stream:
        writer = McapWriter(stream, **options)
        writer.start()
        schema = writer.register_schema("tactile", "jsonschema", b"{}")
        channel = writer.register_channel("/tactile", "json", schema)
        for k, time in enumerate(log.time):
            frame = {"displacement": log.displacement[k].tolist(), "rest": log.position.tolist()}
            moment = START + round(time * 1e9)
            writer.add_message(channel, moment, json.dumps(frame).encode(), moment)
        if mapping:
            writer.add_metadata("stiction", {"mapping": mapping})
        writer.finish()
    return path


TACTILE_PROTO = """
name: "tactile.proto" package: "lab" dependency: "google/protobuf/timestamp.proto" syntax: "proto3"
message_type {
  name: "Vector"
  field { name: "x" number: 1 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
  field { name: "y" number: 2 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
  field { name: "z" number: 3 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
}
message_type {
  name: "Marker"
  field { name: "moved" number: 1 type: TYPE_MESSAGE type_name: ".lab.Vector" label: LABEL_OPTIONAL }
  field { name: "force" number: 2 type: TYPE_FLOAT label: LABEL_REPEATED }
}
message_type {
  name: "Tactile"
  field { name: "stamp" number: 1 type: TYPE_MESSAGE type_name: ".google.protobuf.Timestamp" label: LABEL_OPTIONAL }
  field { name: "markers" number: 2 type: TYPE_MESSAGE type_name: ".lab.Marker" label: LABEL_REPEATED }
}
"""


def write_protobuf_mcap(log: GraspLog, path: Path, **options: Any) -> Path:
    """An MCAP of one message a frame, with a message a marker in it."""
    types = descriptor_pb2.FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(types.file.add())
    text_format.Parse(TACTILE_PROTO, types.file.add())
    pool = descriptor_pool.DescriptorPool()
    for file in types.file:
        pool.Add(file)
    tactile = message_factory.GetMessageClass(pool.FindMessageTypeByName("lab.Tactile"))
    with path.open("wb") as stream:
        writer = McapWriter(stream, **options)
        writer.start()
        schema = writer.register_schema("lab.Tactile", "protobuf", types.SerializeToString())
        channel = writer.register_channel("/tactile", "protobuf", schema)
        for k, time in enumerate(log.time):
            moment = START + round(time * 1e9)
            message: Any = tactile()
            message.stamp.seconds, message.stamp.nanos = divmod(moment, 10**9)
            for moved, force in zip(log.displacement[k].reshape(-1, 3), log.force[k].reshape(-1, 3), strict=True):
                marker = message.markers.add(force=force)
                marker.moved.x, marker.moved.y, marker.moved.z = moved
            writer.add_message(channel, moment + 2_000_000, message.SerializeToString(), moment)
        writer.finish()
    return path


def write_hdf5(log: GraspLog, path: Path) -> Path:
    with h5py.File(path, "w") as file:
        for name in ("time", "position", "displacement", "force", "normal", "object_pose", "gripper_force"):
            file.create_dataset(name, data=getattr(log, name), compression="gzip", shuffle=True)
        file.attrs["element_area"] = log.element_area
        file.attrs["sensor"] = log.sensor
        file.attrs["gripper_force_deviation"] = log.gripper_force_deviation
    return path


def write_lerobot(log: GraspLog, path: Path) -> Path:
    """A data file as LeRobot v3 lays it out: episodes one after the other, arrays as nested lists."""
    frames = len(log)
    columns = {
        "observation.displacement": pa.array([*log.displacement.tolist(), *log.displacement.tolist()]),
        "observation.force": pa.array([*log.force.tolist(), *(-log.force).tolist()]),
        "timestamp": pa.array(np.concatenate([log.time, log.time]).astype(np.float32)),
        "frame_index": pa.array([*range(frames), *range(frames)]),
        "episode_index": pa.array([0] * frames + [1] * frames),
        "index": pa.array(range(2 * frames)),
        "task_index": pa.array([0] * 2 * frames),
    }
    pq.write_table(pa.table(columns), path, row_group_size=4)
    return path


def write_json(log: GraspLog, path: Path) -> Path:
    names = ("time", "position", "displacement", "force", "object_pose", "gripper_force")
    told = {name: value.tolist() for name in names if (value := getattr(log, name)) is not None}
    path.write_text(json.dumps(told | {"sensor": "left"}))
    return path


@pytest.fixture
def write() -> SimpleNamespace:
    """Writers of a log, each by its format's own library."""
    return SimpleNamespace(
        bag1=write_bag1, bag2=write_bag2, json_mcap=write_json_mcap, protobuf_mcap=write_protobuf_mcap,
        hdf5=write_hdf5, lerobot=write_lerobot, json=write_json, mapping=ROBOT_MAPPING,
    )  # fmt: skip
