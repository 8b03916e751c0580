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
import subprocess
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path

from platformdirs import user_cache_path

from crescentlab.errors import CompilerError

FLAGS = ("-O1", "-std=c99", "-fPIC", "-shared", "-fno-math-errno", "-ffp-contract=off")
"""No flag that changes a number: compiled functions give what interpreted ones give, to the last bit."""
CANDIDATES = ("cc", "gcc", "clang")


@functools.cache
def command() -> tuple[str, ...]:
    """The compiler's command, empty if the machine has none; ``CC`` names another than ``cc``."""
    wanted = shlex.split(os.environ.get("CC", ""))
    if wanted:
        return tuple(wanted) if shutil.which(wanted[0]) else ()
    return next(((name,) for name in CANDIDATES if shutil.which(name)), ())


@functools.cache
def identity() -> tuple[object, ...]:
    """What tells this compiler and this machine from others."""
    program = Path(shutil.which(command()[0]) or "").resolve()
    facts = program.stat()
    return (*command(), str(program), facts.st_size, facts.st_mtime_ns, platform.system(), platform.machine())


def cache() -> Path:
    """The folder of built libraries; may not exist yet."""
    return Path(os.environ.get("CRESCENTLAB_CACHE") or user_cache_path("crescentlab"))


def place(sources: Mapping[str, str], flags: tuple[str, ...] = FLAGS) -> Path:
    """Where the library of these sources lies once it is built."""
    key = hashlib.sha256(repr((sorted(sources.items()), flags, identity())).encode()).hexdigest()
    return cache() / f"{key[:32]}.so"


def build(sources: Mapping[str, str], flags: tuple[str, ...] = FLAGS, job: Job | None = None) -> Path:
    """The library of C sources (file name -> text), built unless the cache has it.

    Raises :class:`CompilerError` without a compiler, if it fails, or if the cache cannot be written.
    """
    if not command():
        raise CompilerError("no C compiler found (cc, gcc, clang, or what the variable CC names)")
    target = place(sources, flags)
    if target.is_file():
        return target
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            for name, text in sources.items():
                Path(folder, name).write_text(text, encoding="utf-8")
            units = [name for name in sources if name.endswith(".c")]
            running = subprocess.Popen(
                [*command(), *flags, *units, "-o", "made.so", "-lm"], cwd=folder, text=True, stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
            )  # fmt: skip
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

    def __init__(self, texts: Mapping[str, str]) -> None:
        super().__init__(daemon=True)
        self.texts = texts
        self.libraries: dict[str, Path] = {}
        self.process: subprocess.Popen[str] | None = None
        self.cancelled = False
        self.error: CompilerError | None = None

    def run(self) -> None:
        """Build all, unless cancelled."""
        try:
            for name, text in self.texts.items():
                if self.cancelled:
                    return
                self.libraries[name] = build({"function.c": text}, job=self)
        except CompilerError as error:
            self.error = error

    def cancel(self) -> None:
        """Stop building, as soon as may be."""
        self.cancelled = True
        if self.is_alive() and self.process is not None:
            self.process.terminate()
            self.join(5)


def _first_error(text: str) -> str:
    lines = text.strip().splitlines()
    return next((line for line in lines if "error" in line), lines[0] if lines else "it said nothing")
