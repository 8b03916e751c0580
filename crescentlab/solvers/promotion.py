"""Which form of the system's functions a run calls: interpreted, or C compiled before it or beside it.

Beside a run, and out of the cache unasked, functions are compiled exactly as CasADi writes them: they give what
interpreted ones give to the last bit, so that nobody can tell from a result when they took over. Asked for, they are
compiled for this machine with their slow operations in vectors, which moves last digits and is about twice as fast.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from crescentlab import compiler
from crescentlab.c_text import c_text, wide_sources
from crescentlab.errors import CompilerError
from crescentlab.prepared import Evaluator, Prepared
from crescentlab.system import System

LARGEST = 40_000
"""Functions of more instructions are not compiled: the compiler's time grows faster than they do."""
PATIENCE = 0.3
"""Seconds of a run before what is left of it is guessed."""
SECONDS = 4e-4
"""What a compiler takes for an instruction, at most."""


class Promotion:
    """The functions of one run, on their way from interpreted to compiled."""

    def __init__(self, system: System, names: Iterable[str], wanted: bool | None, saving: float) -> None:
        """``wanted``: True before the run, False never, None when it pays; ``saving``: share of the run it saves."""
        self.system, self.wanted, self.saving = system, wanted, saving
        self.form = "wide" if wanted else "exact"
        self.names = tuple(names)
        self.job: compiler.Job | None = None
        self.sources: dict[str, compiler.Source] = {}
        """What is not compiled yet, and might be."""
        self.settled = False
        """Whether everything is compiled, or never will be in this run."""

    def take(self, name: str) -> Prepared:
        """The function of this name in the form it has now."""
        interpreted: Prepared = getattr(self.system, name)
        return interpreted if self.wanted is False else self.system.built.get((name, self.form), interpreted)

    @property
    def compiled(self) -> bool:
        """Whether any function is compiled."""
        return self.wanted is not False and any((name, self.form) in self.system.built for name in self.names)

    def before(self) -> str | None:
        """Compile what is asked for; a notice if that is not possible."""
        if not self.wanted:
            return None
        try:
            self.gather()
            with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
                libraries = pool.map(compiler.build, self.sources.values())
                self.adopt(dict(zip(tuple(self.sources), libraries, strict=True)))
        except CompilerError as error:
            return f"functions are interpreted: {error}"
        return None

    def gather(self) -> None:
        """The C of what is not compiled yet; raises :class:`CompilerError` if it cannot be."""
        compiler.require()
        missing = [name for name in self.names if (name, self.form) not in self.system.built]
        size = max((getattr(self.system, name).function.n_instructions() for name in missing), default=0)
        if size > LARGEST:
            raise CompilerError(f"one has {size} instructions, more than the {LARGEST} that a compiler takes well")
        self.sources = {name: self.source(name) for name in missing}

    def source(self, name: str) -> compiler.Source:
        """C of a function."""
        function = getattr(self.system, name).function
        if self.form == "wide":
            return compiler.Source(wide_sources(function), compiler.NATIVE)
        return compiler.Source({"function.c": c_text(function)})

    def adopt(self, libraries: dict[str, Path]) -> None:
        """Call functions out of libraries from now on, in this run and later ones of its kind."""
        for name, path in libraries.items():
            self.system.built[name, self.form] = getattr(self.system, name).from_library(path)
            del self.sources[name]

    @property
    def seconds(self) -> float:
        """About how long compiling what is left would take."""
        counts = [int(getattr(self.system, name).function.n_instructions()) for name in self.sources]
        return SECONDS * sum(counts)

    def look(self, elapsed: float, share: float, evaluators: dict[str, list[Evaluator]]) -> bool:
        """See beside a run whether compiling pays or is done; whether functions have just been replaced."""
        if self.wanted is not None or self.settled or elapsed < PATIENCE:
            return False
        if self.job is None:
            if not self.sources:
                return self.replace(self.from_cache(), evaluators)
            left = elapsed * (1 - share) / share if share > 0 else 0.0
            if self.saving * (left - self.seconds) > self.seconds:
                self.job = compiler.Job(self.sources)
                self.job.start()
            return False
        if self.job.is_alive():
            return False
        self.settled = True
        return self.replace(dict(self.job.libraries), evaluators)

    def from_cache(self) -> dict[str, Path]:
        """What an earlier run compiled."""
        try:
            self.gather()
            known = {name: compiler.place(source) for name, source in self.sources.items()}
        except CompilerError:
            known = {}
        found = {name: path for name, path in known.items() if path.is_file()}
        self.settled = len(found) == len(known)
        return found

    def replace(self, libraries: dict[str, Path], evaluators: dict[str, list[Evaluator]]) -> bool:
        """Let the evaluators call what libraries have; whether there is any."""
        self.adopt(libraries)
        for name in libraries:
            for evaluator in evaluators.get(name, []):
                evaluator.use(self.take(name).function)
        return bool(libraries)

    def end(self) -> None:
        """The run is over."""
        if self.job is not None:
            self.job.cancel()
