"""The manual's page on components of one's own, run from top to bottom exactly as it is written."""

from __future__ import annotations

import doctest
import os
import re
import subprocess
import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[1] / "docs" / "write_a_component.md"
INSTALLS = "## A library that others install"
"""From here on the page installs something."""

PIP = """\
#!/bin/sh
test "$1" = install && cd "$2" && exec "{python}" -W ignore -c "import setuptools; setuptools.setup()" --quiet \\
    install_lib --install-dir "{site}" install_egg_info --install-dir "{site}"
"""
"""Stands in for `pip install FOLDER`: the build backend that the folder names puts packages and metadata in place.

pip itself would first fetch that backend from the network, and install into the environment of these tests.
"""


@dataclass
class Reader:
    """Someone who does what the page says, in a folder that was empty."""

    folder: Path
    site: Path
    said: str = ""

    def follows(self, text: str) -> None:
        """Write each file, run each command, and compare what the last commands said with the page."""
        for kind, block in re.findall(r"```(\w+)\n(.*?)```", text, re.DOTALL):
            name = re.match(r"# file: (\S+)\n", block)
            if name:
                path = self.folder / name[1]
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(block[name.end() :], encoding="utf-8")
            elif kind == "sh":
                self.said = self.runs(block)
            elif kind == "text":
                same = doctest.OutputChecker().check_output(block, self.said, doctest.ELLIPSIS)
                assert same, f"the page says\n{block}\nbut the commands said\n{self.said}"
            else:
                pytest.fail(f"the block is neither a file nor a command:\n{block}")

    def runs(self, commands: str) -> str:
        """What the commands say, each of which must succeed."""
        programs = os.pathsep.join([str(self.site / "bin"), sysconfig.get_path("scripts"), os.environ["PATH"]])
        inherited = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PYTEST"))}
        environment = {**inherited, "PATH": programs, "PYTHONPATH": str(self.site)}
        run = subprocess.run(
            ["sh", "-ec", commands], cwd=self.folder, env=environment, capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, f"{commands}\n{run.stdout}\n{run.stderr}"
        assert not run.stderr, f"{commands}\n{run.stderr}"
        return run.stdout


def pages() -> tuple[str, str]:
    """The page before and from the heading under which something is installed; both without what only explains."""
    text = PAGE.read_text(encoding="utf-8")
    first, second = text.split(INSTALLS)
    return first, second.split("\n## ")[0]


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Reader:
    """The reader who has followed the page up to the library that others install."""
    site = tmp_path_factory.mktemp("site")
    pip = site / "bin" / "pip"
    pip.parent.mkdir()
    pip.write_text(PIP.format(python=sys.executable, site=site), encoding="utf-8")
    pip.chmod(0o755)
    found = Reader(tmp_path_factory.mktemp("reader"), site)
    found.follows(pages()[0])
    return found


def test_from_nothing_to_a_verified_component(reader: Reader) -> None:
    """The files are those of the page, and the last command printed what it says: 1.25 bar by the orifice equation."""
    assert {path.name for path in reader.folder.iterdir() if path.is_file()} == {
        "linear_check_valve.py", "test_linear_check_valve.py", "check_valve.yaml",
    }  # fmt: skip
    found = re.search(r"p_line\.p +bar +(\S+)", reader.said)
    assert found is not None
    assert float(found[1]) == pytest.approx(1.25, rel=2e-4)  # 3.58 L/min is rounded by 1.4e-4


def test_a_library_that_others_install(reader: Reader) -> None:
    pytest.importorskip("setuptools", reason="the page's library is built with it, and nothing is fetched")
    reader.follows(pages()[1])
    assert "2 passed" in reader.said
    assert (reader.site / "my_hydraulics" / "check_valves.py").is_file()


def test_the_reader_notices(reader: Reader) -> None:
    """A page that promises something else is refused, and so is a command that fails."""
    with pytest.raises(AssertionError, match="the page says"):
        reader.follows("```sh\necho two\n```\n```text\nthree\n```")
    with pytest.raises(AssertionError, match="there is no such thing"):
        reader.follows("```sh\necho there is no such thing >&2; exit 3\n```")
