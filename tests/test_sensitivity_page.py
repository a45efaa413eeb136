"""Each default is on the sensitivity page by its table's name and its own, or stands here with the reason why not."""

import re
from pathlib import Path

from benchmarks.sensitivity.rows import MODULES as MEASURED_MODULES
from benchmarks.sensitivity.rows import every, rows_on
from tests.test_defaults import MODULES

PAGE = Path(__file__).parents[1] / "docs/sensitivity.md"

WHOLE_TABLES = {
    "CheckOptions": "limits of what is said of a log; tests/slipcore/test_checks.py has each fault on purpose",
    "slipcore.calibration.PRESS": "needs presses with known faults",
    "slipcore.calibration.ESTIMATE": "needs presses with known faults",
    "slipcore.contact.RAMP": "says what is simulated",
    "slipcore.contact.SCHEDULE": "says what is simulated",
    "slipcore.contact.SCENE": "says what is simulated",
    "slipcore.contact.WORLD": "says what is simulated",
    "slipcore.contact.EDGES": "of stress at cells' centres, which no log has; docs/accuracy-contact.md has its errors",
    "slipcore.contact.REFERENCE": "closed forms and solvers that tests compare with",
    "slipcore.forces.FORCE_STREAM": "needs streams with their clock",
    "slipcore.forces.OVER_TIME": "of a way that is taken on request; docs/accuracy-forces.md has what it changes",
    "slipcore.forces.GEL_CALIBRATION": "a fit takes half a minute",
    "slipcore.RECONSTRUCTED_FORCES": "of reconstructed forces, which the page's logs do not have",
    "slipcore.CONTRADICTION": "needs logs with faulty forces; tests/slipcore/detection has them",
    "slipcore.GROSS_SLIP": "compiled kernels hold it fixed; docs/detector.md has what others would do",
    "slipcore.NOISE": "compiled kernels hold it fixed",
    "slipcore.TURNING": "compiled kernels hold it fixed",
    "slipcore.NUMERICS": "compiled kernels hold it fixed",
    "slipcore.contact.PROJECTION": "compiled kernels hold it fixed",
}
"""Tables of which no entry is on the page. What is measured leaves this list, and that below."""

ENTRIES = {
    "slipcore.forces.RECONSTRUCTION": (
        "force_to_noise least_coupling",
        "of friction and slip, which no press gives",
    ),
    "slipcore.forces.RESPONSE": (
        "digits least_change least_distance neighbours plane thicknesses",
        "which offsets are evaluated once, no result; and of gels not alike thick, on which no press on the page is",
    ),
    "slipcore.forces.PRIOR": ("unseen_shear", "of depth alone, which no press on the page has"),
    "slipcore.forces.SUPPORT": ("least_probability", "changes no force, only deviations"),
    "estimators.PRIOR": (
        "contradicted least_velocity_effect",
        "of slip at one speed, which no log on the page has; docs/estimators.md has what it is from",
    ),
    "filter": (
        "force_floor heading_length",
        "0 but of reconstructed forces, which the page's logs do not have",
    ),
    "SampleOptions": ("force_noise", "estimated unless it is given"),
    "slipcore.PATCHES": (
        "descents free_frames free_motion least_known least_square_arm rank settled still",
        "compiled kernels hold them, and least_known words a reason",
    ),
}
"""Entries of other tables that are not on it."""


def test_each_default_is_on_the_sensitivity_page_or_listed_with_the_reason() -> None:
    page = PAGE.read_text(encoding="utf-8")
    parts = re.findall(r"<!-- table ([\w ]+) -->", page)
    told = {(row.table, row.name) for part in parts for row in rows_on(page, part)}
    absent = {key for key in every() if key not in told}
    listed = {key for key in every() if key[0] in WHOLE_TABLES}
    listed |= {(table, name) for table, (names, _) in ENTRIES.items() for name in names.split()}
    assert absent - listed == set(), "measure it by --missing, or say why not"
    assert listed - absent == set(), "it is on the page, or gone"
    assert WHOLE_TABLES.keys() <= {table for table, _ in every()}


def test_the_page_has_no_default_that_is_gone_or_was_another() -> None:
    page = PAGE.read_text(encoding="utf-8")
    rows = re.findall(r"^\| \S+ \| `\w+` \| .+$", page, re.MULTILINE)
    quiet = re.findall(r"^\| \S+ \| (`.+`) \|$", page, re.MULTILINE)
    parts = re.findall(r"<!-- table ([\w ]+) -->", page)
    assert len(rows) + "".join(quiet).count("`") // 2 == sum(len(rows_on(page, part)) for part in parts)


def test_every_package_with_a_table_is_measured() -> None:
    assert MEASURED_MODULES == MODULES
