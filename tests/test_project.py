"""What holds for the project as a whole: layers, the library's imports, tracked files, a light command line."""

from __future__ import annotations

import ast
import graphlib
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

LAYERS: tuple[tuple[str, ...], ...] = (
    ("errors", "files", "series_files", "symbols", "units", "maths", "compiler", "c_text", "prepared", "columns"),
    ("schedule", "walk", "time_alone", "data_files", "tables", "fluid", "domain", "component", "energy"),
    ("arguments", "expressions", "yaml_text", "explain", "library", "netlist"),
    ("unused",),
    ("elaborate",),
    ("graph", "trace", "contract"),
    ("causality",),
    ("pressures",),
    ("system",),
    ("assembly", "closed_sets"),
    ("solvers",),
    ("balance",),
    ("result", "recorded", "placement", "plotting", "schematic", "verification"),
    ("cold_start", "coarse_lines"),
    ("circuit",),
    ("analysis",),
    ("studies", "report"),
    ("__init__",),
    ("cli", "commands", "__main__"),
)
"""Rooms of the kernel, lowest first. A module imports from its own layer and those above it in this list.

A room is a module or a package directly under `crescentlab/`; `__init__` is the public door itself.
"""

NEVER = {"result": {"system", "trace", "solvers"}}
"""Imports refused although the layers would allow them, types aside: a result is given its evaluator."""

FOR_COMPONENTS = {
    "component",
    "data_files",
    "domain",
    "errors",
    "expressions",
    "fluid",
    "maths",
    "schedule",
    "tables",
    "units",
}
"""Modules of the kernel that component files may import from."""

FOR_PARAMETERS = {"numpy", "pydantic", "pydantic_core"}
"""Packages that component files may use for parameters and start values (equations use `crescentlab.maths`)."""

HEAVY = [
    "casadi",
    "h5netcdf",
    "matplotlib",
    "networkx",
    "numpy",
    "pandas",
    "pyarrow",
    "pydantic",
    "scipy",
    "sksundae",
    "xarray",
]
"""Packages imported only inside commands, so that `crescentlab --version` answers at once."""

RESULT_FILES = {".nc", ".h5", ".hdf5", ".parquet", ".npy", ".npz", ".pickle", ".pkl", ".so", ".whl", ".zip", ".gz"}

ABSOLUTE = re.compile(r"(?<![\w.~)}*/])/(?:work|root|tmp|home|Users|opt|mnt)(?![\w-])")
REGISTRY = re.compile(r"(?i)(?:pypi|pythonhosted|npmjs|anaconda|conda|crates)\.(?:org|com|io)\b|index[-_]url")


def module_name(path: Path) -> str:
    """``crescentlab/solvers/scipy.py`` -> ``solvers.scipy``, a package's ``__init__`` its own name."""
    parts = path.relative_to(ROOT / "crescentlab").with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


@cache
def kernel() -> dict[str, Path]:
    """Modules of the kernel by name, without the leading ``crescentlab.``."""
    return {module_name(path): path for path in sorted((ROOT / "crescentlab").rglob("*.py"))}


@cache
def imported(path: Path, types: bool = True) -> tuple[tuple[str, str | None], ...]:
    """Each (module, name) that a file imports anywhere in it, with or without those for type checking alone."""
    package = path.relative_to(ROOT).parent.parts
    tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
    guards = [node for node in ast.walk(tree) if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    skipped = set() if types else {id(inner) for guard in guards for inner in ast.walk(guard)}
    found: list[tuple[str, str | None]] = []
    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.Import):
            found += [(alias.name, None) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
            found += [(module, alias.name) for alias in node.names]
    return tuple(found)


def kernel_imports(path: Path, types: bool = True) -> Iterator[str]:
    """Names of the kernel's modules that a file imports; ``__init__`` for a name of the public door."""
    for module, name in imported(path, types):
        if module.partition(".")[0] != "crescentlab" or (module, name) == ("crescentlab", "__version__"):
            continue
        inner = module.removeprefix("crescentlab").lstrip(".")
        full = ".".join(part for part in (inner, name) if part)
        yield full if full in kernel() else inner or "__init__"


def layer_of(module: str) -> int:
    """Number of a module's layer; fails for a module that the list does not place."""
    room = module.partition(".")[0]
    for number, layer in enumerate(LAYERS):
        if room in layer:
            return number
    return pytest.fail(f"crescentlab/{room} has no layer yet: place it in LAYERS of {Path(__file__).name}")


@pytest.mark.parametrize("module", kernel())
def test_a_module_imports_only_from_its_layer_and_below(module: str) -> None:
    own = layer_of(module)
    for other in kernel_imports(kernel()[module]):
        assert layer_of(other) <= own, f"crescentlab.{module} imports {other}, which lies above it"
    for other in kernel_imports(kernel()[module], types=False):
        assert other.partition(".")[0] not in NEVER.get(module.partition(".")[0], set()), f"{module} imports {other}"


def test_no_module_imports_itself_in_a_circle() -> None:
    imports = {module: set(kernel_imports(path, types=False)) - {module} for module, path in kernel().items()}
    assert tuple(graphlib.TopologicalSorter(imports).static_order())  # CycleError shows the circle


@pytest.mark.parametrize("module", kernel())
def test_the_kernel_never_imports_a_component(module: str) -> None:
    for name, inner in imported(kernel()[module]):
        assert name.partition(".")[0] not in ("components", "circuits"), f"{module} imports {name}"
        full = f"{name}.{inner}."
        assert not full.startswith(("crescentlab.components.", "crescentlab.circuits.")), f"{module} imports {name}"


@pytest.mark.parametrize("path", sorted((ROOT / "components").rglob("*.py")), ids=lambda path: path.name)
def test_a_component_imports_only_public_names(path: Path) -> None:
    assert path.parent == ROOT / "components", "components/ stays flat"
    siblings = {other.stem for other in path.parent.glob("*.py")}
    for module, name in imported(path):
        top = module.partition(".")[0]
        if top in sys.stdlib_module_names or top in FOR_PARAMETERS:
            continue
        assert not (name or "").startswith("_"), f"{name} of {module} is private"
        if top == "components":  # a relative import
            sibling = module.removeprefix("components").lstrip(".") or name
            assert sibling in siblings, f"{module} is no sibling"
            continue
        kernel_module = module.removeprefix("crescentlab").lstrip(".") or name
        assert top == "crescentlab", f"{module} is not for components; crescentlab.maths has the functions of equations"
        assert kernel_module in FOR_COMPONENTS, f"crescentlab.{kernel_module} is not for components"


@pytest.mark.parametrize("folder", ["crescentlab", "components", "circuits", "tests", "benchmarks", "docs"])
def test_every_python_file_says_first_what_belongs_in_it(folder: str) -> None:
    for path in sorted((ROOT / folder).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        assert ast.get_docstring(tree), f"{path.relative_to(ROOT)} has no docstring"


@cache
def tracked() -> tuple[Path, ...]:
    """Files that git tracks; skips the test in a copy that is no checkout."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True).stdout
    return tuple(ROOT / name for name in listing.split("\0") if name and (ROOT / name).is_file())


def test_no_binary_or_result_file_is_tracked() -> None:
    for path in tracked():
        shown = path.relative_to(ROOT)
        assert path.suffix not in RESULT_FILES, f"{shown} is made by a program, so it is not kept"
        assert b"\0" not in path.read_bytes(), f"{shown} is not text"
        assert path.suffix != ".csv" or shown.parent != Path(), f"{shown} looks like a result, not a circuit's table"


@pytest.mark.parametrize(
    ("pattern", "advice"),
    [(ABSOLUTE, "write a relative path"), (REGISTRY, "pip already knows where packages come from")],
    ids=["absolute path", "package registry"],
)
def test_no_tracked_file_names(pattern: re.Pattern[str], advice: str) -> None:
    for path in tracked():
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            match = pattern.search(line)
            assert match is None, f"{path.relative_to(ROOT)}:{number} names {match[0]}; {advice}"


def test_the_patterns_find_what_they_are_for() -> None:
    made = ["/".join(["", name, "x"]) for name in ("work", "tmp", "root", "home")]
    assert all(ABSOLUTE.search(f"open('{text}')") for text in made)
    innocent = ("p/work", "#!/usr/bin/env bash", "a /root_radius", "$(VENV)/tmp/x", "https://home.example")
    assert not any(ABSOLUTE.search(text) for text in innocent)
    assert REGISTRY.search(".".join(["https://files", "pythonhosted", "org"]))


@pytest.mark.parametrize("module", ["crescentlab", "crescentlab.cli"])
def test_importing_is_light(module: str, tmp_path: Path) -> None:
    script = f"import {module}, json, sys; print(json.dumps(sorted(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    heavy = {name.partition(".")[0] for name in json.loads(run.stdout)} & set(HEAVY)
    assert not heavy, f"import {module} also imports {sorted(heavy)}; move that inside the command"


def test_the_version_is_the_same_everywhere() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\n## [{version}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_constraints_pin_every_dependency() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"]["dev"]]
    pinned = re.findall(r"(?m)^([\w.-]+)==[\w.]+$", (ROOT / "constraints.txt").read_text(encoding="utf-8"))
    names = {re.sub(r"[-_.]+", "-", name).lower() for name in pinned}
    for requirement in wanted:
        name = re.split(r"[<>=!~\[; ]", requirement)[0]
        assert re.sub(r"[-_.]+", "-", name).lower() in names, f"{name} has no line in constraints.txt"


def test_a_check_waits_for_no_solver() -> None:
    """`check`, `components` and `graph` integrate nothing: they start a third of a second sooner without SciPy."""
    code = (
        "import sys; import crescentlab.commands.check, crescentlab.commands.components; print('scipy' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
