"""Rows of a study on disk: a journal, Parquet parts, and a manifest of what they rest on.

A finished point is one line of the journal at once, so that a process killed in the middle loses the running points
alone. The journal becomes a Parquet part when it is long, when the study ends, and when it is opened again.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TextIO

from crescentlab.errors import InputError
from crescentlab.studies import provenance
from crescentlab.studies.planning import Planned, number_of
from crescentlab.studies.points import Job, Reply
from crescentlab.studies.study_file import SAMPLES

MANIFEST, JOURNAL, LOCK = "manifest.json", "journal.jsonl", "lock"
PART_ROWS = 500
"""Rows of the journal that make a part."""

Row = dict[str, Any]
"""One row: bookkeeping, varied settings and outcomes by name, numbers in SI; None where there is none."""


def row_of(reply: Reply, job: Job, planned: Planned) -> Row:
    """A reply as a row."""
    row: Row = {
        "key": reply.key, "status": reply.status, "reason": reply.reason, "warnings": "; ".join(reply.warnings),
        "settings": json.dumps(dict(job.settings), ensure_ascii=False), "wall_s": reply.wall_s,
        "final_time": reply.final_time, "steps": reply.steps,
    }  # fmt: skip
    for name in job.varied:
        row[name] = reply.values.get(name, number_of(job.settings[name], planned.quantities[name]))
    row.update({name: reply.outcomes.get(name) for name in planned.measures})
    return {name: None if isinstance(v, float) and not math.isfinite(v) else v for name, v in row.items()}


class Store:
    """The folder of a study's rows; one process at a time may add to it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.rows: dict[str, Row] = {}
        """Rows by key; of a point that ran twice, the later one."""
        self.parts = 0
        self.journalled: list[Row] = []
        self._journal: TextIO | None = None
        self._lock: TextIO | None = None
        self.mixed = False
        """Whether some rows were made by a crescentlab whose own sources were others."""
        self._planned: Planned | None = None

    @property
    def manifest(self) -> dict[str, Any] | None:
        """What the rows rest on; None before there are any. Raises :class:`InputError` if it cannot be read."""
        path = self.folder / MANIFEST
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: not the manifest of a study ({error}); name another folder with -o") from None
        if not isinstance(found, dict) or "conditions" not in found:
            raise InputError(f"{path}: not the manifest of a study; name another folder with -o")
        return found

    def changed(self, planned: Planned) -> str:
        """What the stored rows rest on that is different now, in words; empty if nothing is, or nothing is stored."""
        manifest = self.manifest
        return "" if manifest is None else provenance.changes(manifest["conditions"], planned.conditions)

    def kernels(self) -> list[str]:
        """Hashes of the kernels that made the stored rows."""
        manifest = self.manifest or {}
        return [str(each) for each in manifest.get("kernels", [])]

    # -- reading ---------------------------------------------------------------------------------

    def read(self) -> None:
        """Read every row that is stored."""
        self.rows, self.journalled = {}, []
        paths = sorted(self.folder.glob("part-[0-9][0-9][0-9][0-9][0-9].parquet"))
        for path in paths:
            for row in _read_part(path):
                self.rows[row["key"]] = row
        self.parts = max((int(path.stem.partition("-")[2]) for path in paths), default=0)
        with suppress(FileNotFoundError):
            for line in (self.folder / JOURNAL).read_text(encoding="utf-8").split("\n"):
                with suppress(ValueError):  # cut off in the middle of writing
                    row = json.loads(line)
                    self.rows[row["key"]] = row
                    self.journalled.append(row)

    # -- writing ---------------------------------------------------------------------------------

    def open(self, planned: Planned, *, fresh: bool = False) -> None:
        """Begin to add rows; raises :class:`InputError` if others are stored, or another process adds to them."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._take_lock()
            if fresh:
                self._clear()
            if changed := self.changed(planned):
                raise InputError(
                    f"{self.folder} holds rows that rest on something else ({changed}); write --fresh to begin anew, "
                    "or -o FOLDER to begin beside it"
                )
            self.read()
            self._planned = planned
            self.mixed = bool(self.rows) and provenance.kernel() not in self.kernels()
            self._write_manifest("running")
            self.flush()
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be written ({error.strerror or error})") from None
        except BaseException:
            self.release()
            raise

    def _take_lock(self) -> None:
        """Lock the folder, again if the process before removed the file in between: a lock on it would bind nobody."""
        path = self.folder / LOCK
        try:
            import fcntl

            while self._lock is None:
                self._lock = path.open("a+")
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if not path.exists() or not os.path.samestat(os.fstat(self._lock.fileno()), path.stat()):
                    self._lock.close()
                    self._lock = None
        except ImportError:
            return
        except BlockingIOError:
            assert self._lock is not None
            self._lock.close()
            self._lock = None
            raise InputError(
                f"{self.folder}: another process is running this study; wait, or name another -o"
            ) from None

    def _clear(self) -> None:
        """Remove the files of an earlier set; nothing that is not a study's."""
        for path in [*self.folder.glob("part-*.parquet"), self.folder / JOURNAL, self.folder / MANIFEST]:
            path.unlink(missing_ok=True)

    def add(self, row: Row) -> None:
        """Keep a row: it survives whatever happens to this process."""
        assert self._journal is not None
        self.rows[row["key"]] = row
        self.journalled.append(row)
        self._journal.write(json.dumps(row, ensure_ascii=False) + "\n")
        self._journal.flush()
        if len(self.journalled) >= PART_ROWS:
            self.flush()

    def flush(self) -> None:
        """Make a part of the journal, and begin a new one."""
        assert self._planned is not None
        if self._journal is not None:
            self._journal.close()
        if self.journalled:
            self.parts += 1
            part = self.folder / f"part-{self.parts:05d}.parquet"
            write_parquet(part, self.journalled, self._planned, {})
        self._journal = (self.folder / JOURNAL).open("w", encoding="utf-8")
        self.journalled = []

    def close(self, state: str) -> None:
        """Finish: ``complete`` or ``interrupted``."""
        if self._planned is not None:
            self.flush()
            self._write_manifest(state)
        self.release()

    def release(self) -> None:
        """Let other processes add rows; an empty journal and the lock are taken away."""
        if self._journal is not None:
            self._journal.close()
            if not self.journalled:
                (self.folder / JOURNAL).unlink(missing_ok=True)
        if self._lock is not None:
            (self.folder / LOCK).unlink(missing_ok=True)  # while it is held, so that nobody else's is removed
            self._lock.close()
        self._journal = self._lock = None

    def _write_manifest(self, state: str) -> None:
        """What the rows rest on, and how far the study is."""
        assert self._planned is not None
        planned, path = self._planned, self.folder / MANIFEST
        keys = set(planned.keys)
        statuses = [row["status"] for key, row in self.rows.items() if key in keys]
        vary = planned.study.node.find(("vary",)).plain()
        manifest = {
            "crescentlab_study": 1, "study": planned.study.name, "title": planned.study.sections.title,
            "state": state, "time": datetime.now(UTC).isoformat(timespec="seconds"),
            "points": len(planned.points), "rows": {s: statuses.count(s) for s in sorted(set(statuses))},
            "columns": columns(planned), "vary": vary, "seeds": _seeds(planned),
            "kernels": list(dict.fromkeys([*self.kernels(), provenance.kernel()])), "conditions": planned.conditions,
        }  # fmt: skip
        part = path.with_name(f".{path.name}")
        part.write_text(json.dumps(manifest, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
        os.replace(part, path)


def columns(planned: Planned) -> dict[str, str]:
    """Names of varied settings and outcomes, with their SI units; words have none."""
    quantities = {**planned.quantities, **planned.measures}
    return {name: quantity.si if quantity is not None else "" for name, quantity in quantities.items()}


def _seeds(planned: Planned) -> dict[str, int]:
    """Seeds of the samples, by kind."""
    sections = {kind: getattr(planned.study.sections.vary, kind) for kind in SAMPLES}
    return {kind: section.seed for kind, section in sections.items() if section is not None}


def _read_part(path: Path) -> list[Row]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        found: list[Row] = pq.read_table(path).to_pylist()
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path}: not rows of a study ({error}); remove it to compute them anew") from None
    return found


def write_parquet(path: Path, rows: Iterable[Row], planned: Planned, attributes: dict[str, str]) -> None:
    """Rows as a Parquet file, replaced when it is complete; units in the metadata of the columns."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = list(rows)
    texts = {"key", "role", "status", "reason", "warnings", "settings"}
    texts |= {name for name, quantity in planned.quantities.items() if quantity is None}
    texts |= {name for row in rows for name, value in row.items() if isinstance(value, str)}  # varied once, no more
    whole = {"point", "steps"}
    units = {**columns(planned), "wall_s": "s", "final_time": "s"}
    names = list(dict.fromkeys(name for row in rows for name in row))
    kinds = {n: pa.string() if n in texts else pa.int64() if n in whole else pa.float64() for n in names}
    fields = [pa.field(n, kinds[n], metadata={"units": units[n]} if units.get(n) else None) for n in names]
    schema = pa.schema(fields, metadata={"title": planned.study.sections.title, **attributes})
    part = path.with_name(f".{path.name}")
    pq.write_table(pa.Table.from_pylist(rows, schema=schema), part)
    os.replace(part, path)
