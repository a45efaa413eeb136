"""What forms send: text for everything, and nothing for what was left empty."""

from collections import Counter
from collections.abc import Callable, Coroutine, Mapping
from typing import IO, Any, TypeVar
from urllib.parse import parse_qsl

from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, BeforeValidator, ValidationError
from python_multipart.multipart import parse_options_header
from starlette.datastructures import FormData
from starlette.exceptions import HTTPException
from starlette.formparsers import MultiPartException, MultiPartParser
from starlette.requests import ClientDisconnect

from db.text import is_storable
from service.domain.access.networks import network_of
from service.domain.errors import UploadInterrupted, shown
from service.domain.resources.context import Context
from service.http.bodies import MOST_FIELDS, limited, media_type
from service.http.fair_route import FairRoute
from service.ranges import range_at

Shape = TypeVar("Shape", bound=BaseModel)

URL_ENCODED = "application/x-www-form-urlencoded"

MOST_TYPE = 1024
"""Characters of a form's content type, which is parsed in a time that grows with their square."""

NOT_UTF_8 = "the form's text is not in the one charset that is allowed, UTF-8"

SHORT_FORM = 1024
"""Bytes, parsed in 0.2 ms at most."""

EMPTY_IS_NONE = BeforeValidator(lambda text: None if text == "" else text)
"""Of a field that may be left empty."""


def typed(value: float | None) -> str:
    """A number as it stands in a form again; empty for None."""
    return "" if value is None else f"{value:.12g}"


class FormRoute(FairRoute):
    """A route whose form is of bounded size: all of it is parsed before it is asked who sends it."""

    most_bytes = 2**18
    """Without a file; the longest description takes half of that."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler, which receives no more than a form may have."""
        handle = super().get_route_handler()

        async def handle_form(request: Request) -> Response:
            return await handle(_FormRequest(request.scope, limited(request.receive, self.most_bytes)))

        return handle_form


class _FormRequest(Request):
    """A request with a form that has no files; who sends parts that might be some has sent no fields.

    The framework's own parsers take 70 ms for 256 kB of separators or of empty parts, and nobody goes on meanwhile.
    """

    async def form(self, **_: object) -> FormData:  # type: ignore[override]  # no files: nothing is to be closed
        """The fields; raises ``HTTPException`` for more of them than any form has."""
        body = await self.body()
        if media_type(self) != URL_ENCODED:
            return FormData()
        if len(body) <= SHORT_FORM:
            return _fields(body)
        context: Context = self.app.state.context
        owner = f"forms of {network_of(self.client.host) if self.client else ''}"
        return await context.threads.run(owner, _fields, body, is_long=True)  # up to 60 ms, of escapes


def _fields(body: bytes) -> FormData:
    try:
        text = body.decode("latin-1")  # the names and values are in UTF-8, by escapes
        form = FormData([*parse_qsl(text, keep_blank_values=True, errors="replace", max_num_fields=MOST_FIELDS)])
    except ValueError as error:
        raise HTTPException(400, f"the form has more than {MOST_FIELDS} fields") from error
    _check_once(form)
    return form


def _check_once(form: FormData) -> None:
    """Raise ``HTTPException`` for a field that is there twice: of two scales the last would count, without a word."""
    name, times = Counter(name for name, _ in form.multi_items()).most_common(1)[0] if form else ("", 0)
    if times > 1:
        raise HTTPException(400, f"the form has the field {shown(name)} {times} times; allowed: once")


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
    """A form with a file, to be closed; no fields of what is none.

    Raises ``HTTPException`` for a broken one, ``UploadInterrupted`` where the client goes before its end. ``most``:
    ``max_files`` and ``max_fields``.
    """
    if media_type(request) != "multipart/form-data":
        return FormData()
    _check_charset(request.headers["content-type"])
    try:
        form = await _FileParser(request, make_file, **most).parse()
    except MultiPartException as error:
        raise HTTPException(400, error.message) from error
    except ClientDisconnect as error:
        raise UploadInterrupted("the connection ended before the form did") from error
    except UnicodeError as error:
        raise HTTPException(400, NOT_UTF_8) from error
    try:
        _check_once(form)
    except HTTPException:
        await form.close()
        raise
    sent = (text for pair in form.multi_items() for text in pair)
    texts = (each if isinstance(each, str) else each.filename or "" for each in sent)
    if not all(map(is_storable, texts)):
        await form.close()
        raise HTTPException(400, "the form's text has NUL or surrogates; allowed: any text without them")
    return form


def _check_charset(content_type: str) -> None:
    """Raise ``HTTPException`` for another than UTF-8: some codecs take a minute for the text of a field."""
    if len(content_type) > MOST_TYPE:
        raise HTTPException(400, f"the form's content type has more than {MOST_TYPE} characters")
    _, options = parse_options_header(content_type)
    if options.get(b"charset", b"utf-8").lower() not in {b"utf-8", b"utf8"}:
        raise HTTPException(400, NOT_UTF_8)


def checked(shape: type[Shape], fields: Mapping[str, str]) -> Shape:
    """What was sent, in the API's own shape and bounds; raises ``RequestValidationError``."""
    return _checked(shape, shape.model_validate_strings, {name: text for name, text in fields.items() if text != ""})


def revised(shape: type[Shape], values: Mapping[str, Any]) -> Shape:
    """What was sent beside what is kept, alike."""
    return _checked(shape, shape.model_validate, dict(values))


def _checked(shape: type[Shape], validate: Callable[[Any], Shape], values: Mapping[str, Any]) -> Shape:
    try:
        return validate(values)
    except ValidationError as error:
        schema = shape.model_json_schema()
        wrong = [
            {**each, "range": range_at(schema, each["loc"]), "loc": ("form", *each["loc"])} for each in error.errors()
        ]
        raise RequestValidationError(wrong) from error
