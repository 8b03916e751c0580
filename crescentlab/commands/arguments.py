"""Arguments that several commands share."""

from __future__ import annotations

import argparse


def circuit(parser: argparse.ArgumentParser) -> None:
    """The circuit, and ``--set``."""
    parser.add_argument("circuit", metavar="CIRCUIT", help="a circuit file, or the name of a shipped circuit")
    settings(parser)


def settings(parser: argparse.ArgumentParser) -> None:
    """``--set``, as often as wanted."""
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="replace a value; VALUE as in the file"
    )


def json(parser: argparse.ArgumentParser) -> None:
    """``--json``."""
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")


def quiet(parser: argparse.ArgumentParser) -> None:
    """``--quiet``."""
    parser.add_argument("--quiet", action="store_true", help="no progress and no summary")


def solver(parser: argparse.ArgumentParser) -> None:
    """The choice of the integration method, its tolerance, and whether functions are compiled."""
    parser.add_argument("--solver", metavar="NAME", help="auto, lsoda, bdf, radau, rk45, dop853, cvode, rodas or dopri")
    parser.add_argument("--rtol", metavar="R", type=number, help="relative tolerance of every state")
    parser.add_argument(
        "--compile", action=argparse.BooleanOptionalAction, help="compile the equations; by default where it pays"
    )


def start(parser: argparse.ArgumentParser) -> None:
    """``--start``."""
    parser.add_argument("--start", metavar="FILE", help="go on from the end of this result")


def result_file(parser: argparse.ArgumentParser) -> None:
    """``-o`` of a command that writes a result."""
    parser.add_argument("-o", "--output", metavar="FILE", help=".nc, .csv or .parquet; none writes nothing")


def number(text: str) -> float:
    """A plain number, as a type of argparse."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number; write for example 1e-6") from None
