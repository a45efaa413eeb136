"""What an upload is asked, and when the job of one that is sent again is done once more."""

import asyncio
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from db.records import Finding, Gel, NewGraspLog
from db.repositories import detections
from db.repositories import sensors as stored_sensors
from service import formats
from service.domain.errors import InvalidGraspLog, InvalidValue, TooLarge, UnsupportedFormat
from service.domain.uploads import accept, sent_again, upload
from slipcore.errors import InvalidInput

GEL = Gel(2e5, 0.48, None, 0.0)
SESSION: Any = None


@pytest.fixture(autouse=True)
def gel(monkeypatch: pytest.MonkeyPatch) -> None:
    """The sensors' gel as it is described now, the left one's by an admin; of each log it is known whether its grasp
    was looked for.
    """

    def get(_: Any, name: str) -> Any:
        return SimpleNamespace(gel=GEL, calibration=None, described_by=None if name == "left" else "a")

    monkeypatch.setattr(stored_sensors, "get", get)
    monkeypatch.setattr(detections, "has_signature", lambda _, log_id: log_id != "unsigned")


def log(status: str = "done", found: Any = "nothing against it", log_id: str = "7f", ended: bool = True) -> Any:
    detection = SimpleNamespace(findings=(), gel=GEL) if found == "nothing against it" else found
    job = SimpleNamespace(status=status, finished_at="then" if ended else None)
    return SimpleNamespace(id=log_id, job=job, detection=detection, sensor="left", uploaded_by="b")


def seen(*names: str, gel: Gel | None = GEL, findings: bool = True) -> Any:
    against = tuple(Finding(name, "x", "y") for name in names) if findings else None
    return SimpleNamespace(findings=against, gel=gel)


def by_key(names: tuple[str, ...], sent_by: str, sensor: str = "right") -> Any:
    """A log of a sensor that key a has described."""
    return SimpleNamespace(**vars(log(found=seen(*names))) | {"sensor": sensor, "uploaded_by": sent_by})


BY_GEL, ANOTHERS = "reconstructed forces", "another's gel"
OTHER = replace(GEL, young_modulus=3e5)


@pytest.mark.parametrize(
    ("given", "may_differ"),
    [
        (log(), False),
        (log("failed"), True),
        (log("cancelled"), True),
        (log("failed", None), True),
        (log("done", seen(findings=False)), True),
        (log("done", seen(findings=False), ended=False), False),
        (log("done", log_id="unsigned"), True),
        (log("refused"), False),
        (log("refused", None), True),
        (log("refused", seen(gel=OTHER)), True),
        (log("refused", seen(gel=None)), True),
        (log("done", seen("reconstructed forces")), False),
        (log("done", seen("reconstructed forces", gel=OTHER)), True),
        (log("done", seen("slow frames", gel=OTHER)), False),
        (log("running", seen("reconstructed forces", gel=OTHER), ended=False), False),
        (log("done", None), False),
        (by_key((BY_GEL, ANOTHERS), "b"), False),
        (by_key((BY_GEL,), "a"), False),
        (by_key((), "b"), False),
        (by_key((BY_GEL,), "b"), True),
        (by_key((BY_GEL, ANOTHERS), "b", sensor="left"), True),
    ],
)
def test_a_job_is_done_again_where_it_may_end_otherwise(given: Any, may_differ: bool) -> None:
    assert sent_again._may_differ(SESSION, given) is may_differ


@pytest.mark.parametrize(
    ("given", "can"),
    [
        (log("failed"), True),
        (log("cancelled"), True),
        (log("done"), False),
        (log("refused"), False),
        (log("failed", None), False),
        (log("failed", seen(gel=OTHER)), False),
        (log("failed", seen(findings=False)), False),
        (log("failed", log_id="unsigned"), False),
    ],
)
def test_what_was_found_is_gone_on_with_where_it_would_be_the_same(given: Any, can: bool) -> None:
    assert sent_again._can_go_on(SESSION, given) is can


@pytest.mark.parametrize(
    ("detector", "frames", "grid", "is_long"),
    [
        ("filter", 100_000, (1, 10), False),
        ("filter", 100_001, (1, 1), True),
        ("filter", 2500, (20, 20), False),
        ("filter", 2501, (20, 20), True),
        ("filter", 9901, (101, 1), True),
        ("strain_rate", 2500, (20, 20), False),
        ("rigid_fit", 250, (20, 20), False),
        ("rigid_fit", 251, (20, 20), True),
    ],
)
def test_a_log_is_long_by_its_frames_its_elements_and_its_detector(
    detector: str, frames: int, grid: tuple[int, int], is_long: bool
) -> None:
    new = NewGraspLog("0" * 64, 9, "npz", detector, None, "left", frames, 1.0, grid)
    assert accept._is_long(new) is is_long


@pytest.mark.parametrize("name", ["a", "x" * 200, "Prüfstand 1"])
def test_a_sensor_s_name_may_be_as_long_as_it_may_be(name: str) -> None:
    assert upload._sensor_name(name) == name


@pytest.mark.parametrize("name", ["", "x" * 201, "a\nb", "a\x1b"])
def test_a_name_that_cannot_be_is_told_with_what_may(name: str) -> None:
    with pytest.raises(InvalidGraspLog, match=r"sensor is .*; allowed: 1 to 200 printable characters"):
        upload._sensor_name(name)


def test_a_body_has_a_type() -> None:
    upload._check_type("application/json")
    for none in (None, ""):
        with pytest.raises(UnsupportedFormat, match=r"content type is missing; allowed: .*application/octet-stream$"):
            upload._check_type(none)


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (formats.UnsupportedFormat("file", "a", "b"), UnsupportedFormat),
        (formats.UnusedSetting("scale", "a", "b"), InvalidValue),
        (InvalidInput("time", "a", "b"), InvalidGraspLog),
    ],
)
def test_what_a_reader_refuses_is_refused_by_its_name(error: Any, kind: type[InvalidValue]) -> None:
    with pytest.raises(InvalidValue) as refusal, upload._refusals_named():
        raise error
    assert type(refusal.value) is kind
    assert (refusal.value.name, refusal.value.value, refusal.value.allowed) == (error.name, "a", "b")


@pytest.mark.parametrize(
    ("newer", "ended", "may", "is_anew"),
    [(2, True, True, True), (None, True, True, False), (2, False, True, False), (2, True, False, False)],
)
def test_a_log_is_corrected_anew_for_who_may_change_it(
    monkeypatch: pytest.MonkeyPatch, newer: int | None, ended: bool, may: bool, is_anew: bool
) -> None:
    def check(*_: object) -> None:
        if not may:
            raise sent_again.NotOwner([])

    monkeypatch.setattr(stored_sensors, "get", lambda *_: SimpleNamespace(gel=GEL, calibration=newer))
    monkeypatch.setattr(sent_again, "_check_may_change_log", check)
    given = log(ended=ended)
    given.calibration = None
    principal: Any = None
    assert sent_again._is_calibrated_anew(SESSION, given, None, principal) is is_anew


@pytest.mark.parametrize(("name", "made"), [("npz", 0), ("csv", 0), ("csv", 1)])
def test_what_unpacks_to_too_much_is_refused_before_it_is_read_and_what_is_made_of_it_before_it_is_stored(
    name: str, made: int
) -> None:
    """Whether the file itself says so, or only what is made of it turns out to be as large."""
    most, read = 100 * 2**20, list[str]()
    name = next(each for each, form in formats.FORMATS.items() if form.plain is (name == "npz"))
    unpacked = most if made else most + 1

    async def in_thread(_share: str, do: Any, *_given: Any, **_more: Any) -> Any:
        return (name, unpacked) if do is upload._identify else None

    async def reading(*_given: Any) -> str:
        read.append(name)
        return "description"

    spool = SimpleNamespace(path="body", sync=None)
    blobs = SimpleNamespace(spool=lambda: nullcontext(SimpleNamespace(path="made", adopt=None, size=most + made)))
    context: Any = SimpleNamespace(
        settings=SimpleNamespace(max_expansion=100), threads=SimpleNamespace(run=in_thread), blobs=blobs,
        readers=SimpleNamespace(describe=reading, convert=reading),
    )  # fmt: skip
    request: Any = SimpleNamespace(principal=SimpleNamespace(share="me"), settings={})
    with ExitStack() as spools, pytest.raises(TooLarge, match=f"body is {2**20} bytes that unpack to {most + 1} or"):
        asyncio.run(upload._read(context, spools, spool, request, 2**20))  # type: ignore[arg-type]
    assert read == ([name] if made else [])
