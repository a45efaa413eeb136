import asyncio
import gzip
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import numpy as np
import pytest
from backports import zstd

from db.blobs import BlobStore, Spool
from service.domain.errors import InvalidValue, TooLarge, UnsupportedFormat, UploadInterrupted
from service.domain.resources import receive

PACKERS: dict[str, Callable[[bytes], bytes]] = {"gzip": gzip.compress, "zstd": zstd.compress}


@pytest.fixture
def spools(tmp_path: Path) -> BlobStore:
    return BlobStore(tmp_path)


def filled(spool: Spool, content: bytes) -> Spool:
    spool.write(content)
    return spool


@pytest.mark.parametrize(("told", "undone"), [("", ""), ("identity", ""), (" GZip ", "gzip"), ("zstd", "zstd")])
def test_an_encoding_is_known_however_it_is_spelled(told: str, undone: str) -> None:
    assert receive.check_encoding(told) == undone


def test_an_unknown_encoding_is_refused_with_those_that_are_known() -> None:
    with pytest.raises(UnsupportedFormat, match="gzip, zstd or none"):
        receive.check_encoding("br")


@pytest.mark.parametrize("encoding", PACKERS)
def test_a_body_is_unpacked_up_to_its_limit(spools: BlobStore, encoding: str) -> None:
    content = bytes(3 * 2**20)
    for limit, fits in ((len(content), True), (len(content) - 1, False)):
        with spools.spool() as packed, spools.spool() as spool:
            filled(packed, PACKERS[encoding](content))
            if fits:
                receive.unpack(packed, spool, encoding, limit, 1)
                assert spool.size == len(content)
                spool.flush()
                assert spool.path.read_bytes() == content
            else:
                with pytest.raises(TooLarge, match="at most 3145727 bytes"):
                    receive.unpack(packed, spool, encoding, limit, 1)


@pytest.mark.parametrize("encoding", PACKERS)
def test_a_body_that_unpacks_to_too_many_times_its_size_is_refused(spools: BlobStore, encoding: str) -> None:
    with spools.spool() as packed, spools.spool() as spool:
        filled(packed, PACKERS[encoding](bytes(40 * 2**20)))
        with pytest.raises(TooLarge, match="at most 100 times as many"):
            receive.unpack(packed, spool, encoding, 2**30, 100)
        assert spool.size <= receive.EXPANSION_FROM + receive.CHUNK_BYTES


@pytest.mark.parametrize("encoding", PACKERS)
@pytest.mark.parametrize("kept", [0, 5, 500])
def test_a_damaged_stream_is_refused(spools: BlobStore, encoding: str, kept: int) -> None:
    content = PACKERS[encoding](np.random.default_rng(0).bytes(2000))
    for damaged in (content[:kept], content[:kept] + b"\xff" * 40):
        with spools.spool() as packed, spools.spool() as spool:
            filled(packed, damaged)
            if not damaged and encoding == "gzip":
                receive.unpack(packed, spool, encoding, 2**20, 100)  # an empty file is an empty body
                assert spool.size == 0
            else:
                with pytest.raises(InvalidValue, match=f"not a complete {encoding} stream"):
                    receive.unpack(packed, spool, encoding, 2**20, 100)


class Sink:
    """What is asked of a spool while a body comes."""

    def __init__(self) -> None:
        self.size = 0

    def write(self, content: bytes | bytearray) -> None:
        self.size += len(content)


@pytest.mark.parametrize(("count", "held"), [(1, receive.CHUNK_BYTES), (200, 2 * receive.BUFFER_BYTES)])
def test_bodies_that_stop_on_their_way_hold_little_memory_together(count: int, held: int) -> None:
    sinks, begun, stopped = [Sink() for _ in range(count)], asyncio.Barrier(count + 1), asyncio.Event()

    async def slow_body() -> AsyncIterator[bytes]:
        yield bytes(500_000)
        await begun.wait()
        yield bytes(400_000)
        await stopped.wait()

    async def check() -> None:
        bodies = receive.Bodies()
        tasks = [asyncio.create_task(bodies.receive(sink, slow_body(), 2**20, asyncio.to_thread)) for sink in sinks]  # type: ignore[arg-type]
        await begun.wait()
        async with asyncio.timeout(30.0):  # for the threads to write what is not to be held
            while sum(900_000 - sink.size for sink in sinks) > held:
                await asyncio.sleep(0.02)
        stopped.set()
        await asyncio.gather(*tasks)
        assert all(sink.size == 900_000 for sink in sinks)

    asyncio.run(check())


def test_who_goes_just_as_the_answer_is_there_disturbs_nobody() -> None:
    """The loop calls back after all is over, and there is no time to be set any more."""
    told: list[object] = []

    async def ask() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context))
        gone = asyncio.Event()

        async def wait() -> None:
            await gone.wait()

        async with receive.unless_gone(wait()):
            await asyncio.sleep(0)
            gone.set()
            await asyncio.sleep(0)  # the watch ends now, and its end is told in the next round
        await asyncio.sleep(0)
        await asyncio.sleep(0)

    asyncio.run(ask())
    assert told == []


def test_a_body_may_have_as_many_bytes_as_it_may_have() -> None:
    receive.check_size(100, 100)
    with pytest.raises(TooLarge, match="body is 101 bytes or more; allowed: at most 100 bytes"):
        receive.check_size(101, 100)


@pytest.mark.parametrize(("packed", "unpacked"), [(2**20, 100 * 2**20), (1, 2**24)])
def test_a_body_may_unpack_to_so_many_times_its_bytes(packed: int, unpacked: int) -> None:
    receive.check_expansion(packed, unpacked, 100)
    told = f"body is {packed} bytes that unpack to {unpacked + 1} or more; allowed: at most 100 times as many"
    with pytest.raises(TooLarge, match=told):
        receive.check_expansion(packed, unpacked + 1, 100)


def test_a_body_is_written_in_its_order_a_chunk_at_a_time(spools: BlobStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(receive, "CHUNK_BYTES", 4)
    monkeypatch.setattr(receive, "LEAST_CHUNK_BYTES", 1)
    written: list[bytes] = []

    async def in_thread(write: Callable[[bytes], object], content: bytearray) -> None:
        written.append(bytes(content))
        write(content)

    async def chunks(*parts: bytes) -> AsyncIterator[bytes]:
        for part in parts:
            yield part
            if part == b"gone":
                raise ConnectionError

    async def take(limit: int, *parts: bytes) -> bytes:
        with spools.spool() as spool:
            await receive.Bodies().receive(spool, chunks(*parts), limit, in_thread)
            spool.flush()
            return spool.path.read_bytes()

    assert asyncio.run(take(10, b"ab", b"c", b"defgh", b"ij")) == b"abcdefghij"
    assert written == [b"abcdefgh", b"ij"]
    with pytest.raises(TooLarge, match="body is 10 bytes or more; allowed: at most 9 bytes"):
        asyncio.run(take(9, b"ab", b"c", b"defgh", b"ij"))
    with pytest.raises(UploadInterrupted, match=r"^the connection ended after 6 bytes$"):
        asyncio.run(take(10, b"ab", b"gone"))
    assert asyncio.run(take(0)) == b""
