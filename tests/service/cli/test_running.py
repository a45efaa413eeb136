import webbrowser
from pathlib import Path
from typing import Any

import pytest

from service.cli import main, running
from service.cli.exit_codes import INPUT_REFUSED
from service.observability.logs import Logs
from service.settings import Settings
from tests import forking


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (["--data-folder", "/proc/x"], "STICTION_DATA_FOLDER (--data-folder) is '/proc/x', which is in a folder that"),
        (
            ["--database-url", "mysql://x/y"],
            "STICTION_DATABASE_URL is 'mysql://x/y'; allowed: a SQLAlchemy URL that begins with sqlite:// or postgresql://",
        ),
        (["--host", "nowhere.invalid"], "STICTION_HOST (--host) is 'nowhere.invalid' and STICTION_PORT (--port) 0: "),
        (["--host", "192.0.2.1"], "STICTION_HOST (--host) is '192.0.2.1' and STICTION_PORT (--port) 0: "),
        (
            ["--lookup-port", "0", "--host", "192.0.2.1"],
            "STICTION_LOOKUP_PORT (--lookup-port) is 0, with ",
        ),
    ],
    ids=["folder", "database", "host", "address", "lookup_port"],
)
def test_the_last_line_of_a_refused_start_says_what_is_wrong(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    wrong: list[str],
    why: str,
) -> None:
    for name, value in {"DATA_FOLDER": str(tmp_path), "WORKERS": "0", "ACCESS": "open"}.items():
        monkeypatch.setenv(f"STICTION_{name}", value)
    ended = forking.exit_code(main, ["serve", "--port", "0", *wrong])
    told = capfd.readouterr().err
    assert (ended, "Traceback" in told) == (INPUT_REFUSED, False)
    assert told.splitlines()[-1].startswith("stiction: ")
    assert why in told.splitlines()[-1]


@pytest.mark.parametrize("has_browser", [True, False])
@pytest.mark.parametrize(
    ("arguments", "url"), [([], "http://127.0.0.1:8000"), (["--url", "http://10.0.0.5:80"], "http://10.0.0.5:80")]
)
def test_the_dashboard_is_opened_or_its_address_printed(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    has_browser: bool,
    arguments: list[str],
    url: str,
) -> None:
    opened: list[str] = []
    monkeypatch.delenv("STICTION_URL", raising=False)
    monkeypatch.setattr(webbrowser, "open", lambda each: opened.append(each) or has_browser)
    with pytest.raises(SystemExit) as end:
        main(["open", *arguments])
    assert end.value.code == 0
    assert opened == [url]
    assert capsys.readouterr().out == ("" if has_browser else f"{url}\n")


@pytest.mark.parametrize(("form", "level"), [("json", "warning"), ("text", "debug")])
def test_a_command_that_serves_logs_as_its_settings_say_and_names_what_is_no_setting(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, form: str, level: str
) -> None:
    configured: list[Any] = []
    monkeypatch.setattr("service.observability.logs.configure", configured.append)
    monkeypatch.setattr("service.processes.freed_memory.keep", lambda: configured.append("keep"))
    monkeypatch.setenv("STICTION_PROT", "80")
    running._prepare(Settings.model_validate({"log_format": form, "log_level": level}))
    assert configured == [Logs(form, level), "keep"]  # type: ignore[arg-type]
    assert caplog.messages == ["STICTION_PROT is set and is no setting; allowed: those of docs/settings.md"]
