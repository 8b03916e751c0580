"""A traced function as C: CasADi's text, its exponentials, logarithms and powers gathered into vectors.

CasADi writes one assignment a line. Those whose result needs none of the slow functions come first; then all slow ones
whose arguments are known by then, eight at a time; then what follows from these, and so on. A circuit evaluates its
fluid's laws at some dozens of pressures, so that nearly all of them fall together.
"""

from __future__ import annotations

import re
from collections import defaultdict
from importlib import resources

import casadi as ca

LANES = 8
SLOW = {"exp": 1, "log": 1, "pow": 2}
"""Functions that exist for eight numbers at once, and how many arguments each takes."""
HEADER = "wide.h"

_BODY = re.compile(r"(static int \w+\(const casadi_real\*\* arg[^{]*\{\n)(.*?)(  return 0;\n\})", re.DOTALL)
_REGISTER = re.compile(r"\ba\d+\b")
_ASSIGNMENT = re.compile(r"  (a\d+)=(.*);")
_HALF = re.compile(r"\((v\d+)\?(v\d+):0\)")
_NOT = re.compile(r"\(!(v\d+)\)")
_SUM = re.compile(r"\((v\d+)\+(v\d+)\)")
_CALL = re.compile(r"(exp|log|pow)\(([\w.]+)(?:,([\w.]+))?\)")


def c_text(function: ca.Function) -> str:
    """The function in C as CasADi writes it: each operation of the graph, in its order."""
    generator = ca.CodeGenerator("function.c")
    generator.add(function)
    return str(generator.dump())


def wide_sources(function: ca.Function) -> dict[str, str]:
    """File names and texts of the function with its slow operations in vectors."""
    text = _BODY.sub(lambda m: m[1] + _gathered(m[2]) + m[3], c_text(function), count=1)
    header = resources.files("crescentlab").joinpath("c", HEADER).read_text(encoding="utf-8")
    return {"function.c": f'#include "{HEADER}"\n{text}', HEADER: header}


class _Body:
    """Statements by rank: the number of slow operations one after another that they wait for."""

    def __init__(self) -> None:
        self.plain: dict[int, list[str]] = defaultdict(list)
        self.slow: dict[int, dict[str, list[tuple[str, ...]]]] = defaultdict(lambda: defaultdict(list))
        self.rank: dict[str, int] = {}
        self.name: dict[str, str] = {}
        """What each register holds now."""
        self.text: dict[str, str] = {}
        """What each value is computed from."""

    def read(self, line: str) -> None:
        """Take one statement; every value gets a name of its own, registers are used again and again."""
        assigned = _ASSIGNMENT.fullmatch(line)
        right = line if assigned is None else assigned[2]
        used = [self.name[r] for r in _REGISTER.findall(right)]
        rank = max((self.rank[name] for name in used), default=0)
        renamed = _REGISTER.sub(lambda m: self.name[m[0]], right)
        if assigned is None:
            self.plain[rank].append(renamed)
            return
        target = self.name[assigned[1]] = f"v{len(self.rank)}"
        self.text[target] = renamed = self.whole(renamed)
        call = _CALL.fullmatch(renamed)
        if call is None:
            self.rank[target] = rank
            self.plain[rank].append(f"  const casadi_real {target}={renamed};")
        else:
            self.rank[target] = rank + 1
            self.slow[rank][call[1]].append((target, *[part for part in call.groups()[1:] if part]))

    def whole(self, text: str) -> str:
        """A choice in one, where CasADi adds its halves: (c?a:0) + (!c?b:0) is c?a:b."""
        terms = _SUM.fullmatch(text)
        first, second = (_HALF.fullmatch(self.text[term]) for term in terms.groups()) if terms else (None, None)
        for one, other in ((first, second), (second, first)):
            if one and other and (denied := _NOT.fullmatch(self.text[other[1]])) and denied[1] == one[1]:
                return f"({one[1]}?{one[2]}:{other[2]})"
        return text

    def lines(self) -> list[str]:
        """All statements, rank by rank."""
        found: list[str] = []
        for rank in range(max([*self.plain, *self.slow, 0]) + 1):
            found += self.plain[rank]
            for function, calls in sorted(self.slow[rank].items()):
                for k in range(0, len(calls), LANES):
                    found += _vector(function, calls[k : k + LANES], f"w{rank}_{function}_{k}")
        return found


def _vector(function: str, calls: list[tuple[str, ...]], name: str) -> list[str]:
    """Up to eight calls as one; a lone one stays as it is, empty lanes compute the first again."""
    if len(calls) == 1:
        target, *arguments = calls[0]
        return [f"  const casadi_real {target}={function}({','.join(arguments)});"]
    filled = calls + calls[:1] * (LANES - len(calls))
    packs = [", ".join(call[k + 1] for call in filled) for k in range(SLOW[function])]
    vectors = ", ".join(f"(Wide){{{pack}}}" for pack in packs)
    taken = [f"  const casadi_real {call[0]}={name}[{k}];" for k, call in enumerate(calls)]
    return [f"  const Wide {name} = {function}_wide({vectors});", *taken]


def _gathered(body: str) -> str:
    made = _Body()
    for line in body.splitlines():
        if not line.startswith("  casadi_real a"):  # the declaration of the registers
            made.read(line)
    return "\n".join(made.lines()) + "\n"
