# Every target sets itself up from nothing: Python >= 3.11 with venv, and make, are all it needs.
#
#   make demo     both arms, emulated, playing the paper's move; until Ctrl-C
#   make test     the tests              make test ARGS="-k masa"
#   make lint     ruff, mypy --strict, import layers, locks
#   make bench    the performance table  make bench ARGS="--seconds 10 --only lateness"
#   make campaign long fault runs
#   make schemas  regenerates ticks_pb2.py and the JSON Schemas
#   make locks    writes deploy/locks from what is installed in .venv

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --no-input -qq
RUNTIME := $(VENV)/.runtime
DEV := $(VENV)/.dev
EDITABLE := $(VENV)/.editable
ARGS ?=

.DELETE_ON_ERROR:
# Packages first, then the project: one after the other even under make -j.
.NOTPARALLEL:
.PHONY: help demo test lint bench campaign schemas figures locks clean
.DEFAULT_GOAL := help

help:
	@sed -n 's/^#   //p' Makefile

demo: $(RUNTIME) $(EDITABLE)
	@exec $(BIN)/axisyncd demo $(ARGS)

test: $(DEV) $(EDITABLE)
	@exec $(BIN)/python tests/run.py $(ARGS)

lint: $(DEV) $(EDITABLE)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy deploy/uml/*.py deploy/locks/*.py
	MYPYPATH=tests:tests/bench $(BIN)/mypy docs/*.py
	MYPYPATH=tests:tests/bench $(BIN)/mypy --explicit-package-bases tests/bench tests/vcan
	$(BIN)/lint-imports
	$(BIN)/python deploy/locks/write.py --check

bench: $(DEV) $(EDITABLE)
	@exec $(BIN)/python tests/bench $(ARGS)

campaign: $(DEV) $(EDITABLE)
	@exec $(BIN)/python -m pytest -m campaign $(ARGS)

schemas: $(DEV) $(EDITABLE)
	$(BIN)/python -m grpc_tools.protoc -Ischemas --python_out=schemas --pyi_out=schemas schemas/axisync_schemas/ticks.proto
	$(BIN)/python -m axisync_schemas.export

figures: $(DEV) $(EDITABLE)
	$(BIN)/python docs/draw_figures.py
	$(BIN)/python docs/draw_arms.py

locks: $(DEV)
	$(BIN)/python deploy/locks/write.py

clean:
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .pytest_cache .import_linter_cache

# A lock is complete, so nothing is resolved: --no-deps, then a check that nothing is missing.
$(RUNTIME): deploy/locks/runtime.txt | $(BIN)/python
	@echo "installing the runtime packages into $(VENV) (a minute or two)"
	@$(PIP) install --no-deps -r $<
	@touch $@

$(DEV): deploy/locks/dev.txt | $(BIN)/python
	@echo "installing the runtime and development packages into $(VENV) (a minute or two)"
	@$(PIP) install --no-deps -r $<
	@touch $@

# Order-only after whichever lock the goal asked for: the build back end is in both.
$(EDITABLE): pyproject.toml | $(BIN)/python
	@$(PIP) install --no-deps --no-build-isolation -e .
	@out=$$($(BIN)/python -m pip --disable-pip-version-check check) || { echo "$$out" >&2; exit 1; }
	@touch $@

$(BIN)/python:
	@command -v $(PYTHON) >/dev/null || { echo "there is no $(PYTHON): install Python 3.11 or newer (Debian: apt install python3 python3-venv)" >&2; exit 1; }
	@$(PYTHON) deploy/locks/suitable.py
	@rm -rf $(VENV)
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }
