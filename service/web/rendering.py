"""Templates made into answers: whatever somebody typed is escaped, and a page may load nothing but our own files."""

import re
from functools import cache
from typing import Any
from urllib.parse import quote

from fastapi import Request
from fastapi.responses import HTMLResponse
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from db.records import StoredGraspLog
from service import formatting
from service.domain.sensors.reconstruct import BY_DISPLACEMENT
from service.http.access import EVERYTHING, Access
from service.http.sessions import sent_token
from service.report.wording import findings_heading, record_next
from service.web.assets import path_of
from service.web.labels import label, labelled_detail, named

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'"
)
SWAGGER_UI_POLICY = POLICY.replace("img-src 'self'", "img-src 'self' data:")
"""Swagger UI's style has its pictures inside."""

HEADERS = {"Content-Security-Policy": POLICY, "Referrer-Policy": "same-origin"}
"""Of every page. Without a referrer a browser would not even send where a form comes from (``Origin: null``)."""


def render(request: Request, template: str, status_code: int = 200, **given: Any) -> HTMLResponse:
    """A page; its template sees what is ``given``, who asks, and whether a browser's session lets it."""
    access: Access = getattr(request.state, "access", EVERYTHING)
    page = _environment().get_template(template)
    text = page.render(request=request, access=access, in_session=sent_token(request) is not None, **given)
    return HTMLResponse(text, status_code, HEADERS)


def on_problem(request: Request, template: str, **given: Any) -> None:
    """Show a problem of this request, if one comes, on a page of its own form, so that nobody types it anew."""
    request.state.on_problem = template, given


def has_reconstructed_forces(log: StoredGraspLog) -> bool:
    """Whether forces of a log that was looked at follow from displacement."""
    findings = () if log.detection is None else log.detection.findings or ()
    return any(finding.name in BY_DISPLACEMENT for finding in findings)


def with_code(text: str) -> Markup:
    """Text of ours whose `names` in backticks are set as code; all else is escaped."""
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", str(escape(text))))


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("service.web", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    for filter_ in (formatting.number, formatting.interval, formatting.age, formatting.moment, formatting.size):
        environment.filters[filter_.__name__] = filter_
    environment.filters |= {"grouped": formatting.grouped, "at_least": formatting.at_least}
    environment.filters["record_next"] = record_next
    environment.filters["has_reconstructed_forces"] = has_reconstructed_forces
    environment.filters["segment"] = lambda text: quote(str(text), safe="")
    environment.filters["with_code"] = with_code
    environment.filters["findings_heading"] = findings_heading
    environment.filters |= {"label": label, "named": named, "labelled_detail": labelled_detail}
    environment.globals["asset"] = path_of
    return environment
