import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from backports import zstd

from db.blobs import BlobStore, Spool
from service.domain import receive
from service.http.problems import Problem

PACKERS: dict[str, Callable[[bytes], bytes]] = {"gzip": gzip.compress, "zstd": zstd.compress}


@pytest.fixture
def spools(tmp_path: Path) -> BlobStore:
    return BlobStore(tmp_path)


def filled(spool: Spool, content: bytes) -> Spool:
    spool.write(content)
    return spool


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
                with pytest.raises(Problem, match="at most 3145727 bytes"):
                    receive.unpack(packed, spool, encoding, limit, 1)


@pytest.mark.parametrize("encoding", PACKERS)
def test_a_body_that_unpacks_to_too_many_times_its_size_is_refused(spools: BlobStore, encoding: str) -> None:
    with spools.spool() as packed, spools.spool() as spool:
        filled(packed, PACKERS[encoding](bytes(40 * 2**20)))
        with pytest.raises(Problem, match="at most 100 times as many"):
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
                with pytest.raises(Problem, match=f"not a complete {encoding} stream"):
                    receive.unpack(packed, spool, encoding, 2**20, 100)
