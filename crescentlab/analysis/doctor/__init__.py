"""What is fast and slow in a circuit, what limits its steps, and which line models are too coarse."""

from crescentlab.analysis.doctor.examination import (
    Examination,
    advice,
    bound_of,
    examine,
    hertz_text,
    mode_text,
    report,
    time_text,
)

__all__ = ["Examination", "advice", "bound_of", "examine", "hertz_text", "mode_text", "report", "time_text"]
