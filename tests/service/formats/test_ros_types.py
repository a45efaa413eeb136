"""Types that a recording defines: whose names are plain, and whose arrays are bounded."""

import pytest

from service.formats import ros_types
from service.formats.ros_types import check_type_name, decoded, deserializer
from slipcore.errors import InvalidInput


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("pkg/Name", "pkg/msg/Name"),
        ("pkg/msg/Name", "pkg/msg/Name"),
        ("p_1/N_2", "p_1/msg/N_2"),
        (f"{'p' * 100}/{'N' * 100}", f"{'p' * 100}/msg/{'N' * 100}"),
    ],
)
def test_a_type_has_a_package_and_a_name(name: str, plain: str) -> None:
    assert check_type_name(name) == plain


@pytest.mark.parametrize(
    "name", ["Name", "pkg/", "/Name", "1pkg/Name", "pkg/_Name", "pkg/srv/Name", "pkg/Name\n", "p-g/Name", "pkg/Näme",
             f"{'p' * 101}/N", f"p/{'N' * 101}"]
)  # fmt: skip
def test_a_name_that_is_not_plain_is_refused(name: str) -> None:
    with pytest.raises(InvalidInput, match=r"message type is .*; allowed: package/msg/Name, of letters, digits and _"):
        check_type_name(name)


@pytest.mark.parametrize(("ros1", "content"), [(True, b"\x07\x00\x00\x00"), (False, b"\0\1\0\0\x07\x00\x00\x00")])
def test_bytes_become_fields_as_either_ros_writes_them(ros1: bool, content: bytes) -> None:
    message = deserializer("pkg/Name", "uint32 a", ros1=ros1)(content)
    assert getattr(message, "a") == 7  # noqa: B009 - the type is made of the definition


def test_without_a_definition_a_type_is_one_of_ros_itself() -> None:
    assert callable(deserializer("std_msgs/msg/Float64", "", ros1=False))
    with pytest.raises(InvalidInput, match="message type is pkg/msg/Name; allowed: defined in the file, or one of ROS"):
        deserializer("pkg/Name", "", ros1=False)


@pytest.mark.parametrize("length", ["9999999", "<=9999999"])
def test_an_array_may_be_as_long_as_ten_million_entries_nearly(length: str) -> None:
    assert callable(deserializer("pkg/Name", f"float64[{length}] a", ros1=False))


@pytest.mark.parametrize("length", ["10000000", "<=10000000", " 10000000 "])
def test_a_longer_array_is_refused_before_it_is_made(length: str) -> None:
    told = (
        r"definition of pkg/msg/Name is \d+ characters; allowed: at most 65536 characters, arrays of at most 10000000"
    )
    with pytest.raises(InvalidInput, match=told):
        deserializer("pkg/Name", f"float64[{length}] a", ros1=False)


def test_a_definition_is_as_long_as_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    definition = "float64 a"
    monkeypatch.setattr(ros_types, "MAX_DEFINITION_CHARACTERS", len(definition))
    assert callable(deserializer("pkg/Name", definition, ros1=False))
    with pytest.raises(InvalidInput, match="is 10 characters; allowed: at most 9 characters"):
        deserializer("pkg/Name", definition + "b", ros1=False)


def test_a_message_that_does_not_fit_is_told_by_its_topic() -> None:
    deserialize = deserializer("pkg/Name", "uint32 a", ros1=False)
    with pytest.raises(
        InvalidInput, match=r"/tactile is a message that does not fit its type \(.*\); allowed: a complete"
    ):
        decoded(deserialize, "/tactile", b"\0\1\0\0\x07")
    assert decoded(deserialize, "/tactile", b"\0\1\0\0\1\0\0\0") is not None

    def fail(_: bytes) -> object:
        raise MemoryError

    with pytest.raises(MemoryError):
        decoded(fail, "/tactile", b"")


def test_what_a_library_says_is_repeated_in_part() -> None:
    def fail(_: bytes) -> object:
        raise ValueError("x" * 200)

    with pytest.raises(InvalidInput) as refusal:
        decoded(fail, "/tactile", b"")
    assert refusal.value.value == f"a message that does not fit its type (ValueError: {'x' * 108})"
