"""C text -> shared library, by the machine's compiler, kept in a cache keyed by content.

The key is made of the text, the flags, the compiler and the machine, so that nothing in the cache grows stale: what is
looked up is what would be built. The cache lies in the user's cache folder; ``CRESCENTLAB_CACHE`` names another.
"""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import shlex
import shutil
import signal
import subprocess
import tempfile
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from platformdirs import user_cache_path

from crescentlab.errors import CompilerError

EXACT = ("-O1", "-std=c99", "-fPIC", "-shared", "-fno-math-errno", "-ffp-contract=off")
"""No flag that changes a number."""
NATIVE = (
    "-O2",
    "-std=c99",
    "-fPIC",
    "-shared",
    "-fno-math-errno",
    "-fno-semantic-interposition",
    "-fno-tree-slp-vectorize",  # GCC 12 with AVX-512 mixes lanes up; what is worth it is gathered by hand (wide.h)
    "-freciprocal-math",
    "-march=native",
)
"""For this machine alone."""
CANDIDATES = ("cc", "gcc", "clang")


@functools.cache
def command() -> tuple[str, ...]:
    """The compiler's command, empty if the machine has none; ``CC`` names another than ``cc``."""
    wanted = shlex.split(os.environ.get("CC", ""))
    if wanted:
        return tuple(wanted) if shutil.which(wanted[0]) else ()
    return next(((name,) for name in CANDIDATES if shutil.which(name)), ())


def require() -> None:
    """Raise :class:`CompilerError` if the machine has no compiler."""
    if not command():
        raise CompilerError("no C compiler found (cc, gcc, clang, or what the variable CC names)")


@functools.cache
def identity() -> tuple[object, ...]:
    """What tells this compiler and this machine from others."""
    program = Path(shutil.which(command()[0]) or "").resolve()
    facts = program.stat()
    machine = (platform.system(), platform.machine(), _abilities())
    return (*command(), str(program), facts.st_size, facts.st_mtime_ns, *machine)


def _abilities() -> str:
    """What the processor can do, where the system tells: a home may be shared by several machines."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith(("flags", "Features"))), "")


def cache() -> Path:
    """The folder of built libraries; may not exist yet."""
    return Path(os.environ.get("CRESCENTLAB_CACHE") or user_cache_path("crescentlab"))


@dataclass(frozen=True)
class Source:
    """What a library is built from: texts by file name, and flags."""

    texts: Mapping[str, str]
    flags: tuple[str, ...] = EXACT


def place(source: Source) -> Path:
    """Where the library of this source lies once it is built."""
    key = hashlib.sha256(repr((sorted(source.texts.items()), source.flags, identity())).encode()).hexdigest()
    return cache() / f"{key[:32]}.so"


def build(source: Source, job: Job | None = None) -> Path:
    """The library of a source, built unless the cache has it.

    Raises :class:`CompilerError` without a compiler, if it fails, or if the cache cannot be written.
    """
    require()
    target = place(source)
    if target.is_file():
        return target
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            for name, text in source.texts.items():
                Path(folder, name).write_text(text, encoding="utf-8")
            units = [name for name in source.texts if name.endswith(".c")]
            called = [*command(), *source.flags, *units, "-o", "made.so", "-lm"]
            running = subprocess.Popen(
                called, cwd=folder, text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
            )
            if job is not None:
                job.process = running
            said = running.communicate()[1]
            if running.returncode:
                raise CompilerError(f"{shlex.join(command())} failed: {_first_error(said)}")
            os.replace(Path(folder, "made.so"), target)  # another process may have been quicker: the same bytes
    except OSError as error:
        raise CompilerError(f"the cache {cache()} cannot be used ({error.strerror or error})") from None
    return target


class Job(threading.Thread):
    """Several libraries built one after another beside what the caller does meanwhile."""

    def __init__(self, sources: Mapping[str, Source]) -> None:
        super().__init__(daemon=True)
        self.sources = dict(sources)
        self.libraries: dict[str, Path] = {}
        self.process: subprocess.Popen[str] | None = None
        self.cancelled = False
        self.error: CompilerError | None = None

    def run(self) -> None:
        """Build all, unless cancelled."""
        try:
            for name, source in self.sources.items():
                if self.cancelled:
                    return
                self.libraries[name] = build(source, job=self)
        except CompilerError as error:
            self.error = error

    def cancel(self) -> None:
        """Stop building, and wait until it has stopped."""
        self.cancelled = True
        while self.is_alive():
            if self.process is not None:
                _kill(self.process)
            self.join(0.05)


def _kill(process: subprocess.Popen[str]) -> None:
    """End a compiler and the passes it has started."""
    try:
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)  # its own session, hence its own group
        else:
            process.kill()
    except ProcessLookupError:
        pass


def _first_error(text: str) -> str:
    lines = text.strip().splitlines()
    return next((line for line in lines if "error" in line), lines[0] if lines else "it said nothing")
