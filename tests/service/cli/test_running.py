import os
import subprocess
import sys
import webbrowser
from pathlib import Path

import pytest

from service.cli import main
from service.cli.exit_codes import INPUT_REFUSED


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (["--data-folder", "/proc/x"], "STICTION_DATA_FOLDER (--data-folder) is '/proc/x', which is in a folder that"),
        (["--database-url", "mysql://x/y"], "begins with mysql://; allowed: sqlite:// or postgresql://"),
        (["--host", "nowhere.invalid"], "STICTION_HOST (--host) is 'nowhere.invalid' and STICTION_PORT (--port) 0: "),
        (["--host", "192.0.2.1"], "STICTION_HOST (--host) is '192.0.2.1' and STICTION_PORT (--port) 0: "),
        (
            ["--lookup-port", "0", "--host", "192.0.2.1"],
            "STICTION_LOOKUP_PORT (--lookup-port) is 0, with ",
        ),
    ],
    ids=["folder", "database", "host", "address", "lookup_port"],
)
def test_the_last_line_of_a_refused_start_says_what_is_wrong(tmp_path: Path, wrong: list[str], why: str) -> None:
    environment = os.environ | {
        "STICTION_DATA_FOLDER": str(tmp_path),
        "STICTION_WORKERS": "0",
        "STICTION_ACCESS": "open",
    }
    command = [sys.executable, "-m", "service.cli", "serve", "--port", "0", *wrong]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert (ended.returncode, "Traceback" in ended.stderr) == (INPUT_REFUSED, False)
    assert ended.stderr.splitlines()[-1].startswith("stiction: ")
    assert why in ended.stderr.splitlines()[-1]


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
