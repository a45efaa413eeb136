"""Reports of a log and of a material, made in a reader's process, which alone loads what draws their pictures."""

from collections.abc import Callable, Sequence
from pathlib import Path

from db.records import StoredGraspLog
from service.domain.access.principal import Principal
from service.domain.planning.record_next import RecordNext
from service.domain.resources.context import Context
from service.http.download import Download
from service.web.derived import derive
from stiction_client.records import GraspLogReceipt, Material

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'",
    "Cache-Control": "no-cache",
}
"""A report loads nothing; its style and pictures stand in it, for it is one file."""


async def show(context: Context, principal: Principal, kind: str, write: Callable[[Path], None]) -> Download:
    """The report that ``write``, which can be pickled, writes to a path."""
    return await derive(context, principal, kind, write, headers=HEADERS, media_type="text/html; charset=utf-8")


def write_log(log: StoredGraspLog, history: Path, samples: Path, upload: Path | None, target: Path) -> None:
    """Write the report of a stored log; ``upload`` is None where it was deleted."""
    from service.domain.logs.grasp_report import report_of_stored
    from service.report.page import write_report

    write_report(report_of_stored(log, history, samples, upload), target)


def write_material(material: Material, logs: Sequence[GraspLogReceipt], probe: RecordNext | None, target: Path) -> None:
    """Write the report of a material with the newest of its logs."""
    from service.report import material as report

    report.write_material(material, logs, probe, target)
