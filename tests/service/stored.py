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


def wait_for_jobs(client: httpx.Client) -> None:
    """Wait until no job is left to do: those of earlier uploads store what they find."""

    def some_left() -> bool:
        in_turn = ("queued", "running")  # asked the other way round, one that begins meanwhile would be in neither
        return any(client.get("/v1/jobs", params={"status": each}).json()["items"] for each in in_turn)

    wait_until(lambda: not some_left(), "jobs to end")


def stored_files(client: httpx.Client) -> set[str]:
    """What the server keeps, once nothing is under way."""
    wait_for_jobs(client)
    wait_for_empty_spool(client)
    blobs = Path(client.headers["x-data-folder"]) / "blobs"
    return {str(path) for path in blobs.rglob("*") if path.is_file()}
