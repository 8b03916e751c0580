"""Analyses of one circuit: operating points, periodic states, linear models, spectra, sensitivities."""
