"""The compiled loop as Python sees it: its library, built once, and the structure it works on.

The structure is described in one place, ``c/run.h``: :class:`Run` is read from it.
"""

from __future__ import annotations

import ctypes
import functools
import re
import sys
from importlib import resources
from typing import Any

import casadi  # noqa: F401  # loads the library looked into below
import numpy as np

from crescentlab.compiler import NATIVE, Source, build
from crescentlab.errors import CompilerError

SOURCES = ("run.h", "loop.c", "lu.c", "rodas.c", "dopri.c")
OPTIMISED = ("-O3", *NATIVE[1:])
CALL_FUNCTION = "_ZN6casadi21_function_buffer_evalEPv"
"""CasADi's ``void _function_buffer_eval(void *)``: evaluates a function through its buffers, no Python involved."""

_TYPES: dict[str, Any] = {"int64_t": ctypes.c_int64, "double": ctypes.c_double}


@functools.cache
def source(name: str) -> str:
    """Text of one of the loop's C files."""
    return resources.files("crescentlab.solvers").joinpath("c", name).read_text(encoding="utf-8")


def _fields() -> list[tuple[str, Any]]:
    body = re.search(r"typedef struct Run \{(.*?)\} Run;", source("run.h"), re.DOTALL)
    assert body is not None
    lines = re.findall(r"^    ([\w ]+?) (\*?)(\w+);", body[1], re.MULTILINE)
    return [(name, ctypes.c_void_p if pointer else _TYPES[kind]) for kind, pointer, name in lines]


def enumeration(first: str) -> dict[str, int]:
    """Names and numbers of the enumeration that begins with ``first``."""
    body = re.search(rf"enum \{{\s*({first}\b.*?)\}}", source("run.h"), re.DOTALL)
    assert body is not None
    text = re.sub(r"/\*.*?\*/", "", body[1], flags=re.DOTALL)
    found: dict[str, int] = {}
    for item in text.split(","):
        name, _, value = item.partition("=")
        found[name.strip()] = int(value) if value else len(found)
    return found


CODES = enumeration("PAUSED")
NAMES = {number: name for name, number in CODES.items()}
KINDS = enumeration("WHEN")
METHODS = {name.lower(): number for name, number in enumeration("RODAS").items()}
LIMITS = enumeration("MAX_ROUNDS")
SHAPES = {"rodas": (6, 3), "dopri": (7, 4)}
"""Stages of each method, and the degree of its polynomial."""


class Run(ctypes.Structure):
    """``struct Run`` of run.h; arrays are set by :meth:`give`, which keeps them alive."""

    _fields_ = _fields()

    def give(self, **arrays: np.ndarray) -> None:
        """Point fields at arrays."""
        for name, array in arrays.items():
            self.kept[name] = array
            setattr(self, name, array.ctypes.data)

    def __init__(self) -> None:
        super().__init__()
        self.kept: dict[str, np.ndarray] = {}


@functools.cache
def library() -> ctypes.CDLL:
    """The compiled loop; raises :class:`CompilerError` on a machine that cannot build it."""
    found = ctypes.CDLL(str(build(Source({name: source(name) for name in SOURCES}, OPTIMISED))))
    found.size_of_run.restype = ctypes.c_int64
    if found.size_of_run() != ctypes.sizeof(Run):
        raise CompilerError("the compiled loop does not fit this machine's compiler")
    found.advance.argtypes = [ctypes.POINTER(Run), ctypes.c_int64]
    found.find_goal.argtypes = [ctypes.POINTER(Run)]
    found.find_goal.restype = None
    return found


@functools.cache
def call_function() -> int:
    """Address of CasADi's evaluation of a function through its buffers; raises :class:`CompilerError` without it."""
    try:
        found = ctypes.CDLL(sys.modules["casadi._casadi"].__file__)[CALL_FUNCTION]
    except (OSError, AttributeError):
        raise CompilerError("this build of CasADi does not let its functions be called from C") from None
    address = ctypes.cast(found, ctypes.c_void_p).value
    assert address is not None
    return address


def address_of(buffer: Any) -> int:
    """Address of a CasADi FunctionBuffer."""
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return int(pointer(buffer._self(), None))
