"""Plain data across a border that nobody has to trust.

The grader and the worker exchange *frames* (`autograder.frames`) of MessagePack. Scalars travel as themselves;
everything else as a list that starts with a tag, so that a tuple is not a list and a ``numpy.float32`` is not a
``float`` on the other side. Nothing here can name a class or run code when it is read: the worst a hostile frame
can do is to raise :class:`WireError`.

What crosses: ``None``, ``bool``, ``int``, ``float``, ``complex``, ``str``, ``bytes``, ``bytearray``, ``tuple``,
``list``, ``dict``, ``set``, ``frozenset``, ``range``, ``slice``, ``Ellipsis``, numpy scalars and arrays (exact dtype,
byte order, shape, memory order and write flag), ``numpy.random.Generator`` (bit generator and state), names of library
functions, and :class:`Ref`, a number that stands for an object which stays where it is.

The module is used on both sides of the sandbox and imports nothing but numpy.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .named import WireError, name_of, resolve_named

if TYPE_CHECKING:
    from collections.abc import Callable

MAX_BYTES = 64 * 1024 * 1024
MAX_DEPTH = 40
MAX_ITEMS = 2_000_000
_DTYPE_KINDS = frozenset("biufcSUMm")
_DTYPE = re.compile(r"[<>|=]?[biufcSUMm][0-9]{1,9}(\[[0-9]{0,9}[A-Za-z]{1,2}\])?")
_BIT_GENERATORS = frozenset({"PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64"})
# Length of the buffer of those that have one: numpy believes a state's place in it and reads there, wherever that is.
_BUFFERS = {"MT19937": 624, "Philox": 4}

_LIST, _TUPLE, _DICT, _SET, _FROZENSET, _INT, _COMPLEX, _ARRAY = range(8)
_SCALAR, _GENERATOR, _REF, _NAMED, _RANGE, _SLICE, _DOTS, _BYTEARRAY, _CAST = range(8, 17)
# A subclass of a builtin crosses as the builtin, with its name: its own methods are not asked. (Counter, IntEnum ...)
_PLAIN_BASES: tuple[tuple[type, Any], ...] = (
    (int, int.__int__),
    (float, float.__float__),
    (complex, complex.__complex__),
    (str, lambda value: str.__getitem__(value, slice(None))),
    (bytes, lambda value: bytes.__getitem__(value, slice(None))),
    (list, lambda value: list(list.__iter__(value))),
    (tuple, lambda value: tuple(tuple.__iter__(value))),
    (dict, lambda value: dict(dict.items(value))),
    (set, lambda value: set(set.__iter__(value))),
    (frozenset, lambda value: frozenset(frozenset.__iter__(value))),
)


@dataclass(frozen=True)
class Ref:
    """An object that stays on its side: its number there, and what to tell a person about it.

    Attributes
    ----------
    number : int
        Which object; the side that owns it knows.
    type_name : str
        Name of its class, for messages.
    is_callable : bool
        Whether it can be called.
    """

    number: int
    type_name: str = "object"
    is_callable: bool = False


class _Budget:
    """Counts items so that a small frame cannot unfold into a large structure."""

    def __init__(self, casts: set[str] | None = None) -> None:
        self.items = 0
        self.casts = set() if casts is None else casts

    def spend(self, count: int, depth: int) -> None:
        self.items += count
        if self.items > MAX_ITEMS:
            raise WireError(f"more than {MAX_ITEMS} items")
        if depth > MAX_DEPTH:
            raise WireError(f"nested deeper than {MAX_DEPTH}")


def encode(value: object, to_ref: Callable[[object], Ref] | None = None, *, named: bool = False) -> Any:
    """Turn a value into what MessagePack carries.

    Parameters
    ----------
    value : object
        Plain data, possibly nested.
    to_ref : callable, optional
        Given an object that is not plain data, returns the :class:`Ref` to send instead, or raises `WireError`.
        Without it such an object is an error.
    named : bool, optional
        Whether a library function (``np.sin``) may be sent by its name. The worker never does: what a submission sends
        is data and nothing else.

    Returns
    -------
    object
        Scalars as themselves, everything else as tagged lists.

    Raises
    ------
    WireError
        If the value is not plain data, is nested too deeply (a cycle included), or is too large.

    Examples
    --------
    A pair stays a pair, and the integer 3 stays apart from the float 3.0:

    >>> decode(encode((3, 3.0)))
    (3, 3.0)
    >>> decode(encode([1, {"pose": (0.0, 1.0)}]))
    [1, {'pose': (0.0, 1.0)}]
    """
    return _encode(value, to_ref, _Budget(), 0, named=named)


def _encode(value: object, to_ref: Callable | None, budget: _Budget, depth: int, *, named: bool) -> Any:  # noqa: C901, PLR0911, PLR0912
    budget.spend(1, depth)
    kind = type(value)

    def inner(item: object) -> Any:
        return _encode(item, to_ref, budget, depth + 1, named=named)

    if value is None or kind is bool or kind is float:
        return value
    if kind is int:
        return value if -(2**63) <= value < 2**63 else [_INT, _big_int(value)]
    if kind is str or kind is bytes:
        budget.spend(len(value) // 64, depth)
        return value
    if kind is np.ndarray:
        return _encode_array(value, to_ref)
    if kind in (list, tuple, set, frozenset):
        tag = {list: _LIST, tuple: _TUPLE, set: _SET, frozenset: _FROZENSET}[kind]
        return [tag, *(inner(item) for item in value)]
    if kind is dict:
        flat = [inner(item) for pair in value.items() for item in pair]
        return [_DICT, *flat]
    if kind is complex:
        return [_COMPLEX, value.real, value.imag]
    if kind is Ref:
        return [_REF, value.number, value.type_name[:200], value.is_callable]
    if issubclass(kind, np.generic) and kind.__module__ == "numpy" and value.dtype.kind in _DTYPE_KINDS:
        array = np.asarray(value)  # an empty text as one of length 1: numpy reads none of length 0
        return [_SCALAR, array.dtype.str, array.tobytes()]
    if kind is np.random.Generator:
        return _encode_generator(value, to_ref, budget, depth)
    if kind is range or kind is slice:
        parts = (value.start, value.stop, value.step)
        return [_RANGE if kind is range else _SLICE, *(inner(part) for part in parts)]
    if value is Ellipsis:
        return [_DOTS]
    if kind is bytearray:
        return [_BYTEARRAY, bytes(value)]
    if named and (name := name_of(value)) is not None:
        return [_NAMED, *name]
    if to_ref is not None and issubclass(kind, dict) and kind.__module__.startswith("scipy."):
        return _as_ref(value, to_ref)  # the result of an optimizer or solver, which is asked for attributes
    for base, plain in _PLAIN_BASES:
        if issubclass(kind, base):
            encoded = _encode(plain(value), to_ref, budget, depth + 1, named=named)
            return encoded if to_ref is None else [_CAST, kind.__name__[:200], encoded]
    return _as_ref(value, to_ref)


def _as_ref(value: object, to_ref: Callable | None) -> list:
    if to_ref is None:
        raise WireError(f"an object of type {type(value).__name__} is not plain data")
    ref = to_ref(value)
    return [_REF, ref.number, ref.type_name[:200], ref.is_callable]


def _big_int(value: int) -> str:
    if value.bit_length() > 100_000:
        raise WireError("an integer of more than 100000 bits")
    return hex(value)


def _encode_array(value: np.ndarray, to_ref: Callable | None) -> list:
    if value.dtype.kind not in _DTYPE_KINDS:
        return _as_ref(value, to_ref)
    if value.nbytes > MAX_BYTES // 2:
        raise WireError(f"an array of {value.nbytes} bytes")
    order = "F" if value.flags.f_contiguous and not value.flags.c_contiguous else "C"
    return [_ARRAY, value.dtype.str, list(value.shape), order, value.flags.writeable, value.tobytes(order)]


def _encode_generator(
    value: np.random.Generator, to_ref: Callable | None, budget: _Budget, depth: int
) -> list:
    name = type(value.bit_generator).__name__
    if name not in _BIT_GENERATORS:
        return _as_ref(value, to_ref)
    return [_GENERATOR, name, _encode(value.bit_generator.state, None, budget, depth + 1, named=False)]


def decode(
    data: object,
    from_ref: Callable[[Ref], Any] | None = None,
    *,
    allow_named: bool = False,
    casts: set[str] | None = None,
) -> Any:
    """Turn what MessagePack carried back into a value; the inverse of :func:`encode`.

    Parameters
    ----------
    data : object
        What :func:`encode` made, or anything at all.
    from_ref : callable, optional
        Turns a :class:`Ref` into what stands for it on this side. Without it a reference stays a `Ref`.
    allow_named : bool, optional
        Whether a library function named in the data is looked up. The grader reads the worker with False: what a
        submission sends is then data and nothing else.
    casts : set of str, optional
        Takes the names of the classes whose objects came as plain data.

    Returns
    -------
    object
        The value.

    Raises
    ------
    WireError
        If the data is anything but the output of :func:`encode`.
    """
    try:
        return _decode(data, from_ref, _Budget(casts), 0, allow_named=allow_named)
    except WireError:
        raise
    except (TypeError, ValueError, OverflowError, KeyError, IndexError, AttributeError, MemoryError) as error:
        raise WireError(f"malformed value: {error}") from error


def _decode(  # noqa: C901, PLR0911, PLR0912  (one branch for each kind of value)
    data: object, from_ref: Callable | None, budget: _Budget, depth: int, *, allow_named: bool
) -> Any:
    budget.spend(1, depth)
    if data is None or type(data) in (bool, int, float, str, bytes):
        return data
    if type(data) is not list or not data or type(data[0]) is not int:
        raise WireError("an item without a tag")

    def inner(item: object) -> Any:
        return _decode(item, from_ref, budget, depth + 1, allow_named=allow_named)

    tag, *rest = data
    if tag == _LIST:
        return [inner(item) for item in rest]
    if tag == _TUPLE:
        return tuple(inner(item) for item in rest)
    if tag in (_SET, _FROZENSET):
        return (set if tag == _SET else frozenset)(_hashable(inner(item)) for item in rest)
    if tag == _DICT:
        if len(rest) % 2:
            raise WireError("a dict with half a pair")
        return {_hashable(inner(k)): inner(v) for k, v in zip(rest[::2], rest[1::2], strict=True)}
    if tag == _INT:
        return _decode_int(*rest)
    if tag == _COMPLEX:
        return complex(*_exact(rest, float, float))
    if tag == _ARRAY:
        return _decode_array(*rest)
    if tag == _SCALAR:
        dtype, raw = _exact(rest, str, bytes)
        return np.frombuffer(raw, dtype=_dtype(dtype), count=1)[0]
    if tag == _GENERATOR:
        return _decode_generator(rest[0], inner(rest[1]))
    if tag == _REF:
        ref = Ref(*_exact(rest, int, str, bool))
        return ref if from_ref is None else from_ref(ref)
    if tag == _NAMED and allow_named:
        return resolve_named(*_exact(rest, str, str))
    if tag == _RANGE:
        return range(*_exact([inner(item) for item in rest], int, int, int))
    if tag == _SLICE and len(rest) == 3:
        return slice(*(inner(item) for item in rest))
    if tag == _DOTS:
        return Ellipsis
    if tag == _CAST:
        name, _ = rest
        budget.casts.update(_exact([name], str))
        return inner(rest[1])
    if tag == _BYTEARRAY:
        return bytearray(*_exact(rest, bytes))
    raise WireError(f"unknown tag {tag}")


def _exact(items: list, *types: type) -> list:
    if len(items) != len(types) or any(
        type(item) is not kind for item, kind in zip(items, types, strict=True)
    ):
        raise WireError("a field of the wrong type")
    return items


def _hashable(value: object) -> Any:
    if isinstance(value, (list, dict, set, bytearray, np.ndarray, np.random.Generator, slice)):
        raise WireError("an unhashable key")
    hash(value)
    return value


def _decode_int(text: str) -> int:
    if type(text) is not str or len(text) > 30_000:
        raise WireError("an integer too long")
    value = int(text, 16)
    _big_int(value)
    return value


def _dtype(text: str) -> np.dtype:
    if not _DTYPE.fullmatch(text) or np.dtype(text).itemsize == 0:
        raise WireError(f"an array of dtype {text[:32]}")
    return np.dtype(text)


def _decode_array(text: str, shape: list, order: str, writeable: bool, raw: bytes) -> np.ndarray:
    _exact([text, shape, order, writeable, raw], str, list, str, bool, bytes)
    if len(shape) > 32 or any(type(n) is not int or n < 0 for n in shape) or order not in ("C", "F"):
        raise WireError("an array of impossible shape")
    dtype = _dtype(text)
    if math.prod(shape) * dtype.itemsize != len(raw):
        raise WireError("an array whose bytes do not fit its shape")
    array = (
        np.frombuffer(raw, dtype).reshape(shape, order=order).copy(order)
        if raw
        else np.empty(shape, dtype, order)
    )
    array.flags.writeable = writeable
    return array


def _decode_generator(name: str, state: dict) -> np.random.Generator:
    if name not in _BIT_GENERATORS or type(state) is not dict or state.get("bit_generator") != name:
        raise WireError("a random generator of an unknown kind")
    if name in _BUFFERS:
        place = state["state"]["pos"] if name == "MT19937" else state["buffer_pos"]
        if type(place) is not int or not 0 <= place <= _BUFFERS[name]:
            raise WireError("a random generator that points outside its buffer")
    bit_generator = getattr(np.random, name)(0)
    bit_generator.state = state
    return np.random.Generator(bit_generator)
