"""crescentlab: hydraulic circuits, written in YAML, become one global ODE."""
