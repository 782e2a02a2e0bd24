# plantune: `make` lists the targets.  demo and test each work alone on a fresh machine.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
RUST   := $(shell find crates/*/src crates/*/Cargo.toml) Cargo.toml Cargo.lock
MSRV   := $(shell sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)

.DEFAULT_GOAL := help
.PHONY: help demo test test-all docs bench lint check

help:      ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' Makefile

demo: $(VENV)/package      ## the main job on two shipped records: out/demo/*/report.html
	@$(BIN)/plantune demo --out out/demo

test: $(VENV)/extra-test   ## every test but the slow ones, and the examples in docstrings and pages
	@cargo test --quiet --locked
	@$(BIN)/python -m pytest --quiet

test-all: $(VENV)/extra-test   ## the slow ones too
	@cargo test --quiet --locked -- --include-ignored
	@$(BIN)/python -m pytest --quiet -m ""

docs: $(VENV)/extra-test   ## run the pages, and draw their figures as HTML: out/docs
	@$(BIN)/python -m pytest --quiet README.md docs
	@mkdir -p out/docs
	@$(BIN)/python examples/which_method.py
	@$(BIN)/python examples/which_recursion.py
	@$(BIN)/python examples/records.py --figures out/docs
	@$(BIN)/python examples/source_000.py --figures out/docs
	@$(BIN)/python examples/source_001_autotuner.py --figures out/docs
	@$(BIN)/python examples/source_002.py

bench: $(VENV)/extra-bench ## side by side with the peers, in one run
	@$(BIN)/python -m benches

lint: $(VENV)/extra-lint   ## rustfmt, clippy, ruff, mypy, import rules
	@cargo fmt --all --check
	@cargo clippy --quiet --locked --workspace --all-targets -- -D warnings
	@$(BIN)/ruff check --quiet
	@$(BIN)/ruff format --check --quiet
	@$(BIN)/mypy --no-error-summary
	@$(BIN)/lint-imports --no-logo

# What the machine must have: one line for the first thing that is missing.
check:
	@missing() { echo "make: needs $$1"; exit 1; }; \
	command -v cc >/dev/null \
	  || missing "a C compiler as cc: apt install build-essential, or xcode-select --install"; \
	printf '%s\n' "$(MSRV)" "$$(cargo --version 2>/dev/null | cut -d' ' -f2)" | sort -VC \
	  || missing "cargo $(MSRV) or later: install or update Rust with rustup, see rust-lang.org/tools/install"; \
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null \
	  || missing "Python 3.10 or later as $(PYTHON): apt install python3, or make PYTHON=python3.12 ..."; \
	$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
	  || missing "the venv module of $(PYTHON): apt install python3-venv"

# The package, editable: Python files count at once, Rust files after the next make.
$(VENV)/package: $(RUST) pyproject.toml constraints.txt | check
	@echo "plantune: building (a minute or two the first time)"
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV)
	@$(PIP) maturin
	@PATH="$(CURDIR)/$(BIN):$$PATH" $(PIP) --no-build-isolation --editable .
	@touch $@

# The packages that an extra of pyproject.toml names; plantune itself is there already.
$(VENV)/extra-%: pyproject.toml constraints.txt | $(VENV)/package
	@$(PIP) "plantune[$*]"
	@touch $@
