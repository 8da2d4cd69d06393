# Three commands: `make review` (a reviewed catalogue with its ΔE94; fails where a row is over the budget), `make test`
# (before every merge; `make test-all` runs the rest too), and `make view` (the review window; WHAT=my-scene.toml names
# something else than the shipped example). All make .venv and install Metamer, pinned by constraints.txt; nothing
# outside this folder is touched. docs/testing.md is about the tests.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
OUT    ?= review
CATALOGUE ?= metamer-catalogue
JOBS   ?= 2
PIP    := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.PHONY: review test test-all view bench lint docs clean

review: $(VENV)/.installed
	@$(BIN)/metamer doctor --brief
	$(BIN)/metamer catalogue import --catalogue $(CATALOGUE)
	@echo "$(BIN)/metamer review --catalogue $(CATALOGUE) -o $(OUT)"
	@$(BIN)/metamer review --catalogue $(CATALOGUE) -o $(OUT) || { code=$$?; [ $$code = 1 ] || exit $$code; \
	  echo "Some rows are near the budget, none is over it: $(OUT)/index.html shows them first."; }

# Tests start many commands; without byte code on disk each would compile all of Metamer again. Files stay together, so
# that what a file's tests share is made once. Where one of the processes dies, the run ends: with files kept together,
# pytest-xdist may wait for ever once it has replaced it.
PYTEST := PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $(JOBS) --dist loadfile \
  --max-worker-restart 0 --durations 40
FIRST_TIER := not (browser or mitsuba or slow or stress or window)

test: $(VENV)/.installed-for-tests
	@$(BIN)/metamer doctor --brief
	$(PYTEST) -m "$(FIRST_TIER)" $(ARGS)

test-all: $(VENV)/.installed-for-tests
	@$(BIN)/metamer doctor --brief
	$(PYTEST) $(ARGS)

view: $(VENV)/.installed-for-windows
	METAMER_CATALOGUE=$(CATALOGUE) $(BIN)/metamer view $(WHAT)

bench: $(VENV)/.installed
	$(BIN)/metamer bench all

lint: $(VENV)/.installed-for-tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
# Only files that git knows: a catalogue or a review that was made here is nobody's prose.
	git ls-files -z --cached --others --exclude-standard | xargs -0 $(BIN)/codespell
# Fetched from npm's registry by its Python package; without that, types go unchecked, and it is said.
	@timeout 180 $(BIN)/pyright --version >/dev/null 2>&1 || echo "pyright cannot be fetched here: types are not checked"
	@! timeout 180 $(BIN)/pyright --version >/dev/null 2>&1 || { echo $(BIN)/pyright; $(BIN)/pyright; }

# The site into site/. The reference is read from a copy of the package under its own name.
docs: $(VENV)/.installed
	@$(PIP) -e '.[docs]'
	@rm -rf build && $(PIP) --no-deps --target build/documented . && rm -rf build/lib build/bdist.*
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Metamer needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>&1)."; \
	    echo "Name another one: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
	  { rm -rf $(VENV); echo "No virtual environments here. On Debian: apt-get install python3-venv"; exit 1; }

$(VENV)/.installed: $(BIN)/python pyproject.toml constraints.txt
	@echo "Installing Metamer into $(VENV) ..."
	@$(PIP) -e .
	@touch $@

$(VENV)/.installed-for-windows: $(VENV)/.installed
	@echo "Installing what the window needs ..."
	@$(PIP) -e '.[window]'
	@touch $@

$(VENV)/.installed-for-tests: $(VENV)/.installed
	@echo "Installing what the tests need ..."
	@$(PIP) -e '.[test]'
	@$(PIP) mitsuba || echo "Mitsuba 3 has no package for this Python: its comparisons will be skipped."
	@$(PIP) MaterialX || echo "MaterialX has no package for this Python: its tests will be skipped."
	@$(PIP) flip-evaluator || echo "FLIP has no package for this Python: its tests will be skipped."
	@$(PIP) nbclient ipykernel || echo "nbclient has no package for this Python: notebooks will not be run."
	@$(PIP) flask flask-cors 'moto[s3]' s3fs paramiko || echo "moto or paramiko has no package for this Python: no catalogue will be read from a server."
	@$(PIP) openimageio || echo "OpenImageIO has no package for this Python: reading our pictures with it will be skipped."
	@touch $@

clean:
	rm -rf $(VENV) $(OUT) build site *.egg-info
