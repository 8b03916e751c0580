"""Mistakes in circuit files: each is told in one sentence that begins with file and line and says what to write."""

from __future__ import annotations

import re
import time

import pytest
from refusing import CIRCUIT, HOLE, MARK, STOP, SUPPLY, T_LINE, TANK, Refusal, added, edited

from crescentlab.netlist import Netlist
from crescentlab.yaml_text import MAX_ALIASED, MAX_BYTES, parse, quoted

LINE = "  line: {type: capacity, volume: 70 cm^3, start: {p: 1 bar}}"


def test_the_circuit_itself_is_accepted(refused: Refusal) -> None:
    """So that every refusal below is of the edit."""
    refused.write({"c.yaml": CIRCUIT})
    code, _, err = refused.run("check", "c.yaml")
    assert (code, err) == (0, "")


# -- text ----------------------------------------------------------------------------------------

NOT_YAML = {
    "tab": ((SUPPLY, "\tsupply: 30 L/min <--"), "a tab at the beginning of the line; indent with spaces"),
    "brace left open": ((HOLE, f"{HOLE[:-1]} <--"), "a bracket opened here is never closed"),
    "list left open": ((T_LINE, f"{T_LINE[:-1]} <--"), "a bracket opened here is never closed"),
    "brace left open at the end": ((STOP, f"{STOP[:-1]} <--"), "a bracket opened here is never closed"),
    "brace too many": ((HOLE, f"{HOLE}}} <--"), "look at indentation and brackets of: hole: {type"),
    "brackets crossed": (("{p: 1 bar}}", "{x: [1, 2} <--"), "brackets do not match"),
    "indentation": ((TANK, f" {TANK} <--"), "look at indentation and brackets of: tank"),
    "no colon": (("nets:", "nets <--"), "a colon is missing; write: nets:"),
    "no colon before a bracket": ((TANK, "  tank {type: tank} <--"), "write: tank: {type: tank}"),
    "no blank after a colon": (
        ("stop: 10 ms}", "stop:10 ms} <--"),
        "a blank is missing after the colon; write: stop: 10 ms",
    ),
    "no blank in a block": ((f"{SUPPLY}\n", f"{SUPPLY}\n  other:3 bar <--\n"), "write: other: 3 bar"),
    "colon in a text": (("crescentlab: 1", "crescentlab: 1\ntitle: Valve: open <--"), "quote text that holds one"),
    "quote left open": ((SUPPLY, "  supply: '30 L/min <--"), "a quote opened here is never closed"),
    "begins with %": ((SUPPLY, "  supply: %30 <--"), "text that begins with % must be quoted"),
    "control character": ((SUPPLY, "  supply: \x07 30 L/min <--"), "the character U+0007 is not allowed"),
    "unknown alias": ((SUPPLY, "  supply: *flow <--"), "the alias *flow refers to nothing"),
    "comma in a text": ((STOP, "plots: [{y: line.p, title: one, two}] <--"), "title: 'one, two'"),
    "a key that is a list": ((SUPPLY, "  ? [a, b] <--\n  : 3"), "a key must be a word"),
    "duplicate key": ((HOLE, f"{HOLE}\n{HOLE} <--"), "the key 'hole' stands twice (first in line 8); remove one"),
    "duplicate section": ((STOP, f"{STOP}\nnets: {{}} <--"), "the key 'nets' stands twice (first in line 10)"),
}


@pytest.mark.parametrize(("edit", "said"), NOT_YAML.values(), ids=NOT_YAML)
def test_text_that_is_not_yaml(refused: Refusal, edit: tuple[str, str], said: str) -> None:
    assert said in refused(edited(edit))


FILES = {
    "list": ("- a <--\n- b\n", "a circuit file is a mapping"),
    "one word": ("hello <--\n", "a circuit file is a mapping"),
    "two documents": (f"{CIRCUIT}--- <--\na: 1\n", "two YAML documents; keep one"),
    "empty": (" <--", "the file is empty"),
    "only a comment": ("# nothing <--\n", "the file is empty"),
    "no version": (
        edited(("crescentlab: 1\nfluid", "fluid"), ("bar}", "bar} <--")),
        "begin the file with `crescentlab: 1`",
    ),
    "other version": (edited(("crescentlab: 1", "crescentlab: 2 <--")), "must be '1', not '2'"),
    "deep lists": (f"{'[' * 100_000} <--", "nested deeper than 40 levels"),
    "deep keys": (f"{'{a: ' * 100_000} <--", "nested deeper than 40 levels"),
    "python object": ("!!python/object/apply:os.system ['echo x'] <--", "a circuit file is a mapping"),
}


@pytest.mark.parametrize(("text", "said"), FILES.values(), ids=FILES)
def test_files_that_are_no_circuit(refused: Refusal, text: str, said: str) -> None:
    assert said in refused(text)


def test_bytes_that_are_no_text(refused: Refusal) -> None:
    """The line of the first byte that is not UTF-8."""
    path = refused.folder / "c.yaml"
    path.write_bytes(CIRCUIT.encode() + bytes(range(256)))
    assert refused.told("check", "c.yaml").startswith("c.yaml:15: byte 0x80 is not text in UTF-8; save the file as")
    path.write_bytes(CIRCUIT.replace("tank}", "tank} # für").encode("latin-1"))
    assert refused.told("check", "c.yaml").startswith("c.yaml:9: byte 0xfc is not text in UTF-8")


def test_a_file_of_more_than_8_mb_is_not_parsed(refused: Refusal) -> None:
    """Its text is not even YAML, which nobody may find out."""
    refused.write({"c.yaml": "[" * (MAX_BYTES + 1)})
    begun = time.perf_counter()
    assert refused.told("check", "c.yaml").startswith(f"c.yaml:1: the file has {MAX_BYTES + 1} bytes")
    assert time.perf_counter() - begun < 1.0


@pytest.mark.parametrize("form", ["[{}]", "{{a: {0}, b: {0}, c: {0}, d: {0}, e: {0}}}"])
def test_anchors_that_explode(refused: Refusal, form: str) -> None:
    """Billion laughs: ten levels of ten aliases end when the bound is passed, not after 10^10 values."""
    lines = ["crescentlab: 1", "a0: &a0 [x, x, x, x, x]"]
    for k in range(1, 20):
        alias = f"*a{k - 1} "
        lines.append(f"a{k}: &a{k} {form.format(', '.join([alias] * 10) if form == '[{}]' else alias)}")
    refused.write({"c.yaml": "\n".join(lines)})
    begun = time.perf_counter()
    said = refused.told("check", "c.yaml")
    assert time.perf_counter() - begun < 1.0
    assert re.match(rf"c.yaml:\d+: aliases .* more than {MAX_ALIASED} values; write them out", said)


def test_an_alias_may_be_a_key() -> None:
    assert parse("a: &name b\n*name : c\n", "c.yaml").plain() == {"a": "b", "b": "c"}


SLIPS = [
    (HOLE, "{type: orifice, area: = max(1 mm^2, 5 mm^2)}", "{type: orifice, area: '= max(1 mm^2, 5 mm^2)'}"),
    (
        HOLE,
        "{area: = 2 * max(supply, min(supply, 1)) + 1, type: orifice}",
        "{area: '= 2 * max(supply, min(supply, 1)) + 1',",
    ),
    (T_LINE, "[driver.chain[1], tank.port]", "['driver.chain[1]', tank.port]"),
    (T_LINE, "{fluid: oil, ports: [tank.port, hole.b[*]]}", "{fluid: oil, ports: [tank.port, 'hole.b[*]']}"),
    (STOP, "{stop: 10 ms, stop_when: chain.p[2] > 3 bar}", "{stop: 10 ms, stop_when: 'chain.p[2] > 3 bar'}"),
    (STOP, "{stop: 10 ms, stop_when: = chain.p[2] * 2 > 3 bar}", "stop_when: '= chain.p[2] * 2 > 3 bar'}"),
    (
        SUPPLY,
        "[{y: [chain.p[1], line.p]}, {y: chain.p[3], title: Hole}]",
        "[{y: ['chain.p[1]', line.p]}, {y: 'chain.p[3]',",
    ),
]


@pytest.mark.parametrize(("line", "wrong", "right"), SLIPS)
def test_the_corrected_line_is_shown_and_parses(refused: Refusal, line: str, wrong: str, right: str) -> None:
    """What stands after `write:` can be put in the file as it is."""
    key = line.split(":")[0]
    said = refused(edited((line, f"{key}: {wrong} <--")))
    assert "must be quoted; write: " in said
    assert right in said
    better = said.partition("write: ")[2]
    text = edited((line, f"{key}: {wrong}")).replace(f"{key.strip()}: {wrong}", better)
    assert better in text
    parse(text, "c.yaml")


def test_a_slip_in_a_later_line_of_braces(refused: Refusal) -> None:
    """A line that begins inside braces is corrected as well."""
    text = edited((HOLE, "  hole: {type: orifice,\n    area: = max(1 mm^2, 3 mm^2), <--\n    cd_max: 0.7}"))
    assert refused(text).endswith("write: area: '= max(1 mm^2, 3 mm^2)',")


@pytest.mark.parametrize(
    "line",
    [
        "p: [a.b, 'c.d[1]']",
        "title: a [1], b",
        "x: {y: z} # see c.d[1]",
        "- {a: 'it''s, so', b: \"[1]\"}",
        "x: {y: = f(a",
    ],
)
def test_what_needs_no_quotes_is_left_alone(line: str) -> None:
    assert quoted(line) == line


# -- keys, values, units -------------------------------------------------------------------------

VALUES = {
    "unknown section": ((STOP, f"{STOP}\nnet: {{}} <--"), "unknown key 'net': did you mean nets?"),
    "unknown setting": ((STOP, "simulation: {stp: 10 ms} <--"), "simulation: unknown key 'stp': did you mean stop or"),
    "unknown parameter": (("area: 5 mm^2}", "aera: 5 mm^2} <--"), "hole: unknown key 'aera': did you mean area"),
    "unknown fluid parameter": (("bar}", "bar, densty: 3} <--"), "fluid: unknown key 'densty': did you mean density"),
    "unknown type": ((HOLE, "  hole: {type: orifce} <--"), "unknown component type 'orifce': did you mean orifice"),
    "a fluid as component": ((TANK, "  tank: {type: simple_oil} <--"), "it is a fluid; name it under fluid:"),
    "unknown fluid type": (
        ("simple_oil, density: 860 kg/m^3,", "simple_oli, <--"),
        "'simple_oli': did you mean simple_oil",
    ),
    "no type": ((TANK, "  tank: {} <--"), "components.tank.type is missing; write for example type: orifice"),
    "no fluid type": (("type: simple_oil, density: 860 kg/m^3,", "density: 3 <--,"), "the fluid needs a type"),
    "missing parameter": (
        ("volume: 70 cm^3, start: {p: 1 bar}}", "start: {p: 1 bar}} <--"),
        "write for example volume: 1 cm3",
    ),
    "missing unit": (("5 mm^2}", "5} <--"), "hole.area: '5': an area needs a unit: 5 m2, 50000 cm2 or 5e+06 mm2?"),
    "wrong dimension": (("5 mm^2}", "5 bar} <--"), "'bar' is a unit of pressure, not of area"),
    "unknown unit": (
        ("5 mm^2}", "5 mmm} <--"),
        "unknown unit 'mmm' for an area: did you mean mm2? Write one of mm2, m2",
    ),
    "unknown unit of a parameter": (
        ("30 L/min", "30 l/mim <--"),
        "supply: '30 l/mim': unknown unit 'l/mim': did you mean l/min",
    ),
    "unit of nothing near": (("30 L/min", "30 qqqq <--"), "units are bar, L/min, mm"),
    "below its bound": (("5 mm^2}", "-5 mm^2} <--"), "hole.area must be at least 0, not -5 mm2"),
    "at its bound": (("70 cm^3,", "0 cm^3, <--"), "line.volume must be above 0, not 0"),
    "beyond a limit": (("5 mm^2}", "5 mm^2, cd_max: 1.5} <--"), "hole.cd_max must be at most 1, not 1.5"),
    "not a number": (
        ("70 cm^3,", "much, <--"),
        "line.volume: 'much' is not a number with a unit; write for example 1 cm3",
    ),
    "nan": (("70 cm^3,", "nan cm^3, <--"), "'nan cm^3' is not a number with a unit"),
    "inf": (("70 cm^3,", ".inf, <--"), "'.inf' is not a number with a unit"),
    "too large": (("70 cm^3,", "1e999 cm^3, <--"), "'1e999 cm^3' is not a finite number"),
    "too large in SI": (("30 L/min", "30 L/min\n  p: 1e308 bar <--"), "'1e308 bar' is not a finite number"),
    "decimal comma": (("70 cm^3,", "'70,5 cm^3', <--"), "decimals follow a point; write 70.5 cm^3"),
    "empty value": (("volume: 70 cm^3,", "volume: , <--"), "'volume' has no value; write volume: ..."),
    "a list for a number": (("70 cm^3,", "[1 cm^3], <--"), "line.volume must be one number, not a list"),
    "keys for a number": (("70 cm^3,", "{a: 1}, <--"), "line.volume must be one number, not keys"),
    "a list for a parameter": (("30 L/min", "[30 L/min] <--"), "parameters.supply must be one text, not a list"),
    "not a whole number": (("5 mm^2}", "5 mm^2, count: two} <--"), "hole.count must be a whole number, not 'two'"),
    "no choice": (("bar}", "bar, tension: perhaps} <--"), "fluid.tension must be true or false, not 'perhaps'"),
    "keyword as component": ((TANK, "  lambda: {type: tank} <--"), "'lambda' has a meaning of its own in expressions"),
    "keyword as parameter": ((SUPPLY, "  in: 30 L/min <--"), "'in' has a meaning of its own in expressions"),
    "pi as parameter": (
        (SUPPLY, "  pi: 30 L/min <--"),
        "'pi' has a meaning of its own in expressions; choose another name",
    ),
    "not a name": ((TANK, "  my-tank: {type: tank} <--"), "'my-tank' is not a name; use letters, digits and _"),
    "component and net": (("  t_line:", "  tank: <--"), "'tank' names both a component and a net; rename one"),
    "component and parameter": ((SUPPLY, "  tank: 3 bar <--"), "'tank' names a parameter and a component or net"),
    "start of no state": (("{p: 1 bar}}", "{q: 1 bar}} <--"), "line: no state 'q' to start: known: p"),
    "start in another unit": (
        ("{p: 1 bar}}", "{p: 1 mm}} <--"),
        "line.start.p: '1 mm': 'mm' is a unit of length, not of pressure",
    ),
    "start without keys": (("{p: 1 bar}}", "1 bar} <--"), "start needs keys, for example start: {p: 1 bar}"),
    "start of too many": (
        ("{p: 1 bar}}", "{p: [1 bar, 2 bar]}} <--"),
        "start of p has 2 values for 1; write one for all",
    ),
    "component without keys": ((TANK, "  tank: <--"), "tank needs keys, for example tank: {type: orifice"),
    "fluid without keys": (
        ("fluid: {type: simple_oil,", "fluid: oil <--\ntitle: {"),
        "fluid needs keys, for example fluid: {type",
    ),
    "empty net": (
        (f"{T_LINE}\n", f"{T_LINE}\n  none: <--\n"),
        "none needs a list, for example none: [pump.port, line.port]",
    ),
    "net of no port": (
        (f"{T_LINE}\n", f"{T_LINE}\n  none: [] <--\n"),
        "net none joins no port; list at least one or remove it",
    ),
    "net with an unknown key": (
        (T_LINE, "  t_line: {ports: [], fluit: oil} <--"),
        "nets.t_line: unknown key 'fluit': did you mean fluid?",
    ),
    "net without ports": (
        (T_LINE, "  t_line: {fluid: oil} <--"),
        "ports is missing; write for example ports: [pump.port",
    ),
    "no components": (
        (CIRCUIT[CIRCUIT.index("components") :], "components: <--\n"),
        "there are no components; list them",
    ),
    "library without a list": (
        (STOP, f"{STOP}\nlibrary: ./my.py <--"),
        "library needs a list, for example library: [./my",
    ),
}


@pytest.mark.parametrize(("edit", "said"), VALUES.values(), ids=VALUES)
def test_keys_and_values(refused: Refusal, edit: tuple[str, str], said: str) -> None:
    assert said in refused(edited(edit))


SETTINGS = {
    "unknown solver": ("simulation: {solver: lsodar} <--", "simulation.solver must be 'auto', 'lsoda', 'bdf', 'radau'"),
    "negative stop": ("simulation: {stop: -1 ms} <--", "simulation.stop must be above 0, not -1 ms"),
    "stop without unit": (
        "simulation: {stop: 10} <--",
        "simulation.stop: '10': a time needs a unit: 10 s, 10000 ms or 1e+07 us?",
    ),
    "tolerance of 2": ("simulation: {rtol: 2} <--", "simulation.rtol must be below 1, not '2'"),
    "tolerance nan": ("simulation: {rtol: nan} <--", "simulation.rtol must be"),
    "tolerance of a word": ("simulation: {rtol: fine} <--", "simulation.rtol must be a number, not 'fine'"),
    "tolerance of rounding": ("simulation: {rtol: 1e-16} <--", "simulation.rtol must be at least 1e-13, not '1e-16'"),
    "stop_when is no condition": ("simulation: {stop_when: line.p} <--", "write for example line.p > 9 bar"),
    "stop_when of no variable": (
        "simulation: {stop_when: lin.p > 1 bar} <--",
        "unknown name 'lin.p': did you mean line.p",
    ),
    "stop_when of two units": (
        "simulation: {stop_when: line.p > 1 mm} <--",
        "cannot compare a pressure [Pa] and a length [m]",
    ),
    "stop_when and a number": (
        "simulation: {stop_when: line.p > 1 bar and hole.q} <--",
        "where a condition such as a > b belongs",
    ),
    "display of no quantity": ("display: {presure: bar} <--", "unknown quantity 'presure': did you mean pressure"),
    "display in another unit": (
        "display: {pressure: mm} <--",
        "display.pressure: 'mm' is a unit of length, not of pressure",
    ),
    "display in no unit": (
        "display: {pressure: baar} <--",
        "unknown unit 'baar' for a pressure: did you mean bar or mbar",
    ),
    "plot of no variable": ("plots: [{y: lin.p}] <--", "plots: no variable 'lin.p': did you mean line.p"),
    "plot over no variable": ("plots: [{y: line.p, x: lin.p}] <--", "plots: no variable 'lin.p': did you mean line.p"),
    "plot of no element": ("plots: [{y: 'line.p[1]'}] <--", "line.p[1]: line.p is a single value; write line.p"),
    "plot of nothing": ("plots: [{y: []}] <--", "plots[1].y needs at least 1 item"),
    "plot that is a word": ("plots: [line.p] <--", "plots[1] needs keys in braces, not 'line.p'"),
    "plot that ends first": (
        "plots: [{y: line.p, start: 5 ms, stop: 1 ms}] <--",
        "plots[1]: start must lie before stop",
    ),
    "output of a word": ("outputs: {loss: line.p} <--", "output 'loss' must be an expression, for example loss: '= "),
    "output of no variable": (
        "outputs: {loss: = lin.p} <--",
        "output 'loss': unknown name 'lin.p': did you mean line.p",
    ),
    "output named as a variable": (
        "outputs: {line.p: = hole.q} <--",
        "'line.p' has the name of an existing variable; rename it",
    ),
    "output named as a net's": ("outputs: {p_line.p: = hole.q} <--", "'p_line.p' has the name of an existing variable"),
    "output named as the time": ("outputs: {time: = hole.q} <--", "'time' is the first column of every result"),
    "output of itself": ("outputs: {a: = b, b: = a} <--", "depends on itself"),
    "output of two units": ("outputs: {a: = line.p + hole.q} <--", "cannot add a pressure [Pa] and a flow [m^3/s]"),
    "output of three names": ("outputs: {a.b.c: = line.p} <--", "'a.b.c' is not a name"),
}


@pytest.mark.parametrize("command", ["check", "simulate"])
@pytest.mark.parametrize(("section", "said"), SETTINGS.values(), ids=SETTINGS)
def test_settings_are_told_before_the_run(refused: Refusal, section: str, said: str, command: str) -> None:
    """Plots, outputs and stop_when too, whether or not they are asked for."""
    text = added(section) if not section.startswith("simulation") else edited((STOP, section))
    assert said in refused(text, command=command)
    assert not (refused.folder / "c.nc").exists()


def test_empty_sections_are_allowed(refused: Refusal) -> None:
    """A heading left to be filled later."""
    refused.write({"c.yaml": edited((STOP, "simulation:\noutputs:\nplots:\ndisplay:\nlibrary:\nports:"))})
    assert refused.run("check", "c.yaml")[0] == 0


def shaft_speed(written: str, parameter: str | None = None) -> float:
    """Speed [rad/s] of a source written so, by way of a parameter if one is given."""
    from crescentlab.circuit import Circuit

    parameters = {"parameters": {"n": parameter}} if parameter else {}
    data = {"crescentlab": "1", **parameters, "components": {"shaft": {"type": "speed_source", "speed": written}}}
    design = Circuit(Netlist.of(data)).design()
    return float(design.instances["shaft"].component.speed)  # type: ignore[attr-defined]


def test_revolutions_a_minute_are_no_hertz() -> None:
    """2000 1/min is 209.44 rad/s, by hand 2000 * 2 pi / 60, written in place or through a parameter."""
    assert shaft_speed("2000 1/min") == pytest.approx(209.4395, rel=1e-6)
    assert shaft_speed("= n", "2000 1/min") == pytest.approx(209.4395, rel=1e-6)
    assert shaft_speed("= 2 * pi * n", "50 Hz") == pytest.approx(314.1593, rel=1e-6)


UNITS = {
    "hertz for a speed": ("speed: 33 Hz", "'Hz' is a unit of frequency, not of speed; write one of rpm"),
    "hertz by a parameter": (
        "speed: = f",
        "gives a frequency [Hz], where a speed [rad/s] belongs; a number of it is written like 1 rpm",
    ),
    "torque for a speed": ("speed: 5 Nm", "'Nm' is a unit of torque"),
    "angle for a speed": ("speed: 5 deg", "'deg' is a unit of angle, not of speed"),
}


@pytest.mark.parametrize(("parameter", "said"), UNITS.values(), ids=UNITS)
def test_units_that_mean_something_else(refused: Refusal, parameter: str, said: str) -> None:
    edit = (f"{TANK}\n", f"{TANK}\n  shaft: {{type: speed_source, {parameter}}}{MARK}\n")
    assert said in refused(edited(edit, (SUPPLY, f"{SUPPLY}\n  f: 50 Hz")))
