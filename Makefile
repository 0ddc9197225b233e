# Everything a person or CI does here. `make` alone lists it.

PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11 python; do \
	command -v $$p >/dev/null 2>&1 && $$p -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' \
	>/dev/null 2>&1 && echo $$p && break; done)
CARGO ?= cargo
VENV := .venv
BIN := $(VENV)/bin
BLENDER_PYTHON ?= python3.11
BLENDER_VENV := .venv-blender
WHEELS := target/wheels
PHOTO ?=
BENCH ?=
EXEMPLARS ?= ../shared/exemplars
GALLERY ?=
QUALITY ?=
LATTICES ?=

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-rust test-python test-blender lint format gallery quality lattices extracts regular-gallery noise-gallery readme-pictures bench bench-peers bench-noise-peers bench-record wheel ci fuzz clean

help: ## List the targets.
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-16s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

# The virtual environment with everything but texforge itself.
$(BIN)/.ready: pyproject.toml
	@test -n "$(PYTHON)" || { echo "texforge needs Python 3.11 or newer (with venv); install it, or name it: make PYTHON=..." >&2; exit 1; }
	@command -v $(CARGO) >/dev/null || { echo "texforge needs Rust; install the stable toolchain" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -c 'import tomllib; p = tomllib.load(open("pyproject.toml", "rb"))["project"]; print("\n".join(p["dependencies"] + p["optional-dependencies"]["dev"]))' > $(VENV)/requirements.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r $(VENV)/requirements.txt
	touch $@

# One wheel of the profile named by the first argument, installed.
define install_wheel
	rm -rf $(WHEELS)/$(1)
	$(BIN)/maturin build --quiet --profile $(1) --out $(WHEELS)/$(1)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall $(WHEELS)/$(1)/*.whl
endef

setup: $(BIN)/.ready ## Build optimised and install into .venv.
	$(call install_wheel,release)
	@echo "texforge is installed: $(BIN)/texforge --help, or $(BIN)/python -c 'import texforge'"

demo: setup ## Tile a photograph (PHOTO=file to choose) and show it repeated, in demo/.
	$(BIN)/python docs/demo.py $(if $(PHOTO),"$(PHOTO)")

test: test-rust test-python ## Build and run every test.

test-rust:
	$(CARGO) test --locked

# Against the installed wheel, as users have it, not the source tree.
test-python: $(BIN)/.ready
	$(call install_wheel,dev)
	$(BIN)/python -m pytest

# The shaders in Blender, whose wheel takes 1 GB and one version of Python: an environment of its own.
$(BLENDER_VENV)/.ready: pyproject.toml
	@command -v $(BLENDER_PYTHON) >/dev/null || { echo "Blender's wheel needs Python 3.11 (with venv); install it, or name it: make BLENDER_PYTHON=..." >&2; exit 1; }
	$(BLENDER_PYTHON) -m venv $(BLENDER_VENV)
	$(BLENDER_VENV)/bin/python -c 'import tomllib; print("\n".join(tomllib.load(open("pyproject.toml", "rb"))["dependency-groups"]["blender"]))' > $(BLENDER_VENV)/requirements.txt
	$(BLENDER_VENV)/bin/python -m pip install --quiet --disable-pip-version-check -r $(BLENDER_VENV)/requirements.txt
	touch $@

test-blender: $(BLENDER_VENV)/.ready $(BIN)/.ready ## Compile and render the OSL and Blender exports in Blender (1 GB).
	$(call install_wheel,dev)
	$(BLENDER_VENV)/bin/python -m pytest tests/blender

lint: $(BIN)/.ready ## Check formatting, lints and types.
	$(CARGO) fmt --check
	$(CARGO) clippy --locked --all-targets -- -D warnings
	$(CARGO) clippy --locked --all-targets --features python -- -D warnings
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(call install_wheel,dev)
	$(BIN)/python -m mypy.stubtest texforge --mypy-config-file pyproject.toml

format: $(BIN)/.ready ## Format everything.
	$(CARGO) fmt
	$(BIN)/ruff format
	$(BIN)/ruff check --fix

gallery: setup ## Tile every exemplar and write contact sheets, in gallery/ (GALLERY='--class stains').
	$(BIN)/python docs/gallery.py "$(EXEMPLARS)" $(GALLERY)

quality: setup ## Print costs, sharpness and verbatim blocks of tiles of EXEMPLARS against the baseline.
	$(BIN)/python docs/quality.py "$(EXEMPLARS)" $(QUALITY)

lattices: setup ## Print which lattices of EXEMPLARS are found and refused; draw them, in lattices/ (LATTICES=--variants).
	$(BIN)/python docs/lattices.py "$(EXEMPLARS)" $(LATTICES)

extracts: setup ## Extract the tiles of EXEMPLARS that repeat; show them repeated, in extracts/.
	$(BIN)/python docs/extracts.py "$(EXEMPLARS)"

regular-gallery: setup ## Make larger textures and tiles of EXEMPLARS that repeat; measure them, in regular-gallery/.
	$(BIN)/python docs/regular.py "$(EXEMPLARS)"

noise-gallery: setup ## Fit procedural textures to EXEMPLARS and write sheets, in noise-gallery/ (NOISES='--class stochastic').
	$(BIN)/python docs/noises.py "$(EXEMPLARS)" $(NOISES)

readme-pictures: setup ## Make the README's pictures anew, in docs/pictures/.
	$(BIN)/python docs/readme_pictures.py

bench: ## Measure the kernels.
	$(CARGO) bench --locked --bench kernels --bench representative --bench regular --bench noise

bench-peers: $(BIN)/.ready ## Compare with G'MIC and texture-synthesis (PHOTO=file, BENCH="--large ...").
	$(BIN)/python benches/peers.py $(if $(PHOTO),"$(PHOTO)") $(BENCH)

bench-noise-peers: $(BIN)/.ready ## Compare noise with FastNoiseSIMD, in one run (BENCH="--rounds 9").
	$(BIN)/python benches/noise_peers.py $(BENCH)

bench-record: $(BIN)/.ready ## Measure all and keep it in benches/record/.
	TEXFORGE_BENCH_TABLE=$(CURDIR)/target/kernels.md $(CARGO) bench --locked --bench kernels
	$(BIN)/python benches/peers.py $(if $(PHOTO),"$(PHOTO)") $(BENCH) --kernels target/kernels.md --record $(shell date +%F)

wheel: $(BIN)/.ready ## Build the wheel for distribution, in dist/.
	$(BIN)/maturin build --release --out dist

# What may land is decided by the change, not by the luck of a draw: property tests draw the same
# cases here each time. Elsewhere they draw new ones; `make fuzz` draws many.
ci: export PROPTEST_RNG_SEED = 1
ci: export HYPOTHESIS_PROFILE = ci
ci: lint test ## What CI runs.

fuzz: export PROPTEST_CASES = 4000
fuzz: export HYPOTHESIS_PROFILE = thorough
fuzz: test ## Run every test with many random cases (hours).

clean: ## Remove what was built.
	rm -rf target $(VENV) $(BLENDER_VENV) demo gallery lattices extracts regular-gallery dist
