# make demo      identify a ship from the trials in the box, design and verify autopilots; needs no torch
# make test      everything that is checked: format, lint, types, tests
# make bench     how fast it is
# make fuzz      a million mutated files of every kind that is read
# make release-check  the wheel in clean environments, without extras and with each, lowest and newest versions
# make evidence  what the pages of docs/ claim, run again
# make docs      the site, and whether its links, pictures and pages work in a browser
# make site-test the latter alone

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
# measured runs of real ships, which are not part of the project
DATA ?= ../shared/data

# Bytecode is kept (an empty value means unset): the many processes of the tests compile the same files but once.
export PYTHONDONTWRITEBYTECODE =

.PHONY: demo test lint format type bench fuzz release-check evidence docs site-test clean

demo: $(VENV)/demo-installed
	$(BIN)/shipgym autopilot examples/mariner/ship.toml --out report

# Many loops and few steps of each: plain Python takes a tenth of the time that compiling them would. Tests that
# are marked as `compiled` in files so marked take many steps, or state facts about compiled code.
INTERPRETED = $(shell grep -lr "pytest.mark.interpreted" tests --include="test_*.py")

# The one long test of the fuzz begins first: at the end one of two processors would wait for it.
COMPILED = -m "compiled or not interpreted" --ignore=tests/test_site.py tests/test_fuzz.py tests

test: lint type
	NUMBA_DISABLE_JIT=1 OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 -m "interpreted and not compiled" $(INTERPRETED)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder --durations=25 $(COMPILED)

lint: $(VENV)/dev-installed
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

format: $(VENV)/dev-installed
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

type: $(VENV)/dev-installed
	$(BIN)/mypy

bench: $(VENV)/dev-installed
	OMP_NUM_THREADS=1 $(BIN)/python scripts/benchmark_speed.py

release-check: $(VENV)/dev-installed
	$(BIN)/python scripts/release_check.py

fuzz: $(VENV)/dev-installed
	OMP_NUM_THREADS=1 $(BIN)/python scripts/fuzz.py --inputs 1000000

evidence: $(VENV)/dev-installed
	$(BIN)/python scripts/reproduce.py all --markdown docs/reproduction.md || test $$? = 1  # 1: aims missed, as the page says
	test ! -d $(DATA) || $(BIN)/python scripts/predict_real_ships.py --data $(DATA)
	$(BIN)/shipgym benchmark --controllers tuned-preview-lq,tuned-wheel-over,preview-lq,wheel-over,ilos,lq,pid --runs 5 --out build/suite
	$(BIN)/python scripts/certainty.py --out build/certainty.jsonl
	$(BIN)/python scripts/autopilots.py --rows build/autopilots.jsonl
	$(BIN)/python scripts/bridge_logs.py
	$(BIN)/python scripts/run_notebooks.py
	$(BIN)/python scripts/tutorial.py

docs: $(VENV)/dev-installed
	$(BIN)/python scripts/document_options.py
	$(BIN)/python scripts/document_settings.py
	$(BIN)/python scripts/document_api.py
	$(BIN)/python scripts/draw_architecture.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	SHIPGYM_SITE=site $(BIN)/python -m pytest tests/test_site.py

site-test: $(VENV)/dev-installed
	$(BIN)/python -m pytest tests/test_site.py

$(VENV)/bin/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "shipgym needs Python 3.11 or later; set PYTHON=")'
	$(PYTHON) -m venv $(VENV)

# what the tests need includes what the demo needs
$(VENV)/demo-installed: pyproject.toml constraints.txt | $(VENV)/bin/python
	test -e $(VENV)/dev-installed || $(PIP) -e ".[report]"
	touch $@

$(VENV)/dev-installed: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP) -e ".[dev]"
	touch $@

clean:
	rm -rf $(VENV) report site build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
