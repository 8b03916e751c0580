"""Points on a Dask cluster: the same jobs and replies, each cluster worker with a process of its own to kill.

Every worker needs crescentlab installed and must see the circuit's files under the same path; shipped circuits are
everywhere.
"""

from __future__ import annotations

import atexit
import importlib
import threading
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

from crescentlab.errors import InputError
from crescentlab.studies.points import LOST, Job, Reply
from crescentlab.studies.pool import Worker

AHEAD = 2
"""Points sent to the cluster for each that can run: no worker waits, and an interrupted study leaves little behind."""
PATIENCE = "10 s"
"""How long the scheduler may take to answer."""

_workers: dict[int, Worker] = {}


def on_cluster(job: Job) -> Reply:
    """Run one point, on a worker of the cluster, in a process kept for its thread."""
    thread = threading.get_ident()
    if thread not in _workers:
        _workers[thread] = Worker()
        atexit.register(_workers[thread].close)
    return _workers[thread].run(job)


class DaskPool:
    """The workers of a Dask cluster."""

    def __init__(self, address: str) -> None:
        """Connect; raises :class:`InputError` if Dask is missing or nobody answers."""
        try:
            self.library: Any = importlib.import_module("distributed")
        except ImportError:
            raise InputError("--scheduler needs Dask; install it: pip install 'crescentlab[dask]'") from None
        try:
            self.client = self.library.Client(address, timeout=PATIENCE)
        except (OSError, ValueError) as error:
            raise InputError(f"--scheduler {address}: no scheduler answers ({error})") from None
        if not self.width:
            self.client.close()
            raise InputError(f"--scheduler {address}: the cluster has no workers; start some: dask worker {address}")

    @property
    def width(self) -> int:
        """How many points run at once: threads of all workers."""
        return sum(self.client.nthreads().values())

    def run(self, jobs: Iterable[Job]) -> Iterator[Reply]:
        """Replies in the order in which they are done."""
        waiting = iter(jobs)
        sent: dict[str, Job] = {}

        def send(job: Job) -> Any:
            future = self.client.submit(on_cluster, job, pure=False)
            sent[future.key] = job
            return future

        pending = self.library.as_completed([send(job) for job in islice(waiting, AHEAD * self.width)])
        for future in pending:
            job = sent.pop(future.key)
            if future.status == "finished":
                yield future.result()
            else:
                yield Reply(job.key, LOST, f"its cluster worker failed: {future.exception()}".replace("\n", " "))
            for following in islice(waiting, 1):
                pending.add(send(following))

    def close(self) -> None:
        """Leave the cluster; what it still computes for this study is dropped."""
        self.client.close()
