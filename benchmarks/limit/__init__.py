"""The limit: the crescent pump's flat equations and a stepping loop of their own, written by hand in C.

``pump.c`` holds the equations, ``loop.c`` the methods and stops, ``parameters.py`` prints the circuit's numbers as a
header. ``python benchmarks/limit`` builds, checks against the circuit and prints what a revolution costs.
"""

from .driver import FLAGS, Build, Outcome, build, run

__all__ = ["FLAGS", "Build", "Outcome", "build", "run"]
