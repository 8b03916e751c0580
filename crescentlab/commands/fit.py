"""``crescentlab fit``: fit parameters of a circuit to measured data."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from crescentlab.cli import DONE
from crescentlab.commands import arguments as shared
from crescentlab.commands.fit_text import summary
from crescentlab.commands.simulate import finite, progress_bar
from crescentlab.commands.text import settings
from crescentlab.files import check_writable, write_text
from crescentlab.studies.fit_pictures import write_pictures
from crescentlab.studies.fit_problem import read_problem
from crescentlab.studies.fit_report import report, run_fit


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("fit", metavar="FIT.yaml", help="a fit file: circuit, data, parameters between bounds")
    shared.settings(parser)
    parser.add_argument("-o", "--output", metavar="FILE.json", help="write parameters, correlations and residuals")
    parser.add_argument("--plot", action="store_true", help="write a picture of the residuals of each measured column")
    parser.add_argument("--starts", metavar="N", type=_whole, help="number of searches instead of the file's")
    parser.add_argument(
        "--workers", metavar="N", type=_whole, help="runs side by side; by default one per processor core"
    )
    shared.json(parser)
    shared.quiet(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    path = Path(options.fit)
    target = _target(options.output)
    problem = read_problem(path, settings(options.set), starts=options.starts, no_code=options.no_code)
    with progress_bar(options.quiet) as progress:
        found = run_fit(problem, workers=options.workers, progress=progress)
    made = finite(report(found))
    base = target.with_suffix("") if target else Path(problem.name)
    pictures = write_pictures(found, base) if options.plot else []
    if target is not None:
        write_text(target, json.dumps(made, indent=2) + "\n")
    if options.json:
        print(json.dumps({**made, "file": str(target) if target else None}, indent=2))
    elif not options.quiet:
        print(summary(found))
        written = [*([target] if target else []), *pictures]
        if written:
            print("\n" + "\n".join(f"  wrote {each}" for each in written))
    return DONE


def _whole(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1")
    return value


def _target(output: str | None) -> Path | None:
    """The file to write, checked before the fit."""
    if output is None or output == "none":
        return None
    path = Path(output)
    check_writable(path, (".json",), f"the suffix must be .json; write for example -o {path.stem or 'fit'}.json")
    return path
