# The commands of a working day. A machine needs Python >= 3.11 with venv, and make.
#
#   make run       simulate the crescent pump and plot it       make run CIRCUIT=relief_valve
#   make test      the whole test suite                         make test ARGS="-k units"
#   make check     formatter, linter and types, changing nothing
#   make format    let the formatter and the linter mend what they can
#   make paper     the tables and figures of the pump's paper anew, with verdicts: docs/paper.md (minutes)
#   make campaign  the tests that take minutes of simulation
#   make bench     the pump, all solvers, against hand-written C; the other benchmarks: benchmarks/RESULTS.md
#
# The first of them makes the virtual environment; later ones start at once until pyproject.toml or
# constraints.txt changes. The install is editable, so edits are seen without it.

PYTHON ?= python3
VENV ?= .venv
CIRCUIT ?= crescent_pump
ARGS ?=

BIN = $(VENV)/bin
INSTALL = $(BIN)/python -m pip install -qq --disable-pip-version-check -c constraints.txt
TOO_OLD = crescentlab needs Python 3.11 or newer, and $(PYTHON) is %s; name a newer one: make PYTHON=python3.12
MISSING = crescentlab needs Python 3.11 or newer, and there is no $(PYTHON); name it: make PYTHON=python3.12

.PHONY: help run test paper campaign check format bench install install-dev
.DELETE_ON_ERROR:

help:
	@sed -n '1,/^$$/s/^# \{0,1\}//p' Makefile

run: install
	$(BIN)/crescentlab simulate $(CIRCUIT) --plot $(ARGS)

test: install-dev
	$(BIN)/pytest -n 2 $(ARGS)

paper: install
	$(BIN)/python -m studies.paper.make_page $(ARGS)

campaign: install-dev
	$(BIN)/pytest -n 2 -m campaign $(ARGS)

check: install-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy crescentlab components

format: install-dev
	$(BIN)/ruff check --fix-only .
	$(BIN)/ruff format .

bench: install
	$(BIN)/python benchmarks/pump.py $(ARGS)

install: $(VENV)/.installed
install-dev: $(VENV)/.installed-dev

$(VENV)/.installed: pyproject.toml constraints.txt | $(VENV)/.python
	@echo "installing crescentlab into $(VENV)"
	@$(INSTALL) -e .
	@touch $@

$(VENV)/.installed-dev: pyproject.toml constraints.txt | $(VENV)/.python
	@echo "installing crescentlab and its development tools into $(VENV)"
	@$(INSTALL) -e '.[dev]'
	@touch $(VENV)/.installed $@

$(VENV)/.python:
	@command -v $(PYTHON) >/dev/null || { echo "$(MISSING)" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit("$(TOO_OLD)" % sys.version.split()[0] if sys.version_info < (3, 11) else 0)'
	@$(PYTHON) -m venv $(VENV)
	@touch $@
