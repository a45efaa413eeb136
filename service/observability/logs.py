"""The log: one line a record, as text or as JSON, of the server and of its worker processes alike."""

import logging
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, datetime
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import msgspec

if TYPE_CHECKING:
    from service.settings import LogFormat, LogLevel

ABOUT: ContextVar[Mapping[str, object]] = ContextVar("about", default=MappingProxyType({}))
"""What is going on here, a request or a job: fields of every record that is written meanwhile."""

_SECRET = re.compile(r"(stiction_[0-9a-f]{12}_)[0-9a-f]{64}|(://[^\s:/@]*:)\S*(?=@)")
"""Access keys, and passwords in URLs. Nothing is to log either; should it happen, the log still has neither."""


@dataclass(frozen=True, slots=True)
class Logs:
    """How a process writes its log: each record as ``format``, those of ``level`` or above."""

    format: "LogFormat" = "text"
    level: "LogLevel" = "info"


_chosen: Logs | None = None


def configure(chosen: Logs | None) -> None:
    """Let this process write its log so, to standard error; with None, leave that to whoever else does.

    Libraries say what they do in more detail than a log that is kept should have: theirs begins at warnings, the
    web server's at what it does.
    """
    global _chosen
    if chosen is None:
        return
    _chosen = chosen
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines() if chosen.format == "json" else TextLines())
    level = logging.getLevelNamesMapping()[chosen.level.upper()]
    logging.basicConfig(level=max(level, logging.WARNING), handlers=[handler], force=True)
    logging.captureWarnings(True)
    for name, least in {"service": logging.DEBUG, "db": logging.DEBUG, "uvicorn": logging.INFO}.items():
        logging.getLogger(name).setLevel(max(level, least))


def current() -> Logs | None:
    """What was configured here, for processes that this one starts."""
    return _chosen


@contextmanager
def log_context(**fields: object) -> Iterator[None]:
    """Meanwhile, give every record these fields, and those of ``note``."""
    token = ABOUT.set({**ABOUT.get(), **fields})
    try:
        yield
    finally:
        ABOUT.reset(token)


def note(**fields: object) -> None:
    """Give every record these fields, until the end of what ``log_context`` has begun."""
    ABOUT.set({**ABOUT.get(), **fields})


def of(**fields: object) -> dict[str, Any]:
    """The ``extra`` of one record that has these fields."""
    return {"about": fields}


class JsonLines(logging.Formatter):
    """Each record as one JSON object."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as a line."""
        fields = {
            "time": _moment(record),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": _safe(record.getMessage()),
            **ABOUT.get(),
            **getattr(record, "about", {}),
            "process": record.process,
        }
        trace = _trace(self, record)
        if trace:
            fields["exception"] = trace
        return msgspec.json.encode(fields).decode()


class TextLines(logging.Formatter):
    """Each record as a line to be read, with the traceback of an exception in lines of its own."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as text."""
        message = _safe(record.getMessage()).replace("\r", "\\r").replace("\n", "\\n")  # a line is not to be forged
        fields = {**ABOUT.get(), **getattr(record, "about", {})}
        extra = "".join(f" {name}={value}" for name, value in fields.items())
        trace = _trace(self, record)
        line = f"{_moment(record)} {record.levelname} {record.name}: {message}{extra}"
        return f"{line}\n{trace}" if trace else line


def _moment(record: logging.LogRecord) -> str:
    """In UTC, as RFC 3339 has it."""
    return datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")[:-6] + "Z"


def _trace(formatter: logging.Formatter, record: logging.LogRecord) -> str:
    parts = [formatter.formatException(record.exc_info)] if record.exc_info and record.exc_info[0] else []
    if record.stack_info:
        parts.append(formatter.formatStack(record.stack_info))
    return _safe("\n".join(parts))


def _safe(text: str) -> str:
    """Without secrets, and without what is no Unicode, such as parts of other systems' file names."""
    if "://" in text or "stiction_" in text:
        text = _SECRET.sub(r"\1\2***", text)
    return text if text.isascii() else text.encode(errors="backslashreplace").decode()
