"""64 bytes of numbers at a time, in compiled code: ``count(array)`` is eight of double or sixteen of single precision.

``load(array, index)`` takes as many numbers of a flat array, ``store`` puts them back; sums, differences and products
are of each of them with each of as many others, or with one number. The compiler always turns them into the machine's
vector instructions; loops over arrays that might overlap it leaves as they are.
"""

import operator
from collections.abc import Callable
from typing import Any

from numba import types
from numba.core.cgutils import ir  # llvmlite's, as numba has it
from numba.core.datamodel import models, register_default
from numba.core.errors import TypingError
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

BYTES = 64
"""Of the numbers taken at a time: the widest vectors that machines have; others split them."""
_VECTORS = {
    types.float64: ir.VectorType(ir.DoubleType(), BYTES // 8),
    types.float32: ir.VectorType(ir.FloatType(), BYTES // 4),
}
_OPERATIONS = {operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul"}


class _LanesType(types.Type):  # type: ignore[misc]
    def __init__(self, number: Any) -> None:
        self.number = number
        super().__init__(name=f"Lanes({number})")


@register_default(_LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: _LanesType) -> None:
        super().__init__(manager, kind, _VECTORS[kind.number])


_LANES = {number: _LanesType(number) for number in _VECTORS}


def _permuted(builder: Any, first: Any, second: Any, order: list[int]) -> Any:
    """Those of the numbers of two vectors that ``order``, as long as one of them, names."""
    return builder.shuffle_vector(first, second, ir.Constant(ir.VectorType(ir.IntType(32), len(order)), order))


def _operation(function: Callable[..., Any], name: str) -> None:
    """Compile an operator for two vectors, and for a vector and one number."""
    cases = [signature(lanes, lanes, other) for lanes in _LANES.values() for other in (lanes, types.float64)]
    infer_global(function)(type(f"Lanes{name}", (ConcreteTemplate,), {"cases": cases}))

    def of_two(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return getattr(builder, name)(*arguments, flags=("contract",))

    def of_one(context: Any, builder: Any, kinds: Any, arguments: Any) -> Any:
        vector = _VECTORS[kinds.args[0].number]
        number = context.cast(builder, arguments[1], types.float64, kinds.args[0].number)
        anything = ir.Constant(vector, ir.Undefined)
        lane = builder.insert_element(anything, number, ir.Constant(ir.IntType(32), 0))
        return of_two(context, builder, kinds, (arguments[0], _permuted(builder, lane, anything, [0] * vector.count)))

    for lanes in _LANES.values():
        lower_builtin(function, lanes, lanes)(of_two)
        lower_builtin(function, lanes, types.float64)(of_one)


for _function, _name in _OPERATIONS.items():
    _operation(_function, _name)


def _check(array: Any) -> None:
    if not isinstance(array, types.Array) or (array.ndim, array.layout) != (1, "C") or array.dtype not in _VECTORS:
        raise TypingError(f"lanes of {array}; allowed: a contiguous array [n] of float64 or float32")


def _place(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    first = builder.gep(make_array(kind)(context, builder, array).data, [index])
    return builder.bitcast(first, _VECTORS[kind.dtype].as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def count(_typing: Any, array: Any) -> Any:
    """``count(array)``: how many numbers of an array [n] are taken at a time."""

    _check(array)

    def number(context: Any, _builder: Any, _kinds: Any, _arguments: Any) -> Any:
        return context.get_constant(types.intp, _VECTORS[array.dtype].count)

    return types.intp(array), number


@intrinsic  # type: ignore[untyped-decorator]
def load(_typing: Any, array: Any, _index: Any) -> Any:
    """``load(array, index)``: numbers of a contiguous array [n], from an index on; bounds are not checked."""

    _check(array)

    def read(context: Any, builder: Any, kinds: Any, arguments: Any) -> Any:
        return builder.load(_place(context, builder, kinds.args[0], *arguments), align=4)

    return _LANES[array.dtype](array, types.intp), read


@intrinsic  # type: ignore[untyped-decorator]
def store(_typing: Any, array: Any, _index: Any, _lanes: Any) -> Any:
    """``store(array, index, lanes)``: put numbers into a contiguous array [n]; bounds are not checked."""

    _check(array)

    def write(context: Any, builder: Any, kinds: Any, arguments: Any) -> Any:
        builder.store(arguments[2], _place(context, builder, kinds.args[0], *arguments[:2]), align=4)
        return context.get_dummy_value()

    return types.void(array, types.intp, _LANES[array.dtype]), write


@intrinsic  # type: ignore[untyped-decorator]
def transpose(_typing: Any, array: Any, _index: Any) -> Any:
    """``transpose(array, index)``: let the rows and columns of a square of numbers from an index on change places.

    In blocks of 1, 2, 4 and so on numbers in turn.
    """

    _check(array)
    number = _VECTORS[array.dtype].count

    def exchange(context: Any, builder: Any, kinds: Any, arguments: Any) -> Any:
        first = _place(context, builder, kinds.args[0], *arguments)
        places = [builder.gep(first, [ir.Constant(ir.IntType(64), row)]) for row in range(number)]
        rows = [builder.load(place, align=4) for place in places]
        for size in (1 << bit for bit in range(number.bit_length() - 1)):
            kept = [lane if not lane & size else lane + number - size for lane in range(number)]
            moved = [lane + size if not lane & size else lane + number for lane in range(number)]
            for row in (row for row in range(number) if not row & size):
                pair = rows[row], rows[row + size]
                rows[row], rows[row + size] = (_permuted(builder, *pair, order) for order in (kept, moved))
        for row, place in zip(rows, places, strict=True):
            builder.store(row, place, align=4)
        return context.get_dummy_value()

    return types.void(array, types.intp), exchange
