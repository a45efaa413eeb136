import inspect
import re
import unicodedata
from pathlib import Path

import pytest
from pydantic import ValidationError
from sqlalchemy import make_url

from service.formats.reading import Readers
from service.jobs.worker import StoreConfig
from service.settings import Settings, complaints, unknown_variables

ROWS = re.findall(
    r"^\| `STICTION_(\w+)` \| (.+?) \| (.+?) \|",
    (Path(__file__).parents[2] / "docs/settings.md").read_text(encoding="utf-8"),
    re.M,
)
DOCUMENTED = {name: default for name, default, _ in ROWS}
VALID = {name.lower(): valid for name, _, valid in ROWS}
BYTES = {"MiB": 2**20, "PiB": 2**50, "EiB": 2**60}
NUMBER = r"[\d.,]+[⁰¹²³⁴-⁹]*"
SCHEMA = Settings.model_json_schema()["properties"]


UNSET = {
    "lookup_port": "none",
    "keep_uploads_days": "for ever",
    "keep_unreferenced_days": "for ever",
    "keep_audit_days": "for ever",
    "database_url": "SQLite file",
    "blob_url": "the data folder",
    "dask_address": "none",
    "key_queued_jobs": "none",
    "key_logs_a_day": "none",
    "key_changes_a_day": "none",
    "key_stored_bytes": "none",
    "webhook_url": "none",
    "webhook_secret": "none",
}
"""What holds in place of a setting without a default."""


def test_each_setting_is_documented_and_nothing_else_is() -> None:
    assert sorted(DOCUMENTED) == sorted(name.upper() for name in Settings.model_fields)


@pytest.mark.parametrize("name", Settings.model_fields)
def test_the_documented_default_is_the_default(name: str) -> None:
    default = Settings.model_fields[name].default
    shown = DOCUMENTED[name.upper()].replace("`", "")
    expected = UNSET[name] if default is None else str(default).lower() if isinstance(default, bool) else str(default)
    assert shown.startswith(expected.removesuffix(".0"))


def bounds(name: str) -> dict[str, float]:
    """Of a number, as JSON Schema names them."""
    told = SCHEMA[name] | SCHEMA[name].get("anyOf", [{}])[0]
    return {each: told[each] for each in ("minimum", "exclusiveMinimum", "maximum") if each in told}


def quantity(text: str) -> float:
    """Such as ``1048576``, ``10¹²``, ``1,000,000`` or ``64 MiB``."""
    number, unit = re.fullmatch(rf"({NUMBER}) ?([a-zA-Z]*)", text).groups()  # type: ignore[union-attr]
    base, power = re.fullmatch(r"([\d.]+?)([⁰¹²³⁴-⁹]*)", number.replace(",", "")).groups()  # type: ignore[union-attr]
    return float(base) ** int(unicodedata.normalize("NFKC", power) or 1) * BYTES.get(unit, 1)


@pytest.mark.parametrize("name", [name for name in Settings.model_fields if bounds(name)])
def test_the_documented_range_is_the_one_that_is_kept(name: str) -> None:
    above, least, most = re.match(  # type: ignore[union-attr]
        rf"(above )?({NUMBER}(?: byte| .iB)?)(?: \(.+?\))? to ({NUMBER}(?: .iB)?)", VALID[name]
    ).groups()
    kept = bounds(name)
    assert kept.pop("exclusiveMinimum" if above else "minimum") == quantity(least)
    assert kept == {"maximum": quantity(most)}


def test_parts_without_settings_do_as_with_the_defaults_of_these() -> None:
    readers = inspect.signature(Readers).parameters
    names = {"seconds": "read_seconds", "size": "readers", "room": "reading_bytes"}
    for argument, setting in names.items():
        assert readers[argument].default == Settings.model_fields[setting].default
    config = StoreConfig("sqlite:///x", Path("x"))
    for name in ("job_memory_bytes", "scatter_from_other_materials"):
        assert getattr(config, name) == Settings.model_fields[name].default


def test_a_setting_comes_from_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path))
    monkeypatch.setenv("STICTION_WORKERS", "3")
    settings = Settings()
    assert settings.workers == 3
    assert settings.resolved_database_url == f"sqlite:///{tmp_path / 'stiction.sqlite3'}"
    assert Settings(database_url="postgresql://db/stiction").resolved_database_url == "postgresql://db/stiction"


def test_the_databases_password_is_not_shown() -> None:
    settings = Settings(database_url="postgresql://stiction:hush@db/stiction")
    assert "hush" not in f"{settings!r}{settings}"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("port", 65536),
        ("port", -1),
        ("lookup_port", 65536),
        ("max_upload_bytes", 0),
        ("access", "none"),
        ("idempotency_hours", 0.0),
        ("webhook_url", "http://"),
        ("webhook_url", "http://[::1"),
        ("webhook_url", "http://hooks.example:99999/x"),
        ("lookup_seconds", 61.0),
        ("rate_limit", -1.0),
        ("max_connections", 0),
        ("workers", -1),
        ("lease_seconds", 0.1),
        ("poll_seconds", 0.0),
        ("workers", 65),
        ("job_attempts", 0),
        ("keep_uploads_days", 0.0),
        ("keep_uploads_days", 36501.0),
        ("keep_unreferenced_days", 0.0),
        ("keep_audit_days", 29.0),
        ("trusted_proxies", "localhost"),
        ("log_format", "xml"),
        ("log_level", "trace"),
        ("shutdown_seconds", -1.0),
        ("database_url", "sqlite://"),
        ("database_url", "sqlite:///:memory:"),
        ("dask_address", "10.0.0.5:8786"),
        ("data_foldre", "typo"),
    ],
)
def test_a_value_outside_its_range_is_refused_by_name(name: str, value: object) -> None:
    with pytest.raises(ValidationError, match=name):
        Settings.model_validate({name: value})


def test_the_database_stands_in_the_data_folder_whatever_its_name(tmp_path: Path) -> None:
    folder = tmp_path / "we?ird#100%"
    url = make_url(Settings(data_folder=folder).resolved_database_url)
    assert url.database == str(folder / "stiction.sqlite3")


def test_an_empty_variable_counts_as_not_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STICTION_DATA_FOLDER", "")
    monkeypatch.setenv("STICTION_READERS", "")
    assert Settings() == Settings(data_folder=Settings.model_fields["data_folder"].default)


def test_a_variable_that_is_no_setting_is_noticed() -> None:
    environment = ["STICTION_READER", "STICTION_READERS", "STICTION_URL", "STICTION_KEY", "PATH", "stiction_port"]
    assert unknown_variables(environment) == ["STICTION_READER"]


def test_a_wrong_setting_is_told_by_its_name_and_without_secrets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STICTION_READERS", "0")
    monkeypatch.setenv("STICTION_DATABASE_URL", "sqlite:///:memory:?password=hush")
    monkeypatch.setenv("STICTION_WEBHOOK_URL", "https://user:hu℀sh@hooks.example/hush")
    monkeypatch.setenv("STICTION_WEBHOOK_SECRET", "hush")
    with pytest.raises(ValidationError) as refusal:
        Settings()
    lines = sorted(complaints(refusal.value).splitlines())
    assert lines[0].startswith(
        "STICTION_DATABASE_URL is not one that is allowed; allowed: a file or a server: a database in memory"
    )
    assert lines[1] == "STICTION_READERS is '0'; allowed: a whole number, 1 to 64 (docs/settings.md)"
    assert lines[2].startswith(
        "STICTION_WEBHOOK_SECRET is not one that is allowed; allowed: String should have at least"
    )
    assert lines[3].startswith(
        "STICTION_WEBHOOK_URL is not one that is allowed; allowed: an http or https URL, such as"
    )
    assert not {"hush", "hu℀sh"} & set(re.findall(r"[^\W_]+", "".join(lines)))


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("STICTION_PORT", "eighty", "a whole number, 0 to 65535"),
        ("STICTION_LOOKUP_PORT", "99999", "a whole number, 0 to 65535"),
        ("STICTION_LEASE_SECONDS", "0", "a number, 0.5 to 600"),
        ("STICTION_IDEMPOTENCY_HOURS", "0", "a number, above 0 to 8760"),
    ],
)
def test_of_a_number_both_ends_of_its_range_are_told(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str, allowed: str
) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(ValidationError) as refusal:
        Settings()
    assert complaints(refusal.value) == f"{name} is '{value}'; allowed: {allowed} (docs/settings.md)"


@pytest.mark.parametrize("text", ["", "10.0.0.7", "10.0.0.7, 10.1.0.0/16", "::1,", "fd00::/8"])
def test_proxies_are_addresses_or_networks(text: str) -> None:
    assert Settings(trusted_proxies=text).trusted_proxies == text


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("trusted_proxies", "proxy", "proxy is no address; allowed: such as 10.0.0.7,10.1.0.0/16"),
        ("trusted_proxies", "10.0.0.1,10.1.0.0/99", "10.1.0.0/99 is no address"),
        ("database_url", "sqlite://", "a database in memory is not seen by the worker processes"),
        ("database_url", "sqlite:///", "a file or a server"),
        ("database_url", "sqlite:///:memory:", "a file or a server"),
        ("webhook_url", "ftp://hooks.example", "an http or https URL"),
        ("webhook_url", "https://", "an http or https URL"),
        ("webhook_url", "https://hooks.example:0/a", "an http or https URL"),
        ("webhook_url", "https://hooks.example:99999/a", "an http or https URL"),
        ("blob_url", "bucket", "s3://bucket/prefix and other URLs of obstore"),
        ("blob_url", "memory:///", "s3://bucket/prefix and other URLs of obstore"),
        ("blob_url", "foo://x", "'foo://x'; allowed: s3://bucket/prefix and other URLs of obstore, of s3, s3a, gs, "),
        ("database_url", "mysql://u:hush@host/x", "'mysql://u:***@host/x'; allowed: a SQLAlchemy URL that begins with"),
        ("database_url", "postgres://host/x", "begins with sqlite:// or postgresql:// (docs"),
        ("database_url", "mysql://u:a@hush@host/x", "is not one that is allowed; allowed: a SQLAlchemy URL"),
        ("database_url", "mysql://host/x?password=hush", "is not one that is allowed; allowed: a SQLAlchemy URL"),
        ("database_url", "hush", "is not one that is allowed; allowed: a SQLAlchemy URL"),
    ],
)
def test_an_address_that_cannot_be_is_refused_with_what_may_be(name: str, value: str, allowed: str) -> None:
    with pytest.raises(ValidationError) as refused:
        Settings(**{name: value})
    told = complaints(refused.value)
    assert told.startswith(f"STICTION_{name.upper()} is ")
    assert allowed in told
    assert told.endswith("(docs/settings.md)")
    assert "hush" not in told


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("webhook_url", "http://hooks.example"),
        ("webhook_url", "https://hooks.example:8443/a?b"),
        ("blob_url", "s3://bucket/prefix"),
        ("database_url", "sqlite:////data/a.sqlite3"),
        ("database_url", "postgresql://host/stiction"),
        ("database_url", "postgresql+psycopg://host/stiction"),
    ],
)
def test_an_address_is_kept_as_it_was_given(name: str, value: str) -> None:
    assert getattr(Settings(**{name: value}), name) == value


def test_of_a_long_value_a_hundred_characters_are_told() -> None:
    with pytest.raises(ValidationError) as refused:
        Settings(trusted_proxies="x" * 1000)
    assert f"STICTION_TRUSTED_PROXIES is {repr('x' * 1000)[:100]}; allowed: " in complaints(refused.value)
