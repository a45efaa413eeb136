"""A plugin of pytest: how long each test took, and which test a process was started by.

Processes that a test starts measure coverage as well (``patch = ["subprocess"]``), under the name that stands in their
environment. Loaded by ``-p benchmarks.mutants.recorder``; durations go to the file that ``TEST_DURATIONS`` names.
"""

import json
import os
from collections import defaultdict
from pathlib import Path

import pytest

durations: dict[str, float] = defaultdict(float)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let processes that the test starts name it."""
    plugin = item.config.pluginmanager.getplugin("_cov")
    if plugin is None or plugin.cov_controller is None or "COVERAGE_PROCESS_CONFIG" not in os.environ:
        return
    config = plugin.cov_controller.cov.config
    own, config.context = config.context, f"{item.nodeid}|process"
    os.environ["COVERAGE_PROCESS_CONFIG"] = config.serialize()
    config.context = own


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up set-up, call and tear-down."""
    durations[report.nodeid] += report.duration


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write down what all workers reported."""
    if not hasattr(session.config, "workerinput"):
        path = Path(os.environ["TEST_DURATIONS"])
        known = json.loads(path.read_text()) if path.exists() else {}
        path.write_text(json.dumps(known | durations, indent=0))
