"""Pages that show friction at a working point, which their address names and their form asks for."""

from collections.abc import Callable
from typing import Any

from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel

from estimators.method_names import ModelMethod
from service.http.schemas.common import Force, Velocity
from service.web.forms import checked, typed
from service.web.rendering import on_problem, render


class PageQuery(BaseModel):
    """Normal force of an element N and tangential velocity m/s, and whose model answers; None: the usual one."""

    fn: Force | None = None
    v: Velocity | None = None
    method: ModelMethod | None = None

    def typed(self) -> dict[str, str | None]:
        """The same as it stands in a form again."""
        return {"fn": typed(self.fn), "v": typed(self.v), "method": self.method}


def shown_at(request: Request, template: str, show: Callable[[PageQuery], dict[str, Any]], **given: Any) -> Response:
    """The page at the working point that is asked for: a template with what ``show`` gives it there, and ``given``.

    What its form has is in ``asked`` of the first. Where no friction can be asked for there, the page at the usual
    point comes with the problem, so that nobody types the rest anew; raises ``RequestValidationError``.
    """
    fields = {name: text for name, text in request.query_params.items() if name in PageQuery.model_fields}
    try:
        point = checked(PageQuery, fields)
    except RequestValidationError:
        usual = show(PageQuery())
        on_problem(request, template, **usual | {"asked": usual["asked"] | fields}, **given)
        raise
    return render(request, template, **show(point), **given, problem=None)
