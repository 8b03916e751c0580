"""``crescentlab study``: run the points of a study file in parallel, print its table, write its pictures."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from crescentlab.cli import DONE, FAILED
from crescentlab.commands import arguments as shared
from crescentlab.commands.text import counted, table
from crescentlab.studies import conduct, tables
from crescentlab.studies.planning import Planned
from crescentlab.studies.pool import LocalPool
from crescentlab.studies.progress import Progress, duration
from crescentlab.studies.run_study import any_good, finish, opened, runner
from crescentlab.studies.store import Row, Store

MIXED = "some rows were made before crescentlab itself changed; --fresh makes all of them anew"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("study", metavar="STUDY", help="a study file")
    parser.add_argument("--workers", metavar="N", type=_count, help="processes of this machine; default its cores")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="run on a Dask cluster: tcp://host:8786")
    parser.add_argument("-o", "--output", metavar="FOLDER", help="where rows are kept; default STUDY.results")
    parser.add_argument("--dry-run", action="store_true", help="list the points, run nothing")
    parser.add_argument("--fresh", action="store_true", help="discard the rows there are, begin anew")
    parser.add_argument("--retry", action="store_true", help="run failed, slow and lost points again")
    shared.quiet(parser)
    shared.json(parser)


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of processes; write for example 4")
    return int(text)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    run_on = runner(options.workers, options.scheduler, LocalPool)
    planned, store = opened(Path(options.study), options.output, no_code=options.no_code)
    if options.dry_run:
        return _dry_run(planned, store, options)
    store.open(planned, fresh=options.fresh)
    jobs = conduct.missing(planned, store, options.retry)
    if not options.quiet and not options.json:
        print(_beginning(planned, store, len(jobs)), file=sys.stderr)
    progress = Progress(len(jobs), options.quiet)
    try:
        found = finish(planned, store, jobs, run_on, progress)
    except KeyboardInterrupt:
        done = counted(sum(key in store.rows for key in planned.keys), "point")
        raise KeyboardInterrupt(f"interrupted; {done} kept in {store.folder}, the same command goes on") from None
    rows, files = found.rows, found.files
    if options.json:
        print(json.dumps(report(planned, rows, store, len(jobs), files), indent=2, ensure_ascii=False))
    elif not options.quiet:
        print(summary(planned, rows, len(jobs), progress, files))
    if error := _error(rows):
        print(error, file=sys.stderr)
    return DONE if any_good(rows) else FAILED


def _error(rows: list[Row]) -> str | None:
    """Why a study of which nothing works failed: the first reason; None if any point is done."""
    if any_good(rows):
        return None
    first = next((row for row in rows if row["reason"]), None)
    return "no point is done" + (f"; point {first['point']}: {first['reason']}" if first else "")


def _beginning(planned: Planned, store: Store, todo: int) -> str:
    """What is there and what is to do."""
    total, kept = len(planned.points), sum(key in store.rows for key in planned.keys)
    strange = len(set(store.rows) - set(planned.keys))
    said = [counted(total, "point"), f"{kept} there already" if kept else "", f"{todo} to run"]
    more = f"; {counted(strange, 'stored row')} of points that the study has no more" if strange else ""
    more += f"\n{MIXED}" if store.mixed else ""
    return f"{planned.study.name}: {', '.join(part for part in said if part)}{more}"


def _dry_run(planned: Planned, store: Store, options: argparse.Namespace) -> int:
    store.read()
    changed = store.changed(planned)
    jobs = {job.key for job in conduct.missing(planned, store, options.retry)}
    if options.json:
        listed = [
            {"point": k, "key": key, "role": p.role, "settings": dict(p.settings), "stored": key not in jobs}
            for k, (p, key) in enumerate(zip(planned.points, planned.keys, strict=True), start=1)
        ]
        print(json.dumps({"status": "planned", "points": listed, "changed": changed or None}, indent=2))
        return DONE
    roles, units = any(point.role for point in planned.points), tables.units(planned)
    names = list(planned.quantities)
    rows = [("point", *(("role",) if roles else ()), *(tables.heading(n, units[n]) for n in names), "")]
    for k, (point, key) in enumerate(zip(planned.points, planned.keys, strict=True), start=1):
        role = (point.role,) if roles else ()
        cells = [_planned_value(planned, name, point.settings[name], units[name]) for name in names]
        rows.append((str(k), *role, *cells, "" if key in jobs else "stored"))
    print(table(rows, right=tables.right_columns(planned, names, roles)))
    if changed:
        print(f"\nThe stored rows rest on something else ({changed}); --fresh discards them.")
    return DONE


def _planned_value(planned: Planned, name: str, text: str, unit: str) -> str:
    """A setting in its display unit; an expression as it is written."""
    value = planned.number(name, text)
    return text if value != value else tables.shown(value, planned.quantity(name), unit)


# -- what is printed -----------------------------------------------------------------------------


def report(planned: Planned, rows: list[Row], store: Store, ran: int, files: list[Path]) -> dict[str, Any]:
    """The object of ``--json``: rows in SI."""
    statuses = Counter(row["status"] for row in rows)
    return {
        "status": "done" if any_good(rows) else "failed", "study": planned.study.name,
        "points": len(planned.points), "ran": ran, "rows": dict(statuses),
        "units": {n: q.si for n, q in {**planned.quantities, **planned.measures}.items() if q},
        "table": [{name: _finite(v) for name, v in row.items() if name != "settings"} for row in rows],
        "folder": str(store.folder), "files": [str(path) for path in files], "warnings": _warnings(rows),
        "error": _error(rows),
    }  # fmt: skip


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _warnings(rows: list[Row]) -> list[str]:
    return list(dict.fromkeys(row["warnings"] for row in rows if row["warnings"]))


def summary(planned: Planned, rows: list[Row], ran: int, progress: Progress, files: list[Path]) -> str:
    """The table, what samples and tolerances come to, and what was written."""
    parts = [planned.study.sections.title or planned.study.name]
    right = tables.right_columns(planned, tables.units(planned), any(row.get("role") for row in rows))
    parts.append(table(tables.text_rows(planned, rows), right=right, indent="  "))
    if len(rows) > tables.SHOWN:
        parts[-1] += f"\n  and {counted(len(rows) - tables.SHOWN, 'row')} more in {files[0]}"
    for cells in (tables.statistics(planned, rows), tables.effect_rows(planned, rows)):
        if cells:
            parts.append(table(cells, right=range(1, len(cells[0])) if cells[0][0] == "" else (2, 3), indent="  "))
    statuses = Counter(row["status"] for row in rows)
    said = ", ".join(f"{count} {status}" for status, count in statuses.items())
    took = f" in {duration(progress.elapsed)}" if ran else ""
    facts = [f"  {counted(len(rows), 'row')}: {said}; {ran} run now{took}"]
    facts += [f"  warning: {warning}" for warning in _warnings(rows)]
    return "\n\n".join([*parts, "\n".join([*facts, *[f"  wrote {path}" for path in files]])])
