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
from crescentlab.errors import ComponentError, CrescentlabError, InputError, nearest

DONE, BUG, WRONG_INPUT, FAILED, INTERRUPTED = 0, 1, 2, 3, 130
"""Exit codes. FAILED is a simulation that could not go on; what it computed is saved."""

RUN_KEYS = (
    "status", "final_time", "wall_s", "steps", "evaluations", "jacobians", "events", "ticks", "restarts", "states",
    "balance", "warnings", "verify", "file", "error",
)  # fmt: skip
"""Keys of the object that ``simulate --json`` prints, whatever happens."""

COMMANDS = {
    "simulate": "integrate a circuit and write its result",
    "check": "who gives what on every net; states, events",
    "components": "the library; with TYPE its ports, parameters, equations, source",
    "circuits": "shipped circuits; with --copy one of them and its parts",
    "graph": "draw the schematic",
    "schema": "JSON schema of circuit files, for editors",
    "new": "write the file of a component of your own",
    "results": "what a result holds; series as CSV on stdout",
    "steady": "find the operating point, where nothing changes any more",
    "periodic": "find the periodic steady state of a circuit with a known period",
    "linearize": "A, B, C, D, modes, frequency responses and impedances at an operating point",
    "spectrum": "amplitude spectrum over whole periods; orders; waterfall of a run-up",
    "doctor": "what is fast, what is slow, and what limits the step",
    "sensitivity": "derivatives of outcomes by parameters",
    "study": "run the points of a study file in parallel",
    "rerun": "repeat one row of a study exactly",
    "fit": "fit parameters to measured data",
}
"""Commands, each a module of :mod:`crescentlab.commands` that declares its ``arguments`` and offers ``run``."""


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
    except CrescentlabError as error:
        return _failed(arguments, str(error), FAILED, "failed")
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
    given = next((a for a in arguments if not a.startswith("-")), None)
    if given is not None and given not in COMMANDS:
        raise InputError(f"unknown command {given!r}: {nearest(given, COMMANDS)}")
    parser, chosen = _parser(given)
    options, extra = parser.parse_known_args(
        _with_negatives(arguments), argparse.Namespace(verbose=False, no_code=False)
    )
    if extra:
        raise InputError(_unexpected(extra, chosen or parser, given or ""))
    if options.command is None:
        raise InputError(f"name a command: {', '.join(COMMANDS)}; see crescentlab --help")
    return options


def _with_negatives(arguments: list[str]) -> list[str]:
    """Values such as -5% joined to the option before them: argparse would take them for options of their own."""
    joined: list[str] = []
    for text in arguments:
        if re.match(r"-\.?\d", text) and joined and re.fullmatch(r"--[a-z][a-z-]*", joined[-1]):
            joined[-1] += f"={text}"
        else:
            joined.append(text)
    return joined


def _unexpected(extra: list[str], parser: argparse.ArgumentParser, command: str) -> str:
    option = next((e.partition("=")[0] for e in extra if e.startswith("-")), None)
    if option is None:
        return f"{command}: unexpected {extra[0]!r}; quote text that has blanks, for example --stop '50 ms'"
    known = set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", parser.format_help()))
    return f"unknown option {option} of crescentlab {command}: {nearest(option, known)}"


def _parser(given: str | None) -> tuple[argparse.ArgumentParser, argparse.ArgumentParser | None]:
    """The whole parser, and that of the given command: the only one whose module is imported and asked."""
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
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands")
    chosen = None
    for name, text in COMMANDS.items():
        command = commands.add_parser(
            name, help=text, description=f"{text[0].upper()}{text[1:]}.", allow_abbrev=False, parents=[common]
        )
        if name == given:
            importlib.import_module(f"crescentlab.commands.{name}").arguments(command)
            chosen = command
    return parser, chosen


if __name__ == "__main__":
    sys.exit(main())
