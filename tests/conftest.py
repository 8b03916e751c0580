"""Fixtures of several test files."""

from pathlib import Path

import pytest
from refusing import Refusal


@pytest.fixture
def refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Refusal:
    """Runs circuits in a folder of their own, where a file's name is its path."""
    monkeypatch.chdir(tmp_path)
    return Refusal(tmp_path, capsys)
