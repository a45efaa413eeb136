"""The files in the data folder of the server that all tests share."""

from pathlib import Path

import httpx

from tests.waiting import wait_until


def spool(client: httpx.Client) -> list[Path]:
    """The files of uploads and downloads under way."""
    return list((Path(client.headers["x-data-folder"]) / "spool").iterdir())


def wait_for_empty_spool(client: httpx.Client) -> None:
    """Wait until nothing is under way: a file may go a moment after the answer that it was made for."""
    wait_until(lambda: not spool(client), "files of uploads and downloads to go")


def stored_files(client: httpx.Client) -> set[str]:
    """What the server keeps, once nothing is under way."""
    wait_for_empty_spool(client)
    blobs = Path(client.headers["x-data-folder"]) / "blobs"
    return {str(path) for path in blobs.rglob("*") if path.is_file()}
