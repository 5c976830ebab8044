"""Arithmetic on one 32-bit number or on LANES of them at once.

numba widens what it computes from two int32 to 64 bits, which halves what a SIMD register holds; it leaves to chance
which loops become SIMD code; and its sums are either slow or in an order that depends on the machine.  So kernels that
count compute on `Lanes`, a value of LANES numbers that LLVM maps to the registers there are: one of AVX-512, two of
AVX2, four of NEON.  The functions here take single numbers as well, so that each formula is written once.

Integers wrap around.  Lanes of float32 have the operators + - * and <; the rest has names.
"""

import operator
from collections.abc import Callable

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, overload, register_model

from rfiddesign.numerics._compile_kernels import inline_kernel

LANES = 16
_WORD, _LENGTH, _FLOAT = ir.IntType(32), ir.IntType(64), ir.FloatType()
_ELEMENTS = {types.float32: _FLOAT, types.int32: _WORD, types.uint32: _WORD, types.boolean: ir.IntType(1)}


class Lanes(types.Type):
    """LANES numbers of one type."""

    def __init__(self, element: types.Type):
        self.element = element
        super().__init__(f"Lanes({element})")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager, lanes_type):
        super().__init__(manager, lanes_type, ir.VectorType(_ELEMENTS[lanes_type.element], LANES))


def _element(numba_type):
    return numba_type.element if isinstance(numba_type, Lanes) else numba_type


def _like(numba_type, element):
    """`element`, in lanes if the type has lanes."""
    return Lanes(element) if isinstance(numba_type, Lanes) else element


def _splat(builder, value):
    vector = ir.VectorType(value.type, LANES)
    first = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_WORD, 0))
    return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(_WORD, LANES), [0] * LANES))


def _operation(build: Callable, kinds: tuple[types.Type, ...], n_arguments: int, result: types.Type | None = None):
    """An operation that `build(builder, *values)` computes; the type of the first argument or `result`.

    Arguments are of the kind of the first, or numbers that are cast to it; a number meets lanes as LANES copies.
    """

    def typed(arguments):
        elements = [_element(each) for each in arguments]
        leading = next((each.element for each in arguments if isinstance(each, Lanes)), elements[0])
        if leading not in kinds or not all(isinstance(each, types.Number | types.Boolean) for each in elements):
            return None
        shape = next((each for each in arguments if isinstance(each, Lanes)), leading)
        asked = tuple(each if isinstance(each, Lanes) else leading for each in arguments)

        def codegen(context, builder, signature, values):
            lanes = [
                _splat(builder, value) if isinstance(shape, Lanes) and not isinstance(each, Lanes) else value
                for each, value in zip(asked, values, strict=True)
            ]
            return build(builder, *lanes)

        return _like(shape, result or leading)(*asked), codegen

    if n_arguments == 1:
        return intrinsic(lambda typingctx, a: typed((a,)))
    if n_arguments == 2:
        return intrinsic(lambda typingctx, a, b: typed((a, b)))
    return intrinsic(lambda typingctx, a, b, c: typed((a, b, c)))


_INTEGERS, _FLOATS, _NUMBERS = (types.int32, types.uint32), (types.float32,), (types.float32, types.int32, types.uint32)

add = _operation(lambda builder, a, b: builder.fadd(a, b) if _is_float(a) else builder.add(a, b), _NUMBERS, 2)
subtract = _operation(lambda builder, a, b: builder.sub(a, b), _INTEGERS, 2)
multiply = _operation(lambda builder, a, b: builder.mul(a, b), _INTEGERS, 2)
both = _operation(lambda builder, a, b: builder.and_(a, b), (*_INTEGERS, types.boolean), 2)
either = _operation(lambda builder, a, b: builder.or_(a, b), _INTEGERS, 2)
differ = _operation(lambda builder, a, b: builder.xor(a, b), _INTEGERS, 2)
shift_left = _operation(lambda builder, a, b: builder.shl(a, b), _INTEGERS, 2)
shift_right = _operation(lambda builder, a, b: builder.lshr(a, b), _INTEGERS, 2)
is_at_least = _operation(lambda builder, a, b: builder.icmp_signed(">=", a, b), _INTEGERS, 2, types.boolean)
# a * b + c, rounded once: the same bits on every machine, one instruction on those with FMA.
fma = _operation(lambda builder, a, b, c: _library(builder, "fma", a, b, c), _FLOATS, 3)
bits_of = _operation(lambda builder, a: builder.bitcast(a, _shaped(a, _WORD)), _FLOATS, 1, types.int32)
float_of = _operation(lambda builder, a: builder.bitcast(a, _shaped(a, _FLOAT)), _INTEGERS, 1, types.float32)
to_float = _operation(lambda builder, a: builder.sitofp(a, _shaped(a, _FLOAT)), (types.int32,), 1, types.float32)
to_integer = _operation(lambda builder, a: builder.fptosi(a, _shaped(a, _WORD)), _FLOATS, 1, types.int32)
signed = _operation(lambda builder, a: a, _INTEGERS, 1, types.int32)
square_root = _operation(lambda builder, a: _library(builder, "sqrt", a), _FLOATS, 1)
whole_part = _operation(lambda builder, a: _library(builder, "floor", a), _FLOATS, 1)
size = _operation(lambda builder, a: _library(builder, "fabs", a), _FLOATS, 1)
lesser = _operation(lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b), _FLOATS, 2)
greater = _operation(lambda builder, a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b), _FLOATS, 2)


def _is_float(value):
    return value.type == _shaped(value, _FLOAT)


def _shaped(value, element):
    return ir.VectorType(element, value.type.count) if isinstance(value.type, ir.VectorType) else element


def _library(builder, name, *values):
    of = values[0].type
    suffix = f"v{LANES}f32" if isinstance(of, ir.VectorType) else "f32"
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(of, [of] * len(values)), f"llvm.{name}.{suffix}"
    )
    return builder.call(function, values)


def _float_operator(python_operator: Callable, build: Callable, n_arguments: int = 2, result=None):
    instruction = _operation(build, _FLOATS, n_arguments, result)
    if n_arguments == 1:

        @overload(python_operator, inline="always")
        def of_one(a):
            return (lambda a: instruction(a)) if isinstance(a, Lanes) else None

        return

    @overload(python_operator, inline="always")
    def of_two(a, b):
        return (lambda a, b: instruction(a, b)) if isinstance(a, Lanes) or isinstance(b, Lanes) else None


_float_operator(operator.add, lambda builder, a, b: builder.fadd(a, b))
_float_operator(operator.sub, lambda builder, a, b: builder.fsub(a, b))
_float_operator(operator.mul, lambda builder, a, b: builder.fmul(a, b))
_float_operator(operator.neg, lambda builder, a: builder.fneg(a), 1)
_float_operator(operator.lt, lambda builder, a, b: builder.fcmp_ordered("<", a, b), 2, types.boolean)


@intrinsic
def choose(typingctx, condition, first, second):
    """`first` where the condition holds, else `second`; numbers meet lanes as copies."""
    if _element(condition) is not types.boolean:
        return None
    element = next((each.element for each in (first, second) if isinstance(each, Lanes)), first)
    asked = [each if isinstance(each, Lanes) else element for each in (first, second)]

    def codegen(context, builder, signature, values):
        lanes = [
            _splat(builder, value) if isinstance(condition, Lanes) and not isinstance(each, Lanes) else value
            for each, value in zip(asked, values[1:], strict=True)
        ]
        return builder.select(values[0], *lanes)

    return _like(condition, element)(condition, *asked), codegen


@intrinsic
def copies(typingctx, value):
    """LANES copies of a number."""
    if value not in _ELEMENTS:
        return None
    return Lanes(value)(value), lambda context, builder, signature, values: _splat(builder, values[0])


@intrinsic
def count_up(typingctx, first):
    """first, first + 1, ...: int32 or uint32."""
    if first not in _INTEGERS:
        return None
    steps = ir.Constant(ir.VectorType(_WORD, LANES), list(range(LANES)))
    return Lanes(first)(first), lambda context, builder, signature, values: builder.add(
        _splat(builder, values[0]), steps
    )


def _address(context, builder, array_type, array, place):
    data = builder.gep(context.make_array(array_type)(context, builder, array).data, [place])
    return builder.bitcast(data, ir.VectorType(_ELEMENTS[array_type.dtype], LANES).as_pointer())


@intrinsic
def load(typingctx, array, place):
    """LANES numbers of a contiguous array from `place` on; bounds are the caller's."""
    if not isinstance(array, types.Array) or array.dtype not in _NUMBERS:
        return None

    def codegen(context, builder, signature, values):
        return builder.load(_address(context, builder, array, *values), align=4)

    return Lanes(array.dtype)(array, types.intp), codegen


@intrinsic
def store(typingctx, array, place, lanes):
    """The inverse of `load`."""
    if not isinstance(array, types.Array) or not isinstance(lanes, Lanes) or array.dtype is not lanes.element:
        return None

    def codegen(context, builder, signature, values):
        builder.store(values[2], _address(context, builder, array, *values[:2]), align=4)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), codegen


@intrinsic
def store_chosen(typingctx, array, place, lanes, condition):
    """Store those lanes for which the condition holds side by side from `place` on; garbage follows up to LANES."""
    if not isinstance(array, types.Array) or not isinstance(lanes, Lanes) or array.dtype is not lanes.element:
        return None

    def codegen(context, builder, signature, values):
        target = _address(context, builder, array, *values[:2])
        # As integers: where the processor has no such instruction, LLVM 22 fails to build one for floats.
        words = ir.VectorType(_WORD, LANES)
        compress = cgutils.get_or_insert_function(
            builder.module,
            ir.FunctionType(words, [words, values[3].type, words]),
            f"llvm.experimental.vector.compress.v{LANES}i32",
        )
        chosen = builder.call(compress, [builder.bitcast(values[2], words), values[3], ir.Constant(words, None)])
        builder.store(chosen, builder.bitcast(target, words.as_pointer()), align=4)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes, condition), codegen


@intrinsic
def look_up(typingctx, array, places):
    """The numbers of a contiguous array of float32 at flat places (int32 lanes); bounds are the caller's."""
    if not isinstance(array, types.Array) or array.dtype is not types.float32 or not isinstance(places, Lanes):
        return None

    def codegen(context, builder, signature, values):
        data = context.make_array(array)(context, builder, values[0]).data
        found = ir.Constant(ir.VectorType(_FLOAT, LANES), ir.Undefined)
        for k in range(LANES):
            place = builder.sext(builder.extract_element(values[1], ir.Constant(_WORD, k)), _LENGTH)
            found = builder.insert_element(found, builder.load(builder.gep(data, [place])), ir.Constant(_WORD, k))
        return found

    return Lanes(types.float32)(array, places), codegen


@intrinsic
def how_many(typingctx, condition):
    """For how many lanes the condition holds."""
    if not isinstance(condition, Lanes) or condition.element is not types.boolean:
        return None

    def codegen(context, builder, signature, values):
        return builder.zext(builder.ctpop(builder.bitcast(values[0], ir.IntType(LANES))), _LENGTH)

    return types.intp(condition), codegen


@intrinsic
def _half(typingctx, lanes, step):
    """Each lane's partner `step` (a literal) lanes further on, around the end."""
    if not isinstance(lanes, Lanes) or not isinstance(step, types.IntegerLiteral):
        return None
    order = ir.Constant(ir.VectorType(_WORD, LANES), [(k + step.literal_value) % LANES for k in range(LANES)])
    return lanes(lanes, step), lambda context, builder, signature, values: builder.shuffle_vector(
        values[0], values[0], order
    )


@intrinsic
def _first(typingctx, lanes):
    if not isinstance(lanes, Lanes):
        return None
    return lanes.element(lanes), lambda context, builder, signature, values: builder.extract_element(
        values[0], ir.Constant(_WORD, 0)
    )


@intrinsic
def _behind(typingctx, lanes, step):
    """For each lane the one `step` (a literal) lanes before it, 0 where there is none."""
    if not isinstance(lanes, Lanes) or not isinstance(step, types.IntegerLiteral):
        return None
    order = ir.Constant(ir.VectorType(_WORD, LANES), [LANES - step.literal_value + k for k in range(LANES)])

    def codegen(context, builder, signature, values):
        return builder.shuffle_vector(ir.Constant(values[0].type, None), values[0], order)

    return lanes(lanes, step), codegen


@inline_kernel
def running_sums(lanes):
    """Sum of each lane (integers) and all before it."""
    lanes = add(lanes, _behind(lanes, 1))
    lanes = add(lanes, _behind(lanes, 2))
    lanes = add(lanes, _behind(lanes, 4))
    return add(lanes, _behind(lanes, 8))


@inline_kernel
def total(lanes):
    """Sum of the lanes, by halves: the same bits on every machine."""
    lanes = add(lanes, _half(lanes, 8))
    lanes = add(lanes, _half(lanes, 4))
    lanes = add(lanes, _half(lanes, 2))
    return _first(add(lanes, _half(lanes, 1)))


@inline_kernel
def least(lanes):
    """The least of the lanes (float32)."""
    lanes = lesser(lanes, _half(lanes, 8))
    lanes = lesser(lanes, _half(lanes, 4))
    lanes = lesser(lanes, _half(lanes, 2))
    return _first(lesser(lanes, _half(lanes, 1)))
