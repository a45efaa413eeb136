import webbrowser

import pytest

from service.cli import main


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
