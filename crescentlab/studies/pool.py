"""Worker processes of this machine: as many points at once as there are, each within its time limit.

A point that takes longer is killed with its process, and a new process takes the next one. One thread per process waits
for it; the caller gets replies as they come.
"""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import IO, Any, Protocol

from crescentlab.errors import SimulationError
from crescentlab.studies.points import LOST, SLOW, Job, Reply
from crescentlab.studies.worker import BEGUN, HELLO
from crescentlab.units import QUANTITIES

PREPARING = 600.0
"""Seconds to load, assemble and compile a circuit; the time limit of a point counts from then on."""
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Processes are the parallelism; threads inside them would only get in each other's way."""


class Runner(Protocol):
    """Runs jobs somewhere."""

    @property
    def width(self) -> int:
        """How many points run at once."""

    def run(self, jobs: Iterable[Job]) -> Iterator[Reply]:
        """Replies in the order in which they are done."""

    def close(self) -> None:
        """End every process, whatever it does."""


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _GoneError(Exception):
    """The process ended in the middle of something."""


class Worker:
    """One process, started when it is first needed and started anew after it was killed."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[bytes] | None = None
        self.log: IO[bytes] | None = None
        self.closed = False
        self.expired = False

    def run(self, job: Job) -> Reply:
        """The reply; of a point that takes too long, or whose process dies, one that says so."""
        process = self._started()
        self.expired = False
        limit = PREPARING
        try:
            self._send(process, job)
            message = self._receive(process, limit)
            if message == BEGUN:
                limit = job.run.time_limit or 0.0
                message = self._receive(process, limit)
        except _GoneError:
            return self._gone(process, job, limit)
        assert isinstance(message, Reply)
        return message

    def close(self) -> None:
        """End the process, whatever it does."""
        self.closed = True
        if self.process is not None:
            self._kill(self.process)

    def _started(self) -> subprocess.Popen[bytes]:
        if self.process is not None and not self.expired and self.process.poll() is None:
            return self.process
        if self.process is not None:
            self._kill(self.process)
        self.log = tempfile.TemporaryFile()  # noqa: SIM115  # lives as long as the process
        command = [sys.executable, "-P", "-m", "crescentlab.studies.worker"]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, env={**os.environ, **ONE_THREAD}
        )
        if self.closed:
            self._kill(self.process)
        self.expired = False
        try:
            message = self._receive(self.process, PREPARING)
        except _GoneError:
            raise SimulationError(f"no worker process can be started: {self._last_words()}") from None
        assert message == HELLO
        return self.process

    def _send(self, process: subprocess.Popen[bytes], job: Job) -> None:
        assert process.stdin is not None
        try:
            pickle.dump(job, process.stdin)
            process.stdin.flush()
        except OSError:
            raise _GoneError from None

    def _receive(self, process: subprocess.Popen[bytes], limit: float) -> Any:
        """The next message; the process is killed after ``limit`` seconds (0: never)."""
        assert process.stdout is not None
        timer = threading.Timer(limit, self._expire, (process,)) if limit else None
        if timer is not None:
            timer.daemon = True
            timer.start()
        try:
            return pickle.load(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            raise _GoneError from None
        finally:
            if timer is not None:
                timer.cancel()

    def _expire(self, process: subprocess.Popen[bytes]) -> None:
        self.expired = True
        process.kill()

    def _kill(self, process: subprocess.Popen[bytes]) -> None:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout, self.log):
            if pipe is not None:
                with suppress(OSError):  # what was still to be written
                    pipe.close()

    def _gone(self, process: subprocess.Popen[bytes], job: Job, limit: float) -> Reply:
        code = process.wait()
        if self.expired:
            return Reply(job.key, SLOW, f"took longer than {_time(limit)}", wall_s=limit)
        ended = f"signal {-code}" if code < 0 else f"exit code {code}"
        words = self._last_words()
        return Reply(job.key, LOST, f"its process ended with {ended}{': ' if words else ''}{words}")

    def _last_words(self) -> str:
        """The last line the process wrote on stderr."""
        if self.log is None or self.log.closed:
            return ""
        self.log.seek(0)
        lines = self.log.read().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else ""


def _time(limit: float) -> str:
    return QUANTITIES["time"].show(limit, "s" if limit >= 1 else "ms")


class LocalPool:
    """Worker processes on this machine."""

    def __init__(self, workers: int) -> None:
        self.workers = [Worker() for _ in range(workers)]
        self.closed = False

    @property
    def width(self) -> int:
        """How many points run at once."""
        return len(self.workers)

    def run(self, jobs: Iterable[Job]) -> Iterator[Reply]:
        """Replies in the order in which they are done; raises what keeps a process from starting."""
        waiting = iter(jobs)
        lock = threading.Lock()
        replies: queue.SimpleQueue[Reply | BaseException | None] = queue.SimpleQueue()

        def serve(worker: Worker) -> None:
            try:
                while not self.closed:
                    with lock:
                        job = next(waiting, None)
                    if job is None:
                        break
                    replies.put(worker.run(job))
            except BaseException as error:
                replies.put(error)
            replies.put(None)

        for worker in self.workers:
            threading.Thread(target=serve, args=(worker,), daemon=True).start()
        serving = len(self.workers)
        while serving:
            reply = replies.get()
            if isinstance(reply, BaseException):
                raise reply
            if reply is None:
                serving -= 1
            else:
                yield reply

    def close(self) -> None:
        """End every process, whatever it does."""
        self.closed = True
        for worker in self.workers:
            worker.close()
