"""What killed processes left under way, and what is in use."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from db.blobs import BlobStore
from service.jobs import spool_sweep
from service.jobs.spool_sweep import FILE_SECONDS, FOLDER_SECONDS, LOOK_SECONDS, SpoolSweep


def test_what_nobody_holds_goes_once_it_was_seen_for_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=5.0)
    monkeypatch.setattr(spool_sweep, "time", SimpleNamespace(monotonic=lambda: clock.now))
    blobs = BlobStore(tmp_path)
    sweep, folder, left = SpoolSweep(blobs), blobs.folder(), tmp_path / "spool" / "left"
    left.write_bytes(b"half an upload")
    with blobs.spool() as held:
        for seconds, there in (
            (0.0, {left, held.path, folder}),
            (FILE_SECONDS - LOOK_SECONDS, {left, held.path, folder}),
            (LOOK_SECONDS, {held.path, folder}),
            (FOLDER_SECONDS, {held.path}),
        ):
            clock.now += seconds
            sweep.look()
            assert set(blobs.under_way()) == there
    assert blobs.under_way() == []
