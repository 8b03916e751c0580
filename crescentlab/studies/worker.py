"""A process that runs points: jobs come in on stdin, replies go out on stdout, both pickled. ``python -m`` starts it.

A process of its own, rather than a fork or a thread, can be killed while it computes, crashes alone, and may be started
from threads, from daemons such as a cluster's workers, and from scripts without a main guard.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from crescentlab import compiler
from crescentlab.circuit import Circuit, load
from crescentlab.errors import CrescentlabError, InputError
from crescentlab.solvers import compiled, loop, native
from crescentlab.solvers.promotion import Promotion
from crescentlab.studies.points import FAILED, Job, Reply, run_point
from crescentlab.studies.provenance import Source

HELLO, BEGUN = "hello", "begun"
"""Said by a process once it can take jobs, and once it has prepared one and begins to compute."""
CHANGED = "changed"
"""Status of a reply: the files behind the circuit are not those the study began with."""


class Workshop:
    """Circuits by their file, each loaded once; its systems stay assembled and compiled."""

    def __init__(self) -> None:
        self.circuits: dict[tuple[str, bool], tuple[Source, Circuit]] = {}

    def circuit(self, job: Job) -> Circuit:
        """The job's circuit; raises :class:`InputError` if its source is not what the job was made for."""
        key = (job.circuit, job.no_code)
        if key not in self.circuits or self.circuits[key][0] != job.source:
            path = Path(job.circuit)
            if not path.is_file():
                raise InputError(f"{path}: no such file where this process runs; every worker must see the circuit")
            circuit = load(path, no_code=job.no_code)
            if changed := job.source.change(path):
                raise InputError(f"{path.name} is not what it was when the study began ({changed}); start it again")
            self.circuits[key] = job.source, circuit
        return self.circuits[key][1]


def prepare(circuit: Circuit, job: Job) -> None:
    """Assemble, and compile what is to be compiled, one process at a time: the others find it in the cache."""
    with suppress(CrescentlabError):  # which the run itself will tell
        system = circuit.system(job.settings)
        section = circuit.netlist.sections.simulation
        solver = job.run.solver or ("rodas" if job.run.analysis == "periodic" else section.solver)
        wanted = section.compile if job.run.compile is None else job.run.compile
        with _one_at_a_time():
            if solver in native.SHAPES:
                native.library()
            if wanted:
                names = compiled.called(system, solver) if solver in native.SHAPES else loop.functions_of(solver)
                Promotion(system, names, True, compiled.SAVING).before()


@contextmanager
def _one_at_a_time() -> Iterator[None]:
    """Held by one process of this machine and user at a time, where the system can lock files."""
    try:
        import fcntl

        compiler.cache().mkdir(parents=True, exist_ok=True)
        file = (compiler.cache() / "preparing.lock").open("w")
    except (ImportError, OSError):
        yield
        return
    with file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def answer(workshop: Workshop, job: Job, out: BinaryIO) -> Reply:
    """Prepare the point, say so, run it."""
    try:
        circuit = workshop.circuit(job)
    except (CrescentlabError, OSError) as error:
        return Reply(job.key, CHANGED, str(error))
    try:
        prepare(circuit, job)
        _send(out, BEGUN)
        return run_point(circuit, job)
    except Exception as error:  # a component's own slip, or one of ours: a row, not the end of the study
        return Reply(job.key, FAILED, f"{type(error).__name__}: {error}".replace("\n", " "))


def _send(out: BinaryIO, message: Any) -> None:
    pickle.dump(message, out)
    out.flush()


def _read(jobs: queue.SimpleQueue[Job]) -> None:
    """Queue what comes in; when the other side is gone, so is the reason to compute."""
    try:
        while True:
            jobs.put(pickle.load(sys.stdin.buffer))
    except (EOFError, OSError, pickle.UnpicklingError):
        os._exit(0)


def main() -> None:
    """Answer jobs until stdin ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one who started the study decides
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a component prints must not come between the replies
    jobs: queue.SimpleQueue[Job] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(jobs,), daemon=True).start()
    workshop = Workshop()
    _send(out, HELLO)
    while True:
        _send(out, answer(workshop, jobs.get(), out))


if __name__ == "__main__":
    main()
