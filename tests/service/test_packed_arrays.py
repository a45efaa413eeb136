"""The message that scripts of the pages read."""

import json
import struct

import numpy as np
import pytest

from service.packed_arrays import pack_arrays


def test_arrays_stand_behind_the_header_each_where_the_header_says() -> None:
    arrays = {
        "map": np.arange(5, dtype=np.uint8),
        "force": np.array([[0.5, -1.0], [2.0, 3.0]], np.float32),
        "code": np.array([-1], np.int8),
    }
    packed = pack_arrays({"frames": 3}, arrays)
    (length,) = struct.unpack("<I", packed[:4])
    header, rest = json.loads(packed[4 : 4 + length]), packed[4 + length :]
    assert (length % 4, header.pop("frames")) == (0, 3)
    assert [tuple(each.values()) for each in header["arrays"]] == [
        ("map", "Uint8Array", 0, 5), ("force", "Float32Array", 8, 4), ("code", "Int8Array", 24, 1)
    ]  # fmt: skip
    assert len(rest) == 28
    for told, array in zip(header["arrays"], arrays.values(), strict=True):
        found = np.frombuffer(rest, array.dtype, told["length"], told["offset"])
        np.testing.assert_array_equal(found, array.ravel())


def test_a_number_that_json_does_not_know_is_none_of_a_header() -> None:
    with pytest.raises(ValueError, match="JSON"):
        pack_arrays({"size": float("nan")}, {})
