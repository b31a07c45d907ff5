# Everything runs in an environment of its own; only Python 3.11+ and make are needed.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/installed

.DEFAULT_GOAL := help
.PHONY: help demo test test-lowest fuzz kills soak lint types bench validate golden docs samples page blender opensim three clean

help: ## This list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | awk -F':.*## ' '{printf "  make %-11s %s\n", $$1, $$2}'

# Made again when the dependencies or the entry point change; otherwise a second run starts at once.
$(STAMP): pyproject.toml mocap_skel/version.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "mocap-skel needs Python 3.11 or newer: make PYTHON=python3.11 ..." >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

demo: $(STAMP) ## Fit the bundled range-of-motion clip and print its joint table
	$(BIN)/mocap-skel fit sample_data/range_of_motion.c3d --assoc cmu --format csv --format bvh -o demo_output --overwrite

test: lint types $(STAMP) ## Lint, types and all tests
	$(BIN)/python -m pytest -q -n auto --dist loadfile

fuzz: $(STAMP) ## Try N damaged files of each kind (make fuzz N=10000), seeds from FIRST on
	MOCAP_SKEL_FUZZ=$(or $(N),10000) MOCAP_SKEL_FUZZ_FIRST=$(or $(FIRST),0) \
	  $(BIN)/python -m pytest -q tests/readers/test_fuzz.py tests/labels/test_fuzz_files.py

kills: $(STAMP) ## Kill a batch at N random moments (make kills N=50), and let it go on from there
	MOCAP_SKEL_KILLS=$(or $(N),50) $(BIN)/python -m pytest -q tests/cli/test_batch_faults.py -k random_moments

soak: $(STAMP) ## N generated clips through batch, some damaged (make soak N=2600): rate, memory, nothing lost
	$(BIN)/python benchmarks/soak.py $(N)

# The lowest versions that pyproject.toml admits, in an environment of their own.
.venv-lowest/installed: pyproject.toml tests/lowest.py
	$(PYTHON) -m venv .venv-lowest
	$(PYTHON) tests/lowest.py > .venv-lowest/lowest.txt
	.venv-lowest/bin/python -m pip install --quiet --disable-pip-version-check --constraint .venv-lowest/lowest.txt \
	  --editable '.[dev]'
	@touch $@

test-lowest: .venv-lowest/installed $(STAMP) ## All tests with the lowest versions of all libraries, and the same files byte for byte
	.venv-lowest/bin/python -m pytest -q -n auto --dist loadfile
	$(BIN)/python tests/versions.py $(BIN)/python .venv-lowest/bin/python

lint: $(STAMP) ## ruff: rules and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP) ## mypy, strict
	$(BIN)/mypy

bench: $(STAMP) ## Timings side by side, and accuracy against known truth
	$(BIN)/python benchmarks/bench_spheres.py
	$(BIN)/python benchmarks/bench_fit.py
	$(BIN)/python benchmarks/bench_growth.py
	$(BIN)/python benchmarks/bench_guess.py
	$(BIN)/python benchmarks/accuracy.py
	$(BIN)/python benchmarks/coverage.py
	$(BIN)/python benchmarks/guess_table.py

CLIPS ?= ../shared/clips
validate: $(STAMP) ## Joints against references in a folder of real clips (make validate CLIPS=...), beside published methods
	$(BIN)/python benchmarks/validate.py --half -q $(CLIPS)

golden: $(STAMP) ## Rewrite the golden results; review the diff before committing it
	$(BIN)/python tests/golden.py

docs: $(STAMP) ## Rewrite docs/commands from the commands' own help
	$(BIN)/python tests/command_pages.py

samples: $(STAMP) ## Make sample_data again from its generator
	$(BIN)/python sample_data/make.py

# Blender's own numpy decides the versions of the rest, so it has an environment of its own; bpy 4.5 is for Python 3.11.
.venv-blender/installed: pyproject.toml
	python3.11 -m venv .venv-blender
	.venv-blender/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[gltf]' 'bpy==4.5.*'
	@touch $@

blender: .venv-blender/installed ## Opt-in (0.4 GB): Blender puts every joint where the model does, FBX and USD too
	.venv-blender/bin/python tests/blender_check.py $(FILES)

# OpenSim's wheel decides numpy's version, so it has an environment of its own; 4.6 is for Python 3.11 to 3.13.
.venv-opensim/installed: pyproject.toml
	$(PYTHON) -m venv .venv-opensim
	.venv-opensim/bin/python -m pip install --quiet --disable-pip-version-check --editable . 'opensim==4.6.*'
	@touch $@

opensim: .venv-opensim/installed ## Opt-in (0.3 GB): OpenSim puts joints and markers where the model does; its inverse kinematics
	.venv-opensim/bin/python tests/opensim_check.py $(FILES)

three: $(STAMP) ## Opt-in (node, npm, Chromium): three.js puts every joint of a GLB where the model does
	cd web && npm ci --ignore-scripts --no-audit --no-fund
	$(BIN)/python tests/three_check.py $(FILES)

page: ## Bundle the report page's viewer again (needs node and npm)
	cd web && npm ci --ignore-scripts --no-audit --no-fund && npm run build

clean: ## Remove the environment, caches and demo results
	rm -rf $(VENV) .venv-lowest .venv-blender .venv-opensim web/node_modules demo_output build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
