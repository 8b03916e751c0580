"""System -> Trajectory: one event loop over SciPy's steppers."""
