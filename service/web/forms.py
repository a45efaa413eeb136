"""What forms send: text for everything, and nothing for what was left empty."""

from collections.abc import Callable, Coroutine, Mapping
from typing import IO, Any, TypeVar

from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, BeforeValidator, ValidationError
from starlette.datastructures import FormData
from starlette.exceptions import HTTPException
from starlette.formparsers import MultiPartException, MultiPartParser
from starlette.types import Message, Receive

from db.text import is_storable
from service.http.bodies import MOST_FIELDS, limited
from service.http.fair_route import FairRoute

Shape = TypeVar("Shape", bound=BaseModel)

EMPTY_IS_NONE = BeforeValidator(lambda text: None if text == "" else text)
"""Of a field that may be left empty."""


class FormRoute(FairRoute):
    """A route whose form is of bounded size: the framework parses all of it before it is asked who sends it."""

    most_bytes = 2**18
    """Without a file; the longest description takes half of that."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler, which receives no more than a form may have."""
        handle = super().get_route_handler()

        async def handle_form(request: Request) -> Response:
            receive = limited(request.receive, self.most_bytes)
            is_plain = request.headers.get("content-type", "").startswith("application/x-www-form-urlencoded")
            return await handle(Request(request.scope, few_fields(receive) if is_plain else receive))

        return handle_form


def few_fields(receive: Receive) -> Receive:
    """What receives a form, and raises ``HTTPException`` for one of more fields than any has: each takes its time."""
    seen = 0

    async def receive_some() -> Message:
        nonlocal seen
        message = await receive()
        seen += message.get("body", b"").count(b"&")
        if seen >= MOST_FIELDS:
            raise HTTPException(400, f"the form has more than {MOST_FIELDS} fields")
        return message

    return receive_some


class _FileParser(MultiPartParser):
    """Reads a form whose files are kept in those that ``make_file`` gives; by itself in the system's folder."""

    def __init__(self, request: Request, make_file: Callable[[], IO[bytes]], **most: int) -> None:
        super().__init__(request.headers, request.stream(), **most)
        self._make_file = make_file

    def on_headers_finished(self) -> None:
        """Begin a part."""
        super().on_headers_finished()
        if (upload := self._current_part.file) is not None:
            upload.file.close()
            upload.file = self._make_file()  # type: ignore[assignment]  # the same methods
            self._files_to_close_on_error.append(upload.file)  # type: ignore[arg-type]


async def read_form(request: Request, make_file: Callable[[], IO[bytes]], **most: int) -> FormData:
    """A form with a file, to be closed; no fields of what is none. Raises ``HTTPException`` for a broken one.

    ``most``: ``max_files`` and ``max_fields``.
    """
    if not request.headers.get("content-type", "").startswith("multipart/form-data"):
        return FormData()
    try:
        form = await _FileParser(request, make_file, **most).parse()
    except MultiPartException as error:
        raise HTTPException(400, error.message) from error
    except (LookupError, UnicodeError) as error:
        raise HTTPException(400, "the form's text is not in the charset that it names; allowed: UTF-8") from error
    sent = (text for pair in form.multi_items() for text in pair)
    texts = (each if isinstance(each, str) else each.filename or "" for each in sent)
    if not all(map(is_storable, texts)):
        await form.close()
        raise HTTPException(400, "the form's text has NUL or surrogates; allowed: any text without them")
    return form


def checked(shape: type[Shape], fields: Mapping[str, str]) -> Shape:
    """What was sent, in the API's own shape and bounds; raises ``RequestValidationError``."""
    try:
        return shape.model_validate_strings({name: text for name, text in fields.items() if text != ""})
    except ValidationError as error:
        wrong = [{**each, "loc": ("form", *each["loc"])} for each in error.errors()]
        raise RequestValidationError(wrong) from error
