"""Functions of a run compiled before it, or beside it when it turns out to be long.

Compiled functions give what interpreted ones give to the last bit, so that nobody can tell from a result when they took
over.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from crescentlab import compiler
from crescentlab.errors import CompilerError
from crescentlab.prepared import Evaluator
from crescentlab.system import System

LARGEST = 100_000
"""Functions of more instructions are not compiled: the compiler's time grows faster than they do."""
SECONDS = 4e-4
"""What a compiler takes for an instruction (benchmarks/RESULTS.md)."""


class Promotion:
    """The functions of one run on their way from interpreted to compiled."""

    def __init__(self, system: System, names: Iterable[str], wanted: bool | None, saving: float) -> None:
        """``wanted``: True before the run, False never, None when it pays; ``saving``: share of the run it saves."""
        self.system, self.wanted, self.saving = system, wanted, saving
        self.names = [name for name in names if name not in system.in_c]
        self.job: compiler.Job | None = None
        self.texts: dict[str, str] = {}

    def before(self) -> str | None:
        """Compile what is wanted, or take what the cache has; a notice if that is not possible."""
        if self.wanted is False or not self.names:
            return None
        if not compiler.command():
            return (
                "functions are interpreted: no C compiler found (cc, gcc, clang, or what CC names)"
                if self.wanted
                else None
            )
        size = max(getattr(self.system, name).function.n_instructions() for name in self.names)
        if size > LARGEST:
            self.names = []
            return f"functions are interpreted: {size} instructions are too many to compile" if self.wanted else None
        self.texts = self.system.c_texts(self.names)
        try:
            if self.wanted:
                with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
                    paths = list(pool.map(lambda text: compiler.build({"function.c": text}), self.texts.values()))
                self.adopt(dict(zip(self.texts, paths, strict=True)))
            else:
                known = {name: compiler.place({"function.c": text}) for name, text in self.texts.items()}
                self.adopt({name: path for name, path in known.items() if path.is_file()})
        except CompilerError as error:
            self.names = []
            return f"functions are interpreted: {error}"
        return None

    def adopt(self, libraries: dict[str, Path]) -> None:
        self.system.adopt(libraries)
        self.names = [name for name in self.names if name not in libraries]
        for name in libraries:
            self.texts.pop(name)

    @property
    def seconds(self) -> float:
        """About how long compiling what is left would take."""
        counts = [int(getattr(self.system, name).function.n_instructions()) for name in self.names]
        return SECONDS * sum(counts)

    def look(self, elapsed: float, share: float, evaluators: dict[str, list[Evaluator]]) -> bool:
        """See beside a run whether compiling pays or is done; whether functions have just been replaced."""
        if self.wanted is not None or not self.texts:
            return False
        if self.job is None:
            left = elapsed * (1 - share) / share if share > 0 else 0.0
            if self.saving * (left - self.seconds) > self.seconds:
                self.job = compiler.Job(self.texts)
                self.job.start()
            return False
        if self.job.is_alive():
            return False
        libraries = self.job.libraries
        if self.job.error is not None:
            self.texts = {}
        self.adopt(dict(libraries))
        for name in libraries:
            for evaluator in evaluators.get(name, []):
                evaluator.use(getattr(self.system, name).function)
        return bool(libraries)

    def end(self) -> None:
        """The run is over."""
        if self.job is not None:
            self.job.cancel()
