"""Amplitude spectra of a run over whole periods, and the waterfall of a run-up."""

from crescentlab.analysis.spectrum.lines import (
    Series,
    Spectrum,
    spectra,
    spectra_of_rows,
)

__all__ = ["Series", "Spectrum", "spectra", "spectra_of_rows"]
