"""``crescentlab rerun``: repeat one row of a study exactly, and write its result over time."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from crescentlab.cli import DONE, FAILED
from crescentlab.commands import arguments as shared
from crescentlab.commands.text import table
from crescentlab.errors import InputError
from crescentlab.series_files import result_target
from crescentlab.studies import conduct, tables
from crescentlab.studies.planning import Planned, plan_study
from crescentlab.studies.points import DONE as GOOD
from crescentlab.studies.points import LOST, SLOW, without_limit
from crescentlab.studies.pool import Worker
from crescentlab.studies.store import Row, Store, row_of
from crescentlab.studies.study_file import Study
from crescentlab.studies.worker import CHANGED

COMPARED = ("status", "reason", "warnings", "final_time", "steps")
"""Bookkeeping that must come out the same; how long it took need not."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("study", metavar="STUDY", help="a study file")
    parser.add_argument("row", metavar="ROW", help="number of the point, or the beginning of its key")
    shared.result_file(parser)
    parser.add_argument("--rows", metavar="FOLDER", help="where the study's rows are kept; default STUDY.results")
    shared.quiet(parser)
    shared.json(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    study = Study.read(Path(options.study))
    planned = plan_study(study, no_code=options.no_code)
    store = Store(conduct.results_folder(study.path, options.rows))
    number, stored = _row(planned, store, options.row)
    target = result_target(options.output, f"{study.name}-{number}")
    job = replace(
        planned.job(planned.points[number - 1]),
        settings=json.loads(stored["settings"]), write=str(target.resolve()) if target is not None else None,
    )  # fmt: skip
    worker = Worker()
    try:
        reply = worker.run(without_limit(job))
    finally:
        worker.close()
    if reply.status == CHANGED:
        raise InputError(reply.reason)
    row = row_of(reply, job, planned)
    comparable = stored["status"] not in (SLOW, LOST)
    different = [n for n in (*COMPARED, *planned.measures) if stored[n] != row[n]] if comparable else []
    written = target if target is not None and target.is_file() else None
    if options.json:
        print(json.dumps(_report(number, stored, row, different, comparable, written), indent=2, ensure_ascii=False))
    elif not options.quiet:
        print(_summary(planned, number, stored, row, different, comparable, written))
    if different:
        print(f"row {number} does not come out the same: {', '.join(different)}", file=sys.stderr)
        return FAILED
    return DONE if row["status"] == GOOD or comparable else FAILED


def _row(planned: Planned, store: Store, asked: str) -> tuple[int, Row]:
    """Number and stored row of the point that ROW names."""
    store.read()
    if store.manifest is None:
        raise InputError(f"{store.folder}: no rows of a study; run first: crescentlab study {planned.study.path}")
    if changed := store.changed(planned):
        raise InputError(f"{store.folder}: its rows rest on something else ({changed}), so none can be repeated")
    keys = planned.keys
    if asked.isdecimal() and 1 <= int(asked) <= len(keys):
        number = int(asked)
    else:
        found = [k for k, key in enumerate(keys, start=1) if len(asked) >= 4 and key.startswith(asked)]
        if len({keys[k - 1] for k in found}) != 1:
            raise InputError(
                f"row {asked}: no point of this study; write a number from 1 to {len(keys)}, or the beginning of a key"
            )
        number = found[0]
    if keys[number - 1] not in store.rows:
        raise InputError(f"row {number} has not run yet; run first: crescentlab study {planned.study.path}")
    return number, store.rows[keys[number - 1]]


def _said(different: list[str], comparable: bool, stored: Row) -> str:
    if not comparable:
        return f"nothing to compare with: it {stored['reason']}"
    return f"different: {', '.join(different)}" if different else "equal to the last bit"


def _report(
    number: int, stored: Row, row: Row, different: list[str], comparable: bool, written: Path | None
) -> dict[str, Any]:
    """The object of ``--json``: both rows, SI."""
    return {
        "status": row["status"], "point": number, "equal": not different if comparable else None,
        "different": different, "stored": stored, "now": row, "file": str(written) if written else None,
        "warnings": [row["warnings"]] if row["warnings"] else [], "error": row["reason"] or None,
    }  # fmt: skip


def _summary(
    planned: Planned, number: int, stored: Row, row: Row, different: list[str], comparable: bool, written: Path | None
) -> str:
    """Settings, outcomes then and now, and whether they are the same."""
    settings = "".join(f" --set {name}='{text}'" for name, text in json.loads(row["settings"]).items())
    named = tables.units(planned)
    lines: list[tuple[str, ...]] = [("", "stored", "now"), ("status", stored["status"], row["status"])]
    for name in planned.measures:
        cells = (tables.shown(each[name], planned.quantity(name), named[name], 8) for each in (stored, row))
        lines.append((tables.heading(name, named[name]), *cells))
    facts = [f"  {_said(different, comparable, stored)}"]
    facts += [f"  {row['reason']}"] if row["reason"] else []
    facts += [f"  wrote {written}"] if written else []
    head = f"{planned.study.name}, row {number}:{settings}"
    return "\n\n".join([head, table(lines, right=(1, 2), indent="  "), "\n".join(facts)])
