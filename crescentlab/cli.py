"""The command line: parse, call, print. Whatever is heavy is imported inside the command that needs it."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import re
import sys
from collections.abc import Sequence
from typing import NoReturn

from crescentlab import __version__
from crescentlab.errors import ComponentError, InputError, nearest

DONE, BUG, WRONG_INPUT, FAILED, INTERRUPTED = 0, 1, 2, 3, 130
"""Exit codes. FAILED is a simulation that could not go on; what it computed is saved."""

RUN_KEYS = (
    "status", "final_time", "wall_s", "steps", "evaluations", "jacobians", "events", "ticks", "restarts", "states",
    "balance", "warnings", "file", "error",
)  # fmt: skip
"""Keys of the object that ``simulate --json`` prints, whatever happens."""

COMMANDS = {
    "simulate": "integrate a circuit and write its result",
    "check": "who gives what on every net; states, events",
    "components": "the library; with TYPE its ports, parameters, equations, source",
    "circuits": "shipped circuits; with --copy one of them and its parts",
    "graph": "draw the schematic",
    "schema": "JSON schema of circuit files, for editors",
    "results": "what a result holds; series as CSV on stdout",
}


class _Parser(argparse.ArgumentParser):
    """Argument parser whose errors are one sentence."""

    def error(self, message: str) -> NoReturn:
        raise InputError(re.sub(r"^argument ", "", message) + f"; see crescentlab {self.prog.split()[-1]} --help")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        code = _run(arguments)
        sys.stdout.flush()
        return code
    except SystemExit as done:  # --help and --version
        return done.code if isinstance(done.code, int) else DONE if done.code is None else BUG
    except (InputError, ComponentError) as error:
        return _failed(arguments, str(error), WRONG_INPUT, "invalid")
    except KeyboardInterrupt as stop:
        return _failed(arguments, str(stop) or "interrupted", INTERRUPTED, "interrupted")
    except BrokenPipeError:  # the reader of stdout, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as error:
        import traceback

        traceback.print_exc()
        said = f"{type(error).__name__}: {error} (this is a bug of crescentlab {__version__}; please report it)"
        return _failed(arguments, said, BUG, "bug")


def _run(arguments: list[str]) -> int:
    options = _parsed(arguments)
    if options.verbose:
        import logging

        logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(relativeCreated)7.0f ms  %(message)s")
    command = importlib.import_module(f"crescentlab.commands.{options.command}")
    return int(command.run(options))


def _failed(arguments: list[str], said: str, code: int, status: str) -> int:
    """Say what is wrong on stderr, and with ``--json`` on stdout as well."""
    print(said, file=sys.stderr)
    if "--json" in arguments:
        keys = RUN_KEYS if "simulate" in arguments else ()
        print(json.dumps({**dict.fromkeys(keys), "status": status, "warnings": [], "error": said}, indent=2))
    return code


# -- arguments -----------------------------------------------------------------------------------


def _parsed(arguments: list[str]) -> argparse.Namespace:
    parser, commands = _parser()
    given = next((a for a in arguments if not a.startswith("-")), None)
    if given is not None and given not in commands:
        raise InputError(f"unknown command {given!r}: {nearest(given, commands)}")
    options, extra = parser.parse_known_args(arguments, argparse.Namespace(verbose=False, no_code=False))
    if extra:
        raise InputError(_unexpected(extra, commands[given] if given else parser, given or ""))
    if options.command is None:
        raise InputError(f"name a command: {', '.join(commands)}; see crescentlab --help")
    return options


def _unexpected(extra: list[str], parser: argparse.ArgumentParser, command: str) -> str:
    option = next((e.partition("=")[0] for e in extra if e.startswith("-")), None)
    if option is None:
        return f"{command}: unexpected {extra[0]!r}; quote text that has blanks, for example --stop '50 ms'"
    known = set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", parser.format_help()))
    return f"unknown option {option} of crescentlab {command}: {nearest(option, known)}"


def _parser() -> tuple[argparse.ArgumentParser, dict[str, argparse.ArgumentParser]]:
    common = _Parser(add_help=False, allow_abbrev=False)
    common.add_argument("-v", "--verbose", action="store_true", default=argparse.SUPPRESS, help="log to stderr")
    common.add_argument(
        "--no-code",
        action="store_true",
        default=argparse.SUPPRESS,
        help="refuse circuits that bring their own Python files",
    )
    parser = _Parser(
        "crescentlab", description="Hydraulic circuits as one global ODE.", allow_abbrev=False, parents=[common]
    )
    parser.add_argument("--version", action="version", version=f"crescentlab {__version__}")
    chosen = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands")
    commands: dict[str, argparse.ArgumentParser] = {}
    for name, text in COMMANDS.items():
        commands[name] = chosen.add_parser(
            name, help=text, description=f"{text[0].upper()}{text[1:]}.", allow_abbrev=False, parents=[common]
        )
    for name in ("simulate", "check", "graph"):
        commands[name].add_argument(
            "circuit", metavar="CIRCUIT", help="a circuit file, or the name of a shipped circuit"
        )
        commands[name].add_argument(
            "--set", action="append", default=[], metavar="NAME=VALUE", help="replace a value; VALUE as in the file"
        )
    for name in ("simulate", "check"):
        commands[name].add_argument("--json", action="store_true", help="print one JSON object on stdout")
    _simulate(commands["simulate"])
    commands["components"].add_argument("type", metavar="TYPE", nargs="?", help="a component or fluid type")
    commands["circuits"].add_argument("name", metavar="NAME", nargs="?", help="a shipped circuit")
    commands["circuits"].add_argument("--copy", metavar="DIR", help="copy the circuit, its parts and tables to DIR")
    commands["graph"].add_argument("-o", "--output", metavar="F.svg", required=True, help="picture: .svg, .png or .pdf")
    commands["results"].add_argument("file", metavar="FILE", help="a result: .nc, .csv or .parquet")
    commands["results"].add_argument(
        "variables", metavar="VAR", nargs="*", help="variables to print as CSV; * and ? are wild"
    )
    return parser, commands


def _simulate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--stop", metavar="T", help="end time, for example '50 ms'")
    parser.add_argument("--solver", metavar="NAME", help="auto, lsoda, bdf, radau, rk45, dop853, cvode, rodas or dopri")
    parser.add_argument(
        "--compile", action=argparse.BooleanOptionalAction, help="compile the equations; by default where it pays"
    )
    parser.add_argument("--rtol", metavar="R", type=_number, help="relative tolerance of every state")
    parser.add_argument("--output-step", metavar="DT", help="uniform output grid, for example '0.1 ms'")
    parser.add_argument("-o", "--output", metavar="FILE", help=".nc, .csv or .parquet; none writes nothing")
    parser.add_argument(
        "--record", action="append", default=[], metavar="GLOB", help="variables to write; only * and ? are wild"
    )
    parser.add_argument("--plot", action="store_true", help="write the circuit's plots as PNG files beside the result")
    parser.add_argument("--quiet", action="store_true", help="no progress and no summary")


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number; write for example 1e-6") from None


if __name__ == "__main__":
    sys.exit(main())
