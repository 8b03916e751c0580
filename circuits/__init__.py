"""Circuits and subcircuits shipped with crescentlab, as YAML files."""
