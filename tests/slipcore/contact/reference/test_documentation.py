import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "docs/contact-references.md").read_text(encoding="utf-8")


def test_every_closed_form_is_on_the_page() -> None:
    helpers = {"__init__", "checks", "elastic_pair", "ellipsoidal"}
    modules = {path.stem for path in (ROOT / "slipcore/contact/reference").glob("*.py")} - helpers
    missing = [name for name in sorted(modules) if f"`{name}." not in PAGE or f"| `{name}` |" not in PAGE]
    assert not missing


def test_the_code_on_the_page_says_what_it_prints(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(code, {})
    assert capsys.readouterr().out == "0.397 of the contact sticks, the object has moved 0.462 mm\n"
