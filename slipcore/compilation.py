"""Compile loops over plain arrays to machine code, and keep what was compiled for the next process.

A kernel is kept in one place: under the folder of numba's own variable ``NUMBA_CACHE_DIR`` if it is set, else in the
``__pycache__`` beside its module. It counts as long as its source file and all files of ours that this one imports,
directly or not, have the same content: numba itself looks only at the file that a kernel is in, and would run on with
an old value of a constant from another. A folder that may only be read, or a damaged file, costs time and no more.

Whoever may write in that folder decides what runs here: only the service's own user should.
"""

import hashlib
import re
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast, overload

from numba import njit, typeof
from numba._dispatcher import compute_fingerprint
from numba.core import cgutils, config, types
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.compiler import Compiler
from numba.core.errors import TypingError
from numba.extending import get_cython_function_address, intrinsic
from numba.extending import overload as numba_overload
from numba.np import arrayobj

_IMPORT = re.compile(r"^\s*(?:from\s+(\S+)\s+import\s+(\([^)]*\)|[^\n#]*)|import\s+([^\n#]*))", re.MULTILINE)

_TYPES: dict[bytes, tuple[Any, ...]] = {}
"""Of arguments, by what numba tells them by."""

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


@intrinsic  # type: ignore[untyped-decorator]
def unpack(_typing: Any, array: Any, size: Any) -> Any:
    """``unpack(array, size)``: its first values as arguments, in compiled code; ``size`` is a constant there.

    As numba's own ``to_fixed_tuple``, but only what is used of the values is read, at once from where it stands: that
    one goes through the whole tuple for each of them, 0.6 µs for the fifty settings of the filter.
    """
    if not isinstance(size, types.IntegerLiteral) or array.ndim != 1 or array.layout != "C":
        raise TypingError(f"unpack of {array} by {size}; allowed: a contiguous array [k] and a constant")
    values = types.UniTuple(array.dtype, size.literal_value)  # type: ignore[attr-defined]

    def read(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        first = arrayobj.make_array(array)(context, builder, arguments[0]).data
        places = [builder.gep(first, [context.get_constant(types.intp, k)]) for k in range(values.count)]
        return context.make_tuple(builder, values, [context.unpack_value(builder, array.dtype, at) for at in places])

    return values(array, size), read


@intrinsic  # type: ignore[untyped-decorator]
def borrowed(_typing: Any, value: Any) -> Any:
    """``borrowed(value)``: an array, or a tuple with arrays at any depth, whose references are not counted.

    Counting is an atomic operation wherever an array is taken from a tuple or handed on, hundreds for a frame. Without
    it the array must outlive all uses of what is borrowed, and nothing of that may be returned to Python: so borrow
    what the caller holds, as Python does the arguments of a kernel, and nothing that was allocated in compiled code.
    """

    def borrow(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _uncounted(context, builder, signature.return_type, arguments[0])

    return value(value), borrow


@intrinsic  # type: ignore[untyped-decorator]
def call_at(typing: Any, _address: Any, kernel: Any, arguments: Any) -> Any:
    """``call_at(address, kernel, arguments)``: what a kernel returns for a tuple of arguments, in compiled code;
    ``address_of`` says where that one is, and it takes and returns the same types as the one that is named.

    A kernel that calls another by its name is compiled together with all of that once more.
    """
    called = kernel.get_call_type(typing, arguments.types, {})

    def call(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        function = context.call_conv.get_function_type(called.return_type, called.args)
        pointer = builder.inttoptr(values[0], function.as_pointer())
        parts = cgutils.unpack_tuple(builder, values[2])
        status, result = context.call_conv.call_function(builder, pointer, called.return_type, called.args, parts)
        with cgutils.if_unlikely(builder, status.is_error):
            context.call_conv.return_status_propagate(builder, status)
        return result

    return called.return_type(types.intp, kernel, arguments), call


def address_of(kernel: Any, *arguments: Any) -> int:
    """Where in memory a kernel is for arguments of these types, for ``call_at``."""
    known = compute_fingerprint(arguments)  # 2 µs; to name the types of fifty arrays takes half a millisecond
    if known not in _TYPES:
        _TYPES[known] = tuple(typeof(each) for each in arguments)
    if _TYPES[known] not in kernel.overloads:
        kernel.compile(_TYPES[known])
    found = kernel.overloads[_TYPES[known]]
    return int(found.library.get_pointer_to_function(found.fndesc.llvm_func_name))


def _uncounted(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """The value of this type with no owner of its memory named, in LLVM."""
    if isinstance(kind, types.BaseTuple):  # type: ignore[attr-defined]
        parts = cgutils.unpack_tuple(builder, value)
        return context.make_tuple(
            builder, kind, [_uncounted(context, builder, *part) for part in zip(kind, parts, strict=True)]
        )
    if isinstance(kind, types.Array):
        array = arrayobj.make_array(kind)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    return value


@overload
def compiled(function: Kernel, /) -> Kernel: ...
@overload
def compiled(*, fastmath: set[str] | bool = False, inline: bool = False) -> Callable[[Kernel], Kernel]: ...
def compiled(function: Kernel | None = None, /, *, fastmath: set[str] | bool = False, inline: bool = False) -> Any:
    """Compile a function at its first call for given types; a division by zero is as IEEE 754 has it.

    ``fastmath`` names the liberties that LLVM may take with sums and products. With ``inline`` the function becomes
    part of those that call it: tuples of many arrays or numbers are otherwise handed on word by word, 0.1 to 0.2 µs a
    call, which is more than what is done with them where elements are few.
    """
    return _compile(fastmath, inline)(function) if function else _compile(fastmath, inline)


def _compile(fastmath: set[str] | bool, inline: bool) -> Callable[[Kernel], Kernel]:
    def decorate(function: Kernel) -> Kernel:
        options = {"error_model": "numpy", "fastmath": fastmath, "forceinline": inline, "no_cfunc_wrapper": True}
        kernel: Any = njit(pipeline_class=_Compiler, **options)(function)
        if not config.DISABLE_JIT:
            kernel._cache = _KernelCache(function)
        return cast("Kernel", kernel)

    return decorate


class _Compiler(Compiler):  # type: ignore[misc]
    """Lets a kernel say of arrays with unequal shapes in ``target[:] = values`` no more than that they are unequal.

    What numba says, with both shapes, is put together by functions for text that LLVM would optimise in each kernel
    with such a line and in all that call it: a third of all that there was to compile.
    """

    def _compile_bytecode(self) -> Any:
        numbas = getattr(arrayobj, "raise_with_shape_context", None)
        if numbas is None:  # a numba that says it in another way compiles as it does
            return super()._compile_bytecode()
        arrayobj.raise_with_shape_context = _refuse_shapes
        try:
            return super()._compile_bytecode()
        finally:
            arrayobj.raise_with_shape_context = numbas


def _refuse_shapes(_values: Any, _target: Any) -> None:
    """In compiled code, of both shapes."""


@numba_overload(_refuse_shapes)  # type: ignore[untyped-decorator]
def _refuse(_values: Any, _target: Any) -> Callable[[Any, Any], None]:
    def refuse(_values: Any, _target: Any) -> None:
        raise ValueError("arrays of unequal shapes")

    return refuse


class _Locator:
    """Where numba keeps a kernel, and what its file is named; see ``numba.core.caching._CacheLocator``."""

    def __init__(self, file: Path) -> None:
        self._file = file

    @classmethod
    def from_function(cls, _function: Callable[..., Any], file: str) -> "_Locator":
        return cls(Path(file).resolve())

    def get_cache_path(self) -> str:
        if config.CACHE_DIR:
            return str(Path(config.CACHE_DIR, self._file.parent.relative_to(_root(self._file))))
        return str(self._file.parent / "__pycache__")

    def ensure_cache_path(self) -> None:
        Path(self.get_cache_path()).mkdir(parents=True, exist_ok=True)

    def get_disambiguator(self) -> str:
        return fingerprint(self._file)

    def get_source_stamp(self) -> str:
        return fingerprint(self._file)


class _Implementation(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = [_Locator]  # noqa: RUF012 - as the base class has it


class _KernelCache(FunctionCache):  # type: ignore[misc]
    """Keeps one kernel. No fault of the folder stops it: what cannot be loaded is compiled."""

    _impl_class = _Implementation

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # a damaged file can raise anything while it is unpickled
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
            self._forget_stale()
        except OSError as error:
            warnings.warn(
                f"compiled kernels cannot be kept, so that each process compiles them anew: {error}; "
                "allowed: NUMBA_CACHE_DIR names a folder that this user may write",
                RuntimeWarning,
                stacklevel=2,
            )

    def _forget_stale(self) -> None:
        """Delete what was compiled of this kernel from other sources."""
        base = self._impl.filename_base
        name, current = base.split("-")[0], f"{base}."
        for file in Path(self.cache_path).glob(f"{name}-*.nb[ic]"):
            if not file.name.startswith(current):
                file.unlink(missing_ok=True)


@cache
def fingerprint(file: Path) -> str:
    """What the content of a source file, and of ours that it imports directly or not, is known by."""
    root, digest = _root(file), hashlib.sha256()
    for source in sorted(_with_imports(file)):
        digest.update(source.relative_to(root).as_posix().encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _root(file: Path) -> Path:
    """The folder that the top package of a source file stands in."""
    folder = file.parent
    while (folder / "__init__.py").is_file():
        folder = folder.parent
    return folder


def _with_imports(file: Path) -> set[Path]:
    found, waiting = set[Path](), [file]
    while waiting:
        source = waiting.pop()
        if source not in found:
            found.add(source)
            waiting += _imports(source)
    return found


@cache
def _imports(file: Path) -> list[Path]:
    """The files of the same package, or of this one, that a file imports, at its top or anywhere in it."""
    root = _root(file)
    own = {file.relative_to(root).parts[0], __name__.split(".")[0]}
    modules = [
        f"{module}.{name.split()[0]}" if module else name.split()[0]
        for module, names, plain in _IMPORT.findall(file.read_text(encoding="utf-8"))
        for name in re.split(r"[(),]", names or plain)
        if name.strip()
    ]
    return [source for module in modules if module.split(".")[0] in own and (source := _source(root, module))]


def _source(root: Path, module: str) -> Path | None:
    """The source file of a module, or of the one that ``module`` is a name in."""
    for path in (root.joinpath(*module.split(".")), root.joinpath(*module.split(".")[:-1])):
        for source in (path.with_suffix(".py"), path / "__init__.py"):
            if source.is_file():
                return source
    return None


def lapack_address(name: str) -> int:
    """Where a routine of SciPy's LAPACK is, of which arguments are addresses as Fortran has them."""
    return int(get_cython_function_address("scipy.linalg.cython_lapack", name))
