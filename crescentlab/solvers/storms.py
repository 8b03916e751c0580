"""Events that follow one another so closely that a rule chatters: told while the run goes on, with the rule's name."""

from __future__ import annotations

import logging

import numpy as np

from crescentlab.system import System

log = logging.getLogger("crescentlab")

STORM_STEPS = 3
"""Two turns of one name with fewer accepted steps between them are close."""
STORM_COUNT = 1000
"""So many close turns one after another are a storm."""


class Storms:
    """Close turns in a row of every event and relation that states bring about; what a clock does is no storm."""

    def __init__(self, system: System) -> None:
        self.names = [event.name for event in system.events] + list(system.bits.names)
        self.places = {name: k for k, name in enumerate(self.names[: len(system.events)])}
        self.counted = np.concatenate((system.events_on_states, system.bits.on_state & system.bits.switches))
        """Shape (events + relations,)."""
        self.last = np.full(len(self.names), -(2**62))
        """Accepted steps at the last turn."""
        self.row = np.zeros(len(self.names), np.int64)
        """Close turns in a row; it stays where it is once it is a storm."""
        self.seen = np.zeros(len(self.names), bool)

    def turned(self, places: np.ndarray | list[int], steps: int) -> None:
        """Events or relations that turn after so many accepted steps."""
        close = steps - self.last[places] < STORM_STEPS
        self.last[places] = steps
        rows = self.row[places]
        self.row[places] = np.where(rows >= STORM_COUNT, rows, np.where(close, rows + 1, 0))

    def look(self, t: float) -> list[str]:
        """Warnings of storms that nobody has been told of."""
        new = np.flatnonzero((self.row >= STORM_COUNT) & self.counted & ~self.seen)
        self.seen[new] = True
        warnings = [
            f"{self.names[k]} has turned {STORM_COUNT} times with fewer than {STORM_STEPS} steps between, up to "
            f"{t:.6g} s; if it chatters, give the rule hysteresis or the part a mode that rests"
            for k in new.tolist()
        ]
        for warning in warnings:
            log.warning("warning: %s", warning)
        return warnings
