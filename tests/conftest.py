"""Fixtures of several test files."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from refusing import Refusal


@pytest.fixture
def refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Refusal:
    """Runs circuits in a folder of their own, where a file's name is its path."""
    monkeypatch.chdir(tmp_path)
    return Refusal(tmp_path, capsys)


@pytest.fixture(scope="session", autouse=True)
def cache_of_the_tests(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What tests compile is built anew, and leaves the user's cache alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CRESCENTLAB_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield
