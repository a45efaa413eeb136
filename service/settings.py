"""Settings of the service, each from an environment variable of the same name with the prefix ``STICTION_``."""

import ipaddress
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Literal
from urllib.parse import urlsplit

from pydantic import Field, ValidationError, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict
from pydantic_settings import PydanticBaseSettingsSource as Source
from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

from db.database import SCHEMES
from db.object_store import SCHEMES as BLOB_SCHEMES
from service.ranges import range_at

MIB = 2**20

LogFormat = Literal["text", "json"]
LogLevel = Literal["debug", "info", "warning", "error"]

PREFIX = "STICTION_"
OF_CLIENTS = frozenset({"URL", "KEY"})
"""What clients read: the address of a service, and an access key for it."""


class Settings(BaseSettings):
    """Everything that can be set, with its valid range (docs/settings.md)."""

    model_config = SettingsConfigDict(env_prefix=PREFIX, env_ignore_empty=True, frozen=True, extra="forbid")

    @classmethod
    def settings_customise_sources(  # type: ignore[override]
        cls, _kind: type[BaseSettings], init_settings: Source, env_settings: Source, **_unused: Source
    ) -> tuple[Source, ...]:
        """What is given and the environment: no settings are read from files, which took as long again to look for."""
        return init_settings, env_settings

    data_folder: Path = Field(
        default=Path("stiction-data"),
        description="Folder of the raw uploads, of results and of the SQLite file. Processes may share it.",
    )
    database_url: str | None = Field(
        default=None,
        repr=False,  # it may hold a password
        description="SQLAlchemy URL of the database; by default the SQLite file `stiction.sqlite3` in the data folder.",
    )
    blob_url: str | None = Field(
        default=None,
        description="URL of an object store for uploads and results, such as s3://bucket/prefix; else the data folder.",
    )
    blob_cache_bytes: Annotated[int, Field(ge=0, le=2**50)] = Field(
        default=10 * 1024 * MIB, description="Bytes of the object store's blobs that are kept in the data folder, too."
    )
    keep_uploads_days: Annotated[float, Field(gt=0.0, le=36500.0)] | None = Field(
        default=None,
        description="Days after which uploads are deleted; what was found in them stays. Default: never.",
    )
    keep_unreferenced_days: Annotated[float, Field(gt=0.0, le=36500.0)] | None = Field(
        default=None,
        description="Days after which files to which nothing refers, set aside by then, are deleted. Default: never.",
    )
    keep_audit_days: Annotated[float, Field(ge=30.0, le=36500.0)] | None = Field(
        default=None, description="Days after which entries of the audit trail are deleted. Default: never."
    )
    webhook_url: str | None = Field(
        default=None,
        repr=False,  # it may hold a password
        description="URL that is sent a POST when the service finds a changed surface or a damaged file.",
    )
    webhook_secret: Annotated[str, Field(min_length=16)] | None = Field(
        default=None, repr=False, description="Key of the signature (HMAC-SHA256) of what is sent to the webhook."
    )
    scrub_bytes_per_second: Annotated[float, Field(ge=0.0, le=1e12)] = Field(
        default=float(MIB), description="Pace at which stored files are read and compared with their hashes; 0: not."
    )
    migrate_at_start: bool = Field(
        default=True,
        description="Bring the database to this version's schema at start; otherwise an old one stops the start.",
    )
    log_format: LogFormat = Field(
        default="text", description="Form of the log: lines to be read (text), or one JSON object a line (json)."
    )
    log_level: LogLevel = Field(default="info", description="Least level of what is logged.")
    host: str = Field(default="127.0.0.1", description="Address to listen on.")
    port: Annotated[int, Field(ge=0, le=65535)] = Field(
        default=8000, description="Port to listen on; 0 takes a free one."
    )
    lookup_port: Annotated[int, Field(ge=0, le=65535)] | None = Field(
        default=None,
        description="Port of a second server process, without workers, for look-ups that wait for no upload; 0 takes a "
        "free one. Default: none.",
    )
    access: Literal["auto", "keys", "open"] = Field(
        default="auto",
        description="Who must send a key: all but users of this machine (auto), everybody (keys), or nobody (open).",
    )
    trusted_proxies: str = Field(
        default="",
        description="Addresses or networks of proxies whose X-Forwarded-For and -Proto are trusted; empty: none.",
    )
    rate_limit: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        default=1000.0, description="Requests a second of one key, or of one address without a key; 0: any number."
    )
    max_connections: Annotated[int, Field(ge=1, le=100_000)] = Field(
        default=1000, description="Connections at once; beyond that idle ones are closed."
    )
    max_connections_per_address: Annotated[int, Field(ge=1, le=100_000)] = Field(
        default=200, description="Connections of one address; beyond that its idle ones are closed."
    )
    stream_sessions_per_key: Annotated[int, Field(ge=1, le=200)] = Field(
        default=50, description="Live streams of one key, or of one address without a key, that may be open at once."
    )
    stream_bytes: Annotated[int, Field(ge=MIB, le=2**40)] = Field(
        default=512 * MIB, description="Bytes of frames that all live streams together may hold."
    )
    least_free_bytes: Annotated[int, Field(ge=0, le=2**50)] = Field(
        default=256 * MIB,
        description="Bytes free on the disks of files and of SQLite below which uploads are refused; 0: any.",
    )
    max_upload_bytes: Annotated[int, Field(ge=1, le=2**40)] = Field(
        default=256 * MIB, description="Largest grasp log that is accepted, in bytes."
    )
    idempotency_hours: Annotated[float, Field(gt=0.0, le=8760.0)] = Field(
        default=24.0, description="How long an Idempotency-Key counts, in hours."
    )
    max_expansion: Annotated[int, Field(ge=1, le=100_000)] = Field(
        default=200,
        description="How many times its size a body may unpack to, as an archive, too, once that is over 16 MiB.",
    )
    read_seconds: Annotated[float, Field(gt=0.0, le=3600.0)] = Field(
        default=60.0, description="CPU time that reading a file of another library's format may take, in s."
    )
    readers: Annotated[int, Field(ge=1, le=64)] = Field(
        default=2, description="Processes that read large files and those of other libraries' formats, at most."
    )
    reading_bytes: Annotated[int, Field(ge=1, le=2**40)] = Field(
        default=256 * MIB, description="Memory that reading uploads may take of the server process at once, in bytes."
    )
    lookup_seconds: Annotated[float, Field(ge=0.0, le=60.0)] = Field(
        default=1.0, description="How old a model in memory may be before a look-up asks the database again, in s."
    )
    workers: Annotated[int, Field(ge=0, le=64)] = Field(
        default=1,
        description="Worker processes that detect and fit; the server process itself never does. 0 leaves the jobs to "
        "`stiction worker`.",
    )
    dask_address: Annotated[str, Field(pattern=r"^(tcp|tls|ws|wss)://.+:\d+$")] | None = Field(
        default=None,
        description="Address of a Dask scheduler; so many jobs as there are workers then run there and not here.",
    )
    job_attempts: Annotated[int, Field(ge=1, le=10)] = Field(
        default=3, description="How often a job may lose its worker process before it has failed."
    )
    job_cpu_seconds: Annotated[float, Field(ge=1.0, le=1e6)] = Field(
        default=300.0, description="CPU time that a job may take, in s; one that wants more is refused."
    )
    job_memory_bytes: Annotated[int, Field(ge=64 * MIB, le=2**50)] = Field(
        default=4096 * MIB, description="Bytes of memory that a job may take; one that wants more is refused."
    )
    scatter_from_other_materials: bool = Field(
        default=True,
        description="Learn how much grasps of a material may differ from the other materials of its sensor.",
    )
    key_queued_jobs: Annotated[int, Field(ge=1, le=10**9)] | None = Field(
        default=None, description="Jobs of one key that may be queued at once. Default: any number."
    )
    key_logs_a_day: Annotated[int, Field(ge=1, le=10**9)] | None = Field(
        default=None, description="Logs that one key may store in 24 hours. Default: any number."
    )
    key_stored_bytes: Annotated[int, Field(ge=1, le=2**60)] | None = Field(
        default=None, description="Bytes of uploads that one key may have stored. Default: any number."
    )
    key_changes_a_day: Annotated[int, Field(ge=1, le=10**9)] | None = Field(
        default=None,
        description="Changes of materials, names and sensors that one key may make, and fits that it may ask for, in "
        "24 hours. Default: any number.",
    )
    lease_seconds: Annotated[float, Field(ge=0.5, le=600.0)] = Field(
        default=10.0, description="How long a process may be silent, in s, before others take its jobs over."
    )
    poll_seconds: Annotated[float, Field(ge=0.01, le=60.0)] = Field(
        default=0.1, description="How often an idle worker looks for jobs that other processes stored, in s."
    )
    shutdown_seconds: Annotated[float, Field(ge=0.0, le=600.0)] = Field(
        default=10.0,
        description="How long a stopping server waits for requests and then for running jobs, in s; the next start "
        "takes up the rest.",
    )

    @field_validator("trusted_proxies")
    @classmethod
    def _addresses(cls, text: str) -> str:
        for part in filter(None, map(str.strip, text.split(","))):
            try:
                ipaddress.ip_network(part)
            except ValueError as error:
                raise ValueError(f"{part} is no address; allowed: such as 10.0.0.7,10.1.0.0/16") from error
        return text

    @field_validator("database_url")
    @classmethod
    def _shared_by_processes(cls, url: str | None) -> str | None:
        if url is not None and (":memory:" in url or url in {"sqlite://", "sqlite:///"}):
            raise ValueError("a file or a server: a database in memory is not seen by the worker processes")
        if url is not None and _scheme(url).partition("+")[0] not in SCHEMES:
            raise ValueError(f"a SQLAlchemy URL that begins with {' or '.join(f'{each}://' for each in SCHEMES)}")
        return url

    @field_validator("webhook_url")
    @classmethod
    def _web_address(cls, url: str | None) -> str | None:
        with suppress(ValueError):  # whose text may hold the address
            parts = urlsplit(url or "")
            if url is None or (parts.scheme in {"http", "https"} and parts.hostname and parts.port != 0):
                return url
        raise ValueError("an http or https URL, such as https://hooks.example/friction")

    @field_validator("blob_url")
    @classmethod
    def _kept(cls, url: str | None) -> str | None:
        if url is not None and ("://" not in url or _scheme(url) not in BLOB_SCHEMES):
            raise ValueError(f"s3://bucket/prefix and other URLs of obstore, of {', '.join(BLOB_SCHEMES)}")
        return url

    @property
    def resolved_database_url(self) -> str:
        """The database's URL: the one that was set, or that of the SQLite file in the data folder."""
        file = self.data_folder.resolve() / "stiction.sqlite3"
        return self.database_url or URL.create("sqlite", database=str(file)).render_as_string()


def unknown_variables(environment: Iterable[str]) -> list[str]:
    """Names of the environment that look like settings and are none: misspelt, or of another version."""
    known = {PREFIX + name for name in OF_CLIENTS | {field.upper() for field in Settings.model_fields}}
    return sorted(name for name in environment if name.upper().startswith(PREFIX) and name.upper() not in known)


def complaints(error: ValidationError) -> str:
    """What is wrong with settings, a line each; no value that may hold a secret is shown."""
    return "\n".join(_complaint(str(each["loc"][0]), each["input"], each["msg"]) for each in error.errors())


def _complaint(name: str, value: object, message: str) -> str:
    field = Settings.model_fields.get(name)
    shown = repr(str(value))[:100] if field is not None and field.repr else None
    if name == "database_url":
        shown = _without_password(str(value))
    allowed = _range(name) or message.removeprefix("Input should be ").removeprefix("Value error, ")
    return f"{PREFIX}{name.upper()} is {shown or 'not one that is allowed'}; allowed: {allowed} (docs/settings.md)"


def _scheme(url: str) -> str:
    return url.partition("://")[0].lower()


def _without_password(url: str) -> str | None:
    """A database's URL as it may be shown; None where a part that is not known to be the password may hold it."""
    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError):
        return None
    is_clear = not parsed.query and "@" not in (parsed.host or "")
    return repr(parsed.render_as_string(hide_password=True))[:100] if is_clear else None


def _range(name: str) -> str | None:
    """What a setting that is a number may be, both ends of it; None of any other."""
    return range_at(Settings.model_json_schema(), (name,))
