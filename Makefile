# Set-up is part of every target: on a fresh machine `make demo` and `make test` are all it takes.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-all lint format notebooks bench results clean

help:  ## Say what there is to make
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: $(READY)  ## Install everything into .venv

# --group needs pip 25.1.
$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --editable '.[sim,viz,notebooks]' --group test --group dev
	touch $@

demo: $(READY)  ## Recognise an object from camera images, told step by step
	$(BIN)/atg-fg demo

test: $(READY)  ## Run the tests
	$(BIN)/python -m pytest -n auto --dist loadfile

test-all: $(READY)  ## Run the tests, slow ones too
	$(BIN)/python -m pytest -n auto --dist loadfile -m ''

lint: $(READY)  ## Check style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(READY)  ## Mend style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

notebooks: $(READY)  ## Execute the notebooks in place and bring their paired scripts in step
	$(BIN)/jupytext --sync notebooks/*.py
	$(BIN)/jupytext --execute notebooks/*.ipynb

bench: $(READY)  ## Time one decision of every engine, side by side
	$(BIN)/python benchmarks/decision.py

results: $(READY)  ## Run what README's results table shows (some minutes)
	$(BIN)/python benchmarks/results.py

clean:  ## Remove what make has made
	rm -rf $(VENV) out build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
