"""Circuits that cannot be put together: their expressions and nets, each mistake told at its line."""

from __future__ import annotations

import pytest
from refusing import HOLE, MARK, OIL, P_LINE, PUMP, STOP, SUPPLY, T_LINE, TANK, Refusal, edited, with_parts

# -- expressions ---------------------------------------------------------------------------------

ALLOWED = "only arithmetic, comparisons, parameters and abs, acos"
DEEP = "more than 150 operations inside one another"

EXPRESSIONS = {
    "unknown name": ("suply", "unknown name 'suply': did you mean supply?"),
    "division by zero": ("supply / (1 - 1)", "'supply / (1 - 1)' divides by zero"),
    "power of zero": ("supply * 0 ** -1", "divides by zero"),
    "import": ("__import__('os').system('echo')", ALLOWED),
    "call": ("print(1)", "unknown function 'print'"),
    "method": ("supply.real()", ALLOWED),
    "attribute": ("supply.__class__", "unknown name 'supply.__class__'"),
    "comprehension": ("[x for x in (1, 2)]", ALLOWED),
    "string": ("'30 L/min'", ALLOWED),
    "f-string": ("f'{supply}'", ALLOWED),
    "lambda": ("(lambda: 1)()", ALLOWED),
    "walrus": ("(x := 1)", ALLOWED),
    "choice": ("1 if 2 > 1 else 3", ALLOWED),
    "keyword argument": ("max(supply, key=1)", ALLOWED),
    "complex": ("1j", ALLOWED),
    "truth": ("True", ALLOWED),
    "remainder": ("5 % 3", "write + - * / ** only"),
    "exclusive or": ("2 ^ 3", "** for a power"),
    "shift": ("1 << 10000000000", "write + - * / ** only"),
    "huge power": ("9**9**9**9", "'9**9**9**9' is too large to compute"),
    "overflow": ("exp(1000) * supply", "is not a finite number"),
    "root of a negative number": ("sqrt(-1)", "the square root of -1"),
    "power of a negative number": ("(-2)**0.5", "is not a real number"),
    "logarithm of zero": ("log(0)", "the logarithm of 0"),
    "arc sine of two": ("asin(2)", "is not a finite number"),
    "statement": ("x = 1", "is not an expression; write arithmetic"),
    "half an expression": ("1 +", "is not an expression; write arithmetic"),
    "nothing": ("", "is not an expression; write arithmetic"),
    "unknown unit": ("5 foo", "is not an expression; write arithmetic"),
    "unknown function": ("mac(1, 2)", "unknown function 'mac': did you mean max"),
    "too few arguments": ("max(supply)", "max takes two or more arguments"),
    "too many arguments": ("sin(1, 2)", "sin takes one argument"),
    "sum of two dimensions": ("supply + 1 bar", "cannot add a flow [m^3/s] and a pressure [Pa]"),
    "minimum of two dimensions": ("min(supply, 1 mm)", "cannot compare a flow [m^3/s] and a length [m]"),
    "sine of a length": ("sin(1 mm)", "its argument must be a pure number or an angle"),
    "other dimension": ("supply * 1 mm", "gives a value in m^4 s^-1, where a flow [m^3/s] belongs"),
    "other quantity": (
        "3 bar",
        "gives a pressure [Pa], where a flow [m^3/s] belongs; a number of it is written like 1 L/min",
    ),
    "pure number": ("30", "gives a pure number, where a flow [m^3/s] belongs"),
    "condition": ("supply > 1 L/min", "gives a condition, where a flow [m^3/s] belongs"),
    "and of numbers": ("supply and 1", "a flow [m^3/s] stands where a condition such as a > b belongs"),
    "sum with a condition": ("supply + (2 > 1)", "a condition stands where a number belongs"),
    "element of a scalar": ("supply[1]", "a scalar has no elements"),
    "element x": ("supply[supply]", "an index must be a whole number from 1"),
    "deep signs": ("-" * 1500 + "1", DEEP),
    "deep sum": ("1" + "+1" * 900, DEEP),
    "deep brackets": ("(" * 900 + "1" + ")" * 900, "is not an expression; write arithmetic"),
    "long": ("1 + " * 2500 + "1", "an expression of 10001 characters; at most 2000 are read"),
}


@pytest.mark.parametrize(("body", "said"), EXPRESSIONS.values(), ids=EXPRESSIONS)
def test_expressions(refused: Refusal, body: str, said: str) -> None:
    quoted = "'= " + body.replace("'", "''") + "'"
    told = refused(edited((PUMP, f"{{type: flow_source, flow: {quoted}}}{MARK}")))
    assert told.startswith("pump.flow: ")
    assert said in told
    assert len(told) < 400


@pytest.mark.parametrize(
    ("written", "circle"),
    [
        ("supply: = half\n  half: = supply / 2 <--", "supply -> half -> supply"),
        ("supply: = supply * 2 <--", "supply -> supply"),
    ],
)
def test_parameters_in_a_circle(refused: Refusal, written: str, circle: str) -> None:
    assert f"parameters depend on each other: {circle}" in refused(edited((SUPPLY, f"  {written}")))


def test_a_word_where_a_number_belongs(refused: Refusal) -> None:
    text = edited((SUPPLY, "  supply: much"))
    assert "'much' is not a number with a unit; write for example 1 L/min" in refused(
        edited((PUMP, PUMP + MARK), text=text)
    )


# -- nets ----------------------------------------------------------------------------------------

LOOP = """\
crescentlab: 1
components:
  a: {type: gain, gain: 2} <--
  b: {type: gain, gain: 3}
nets: {s: [a.y, b.u], r: [b.y, a.u]}
"""
SIGNALS = """\
crescentlab: 1
components:
  a: {type: constant, value: 2 bar}
  b: {type: gain, gain: 3}
nets:
  s: [a.y, b.u] <--
"""
WATER = "water: {type: simple_oil, density: 998 kg/m^3, kinematic_viscosity: 1 cSt, bulk_modulus: 2 GPa}"
FLUIDS = edited((OIL, f"fluids:\n  oil{OIL[5:]}\n  {WATER}"))
VECTORS = with_parts(
    "three: {type: orifice, area: 1 mm^2, count: 3}",
    "two: {type: orifice, area: 1 mm^2, count: 2}",
    nets=("more: ['three.b[*]', 'two.b[*]', 'two.a[*]', TEXT, cup.port] <--",),
).replace(TANK, f"{TANK}\n  cup: {{type: tank}}")

NETS = {
    "unknown component": (
        edited((T_LINE, "  t_line: [hol.b, tank.port] <--")),
        "no component 'hol': did you mean hole?",
    ),
    "unknown port": (edited((T_LINE, "  t_line: [hole.c, tank.port] <--")), "'hole' has no port 'c': known: a, b"),
    "no port": (edited((T_LINE, "  t_line: [hole, tank.port] <--")), "'hole' is not a port; write component.port"),
    "connected twice": (
        edited((T_LINE, "  t_line: [hole.b, tank.port, tank.port] <--")),
        "tank.port is connected twice on the net t_line",
    ),
    "on two nets": (
        edited((T_LINE, "  t_line: [hole.b, tank.port, line.port] <--")),
        "line.port is connected on the nets p_line and t_line",
    ),
    "not connected": (
        edited((T_LINE, "  t_line: [tank.port]"), (HOLE, HOLE + MARK)),
        "hole.b (downstream) is not connected; add it to a net",
    ),
    "no net at all": (
        edited((f"nets:\n{P_LINE}\n{T_LINE}\n", "nets:\n"), (f"pump: {PUMP}", f"pump: {PUMP}{MARK}")),
        "pump.port (the outlet) is not connected; add it to a net, or join a tank or plug",
    ),
    "two domains": (
        with_parts("mass: {type: mass_with_stops, mass: 20 g, low: 0 mm, high: 1 mm}").replace(
            "tank.port]", "tank.port, mass.port] <--"
        ),
        "hole.b is hydraulic and mass.port is translational; join ports of one domain",
    ),
    "no giver": (
        with_parts("gap: {type: orifice, area: 1 mm^2}", nets=("middle: [hole.b, gap.a] <--",)).replace(
            "[hole.b, tank", "[gap.b, tank"
        ),
        "hole.b and gap.a meet without a volume: insert a capacity, for example {type: capacity, volume: 10 cm^3}",
    ),
    "two givers": (
        with_parts("cup: {type: capacity, volume: 1 cm^3}").replace("hole.a]", "hole.a, cup.port] <--"),
        "line.port and cup.port both give the pressure; insert a restriction between them, for example {type: orifice",
    ),
    "algebraic loop": (
        LOOP,
        "algebraic loop: a.y -> b.y -> a.y depend on each other at the same instant; insert a part with a state",
    ),
    "two units": (SIGNALS, "a.y carries pressure [Pa] and b.u ratio [1]; signals joined have one unit"),
    "no source": (
        SIGNALS.replace("a.y, ", ""),
        "nothing gives the signal of b.u: insert a source of the signal, for example {type: constant",
    ),
    "no fluid": (
        edited((f"{OIL}\n", ""), (f"pump: {PUMP}", f"pump: {PUMP}"), ("start: {p: 1 bar}}", "start: {p: 1 bar}} <--")),
        "the circuit names no fluid; write",
    ),
    "empty fluid": (
        edited((OIL, f"fluid:{MARK}")),
        "the fluid needs a type, for example fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: ",
    ),
    "fluid and fluids": (
        edited((STOP, f"{STOP}\nfluids: {{oil: {{type: simple_oil}}}}{MARK}")),
        "write either fluid: or fluids:, not both",
    ),
    "fluids meet": (
        FLUIDS.replace(P_LINE, f"  p_line: {{fluid: oil, ports: {P_LINE[10:]}}}").replace(
            T_LINE, f"  t_line: {{fluid: water, ports: {T_LINE[10:]}}}{MARK}"
        ),
        "the fluids oil and water meet here; put a separator between them",
    ),
    "net of no fluid": (
        FLUIDS.replace(P_LINE, f"  p_line: {{fluid: oli, ports: {P_LINE[10:]}}}{MARK}"),
        "unknown fluid 'oli': did you mean oil?",
    ),
    "nets name no fluid": (
        FLUIDS.replace("1 bar}}", "1 bar}} <--"),
        "line: its nets name no fluid; give one of them a fluid",
    ),
    "vectors of two sizes": (
        VECTORS.replace("'two.a[*]', TEXT, cup.port] <--", "cup.port]\n  v: [three.a, two.a] <--"),
        "three.a has 3 elements, two.a has 2; join vectors of equal size",
    ),
    "vector with a scalar": (
        VECTORS.replace("TEXT", "three.a"),
        'join an element, "three.a[1]", or put all on one net, "three.a[*]"',
    ),
    "index out of range": (
        VECTORS.replace("TEXT", "'three.a[4]'"),
        "three.a[4]: port a has 3 elements, counted from 1",
    ),
    "index zero": (VECTORS.replace("TEXT", "'three.a[0]'"), "three.a[0]: port a has 3 elements, counted from 1"),
    "index of a scalar": (
        edited((T_LINE, "  t_line: ['hole.b[1]', tank.port] <--")),
        "hole.b[1]: port b is a single one; write hole.b",
    ),
    "negative index": (
        VECTORS.replace("TEXT", "'three.a[-1]'"),
        "'three.a[-1]' is not a port; write component.port, component.port[2]",
    ),
    "missing element": (
        VECTORS.replace(MARK, "").replace("TEXT", "'three.a[1]', 'three.a[3]'").replace("count: 3}", "count: 3} <--"),
        "three.a[2] (upstream) is not connected",
    ),
}


@pytest.mark.parametrize(("text", "said"), NETS.values(), ids=NETS)
def test_nets(refused: Refusal, text: str, said: str) -> None:
    assert said in refused(text)
