"""System -> Trajectory: an event loop over the steppers of SciPy and SUNDIALS, and a compiled one with its own."""
