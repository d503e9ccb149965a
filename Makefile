# make explore   set everything up and open the app on the saved archives
# make test      set everything up and run all tests, browser tests included
# make check     lint, format, types, and which room imports which

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
HOST ?= 127.0.0.1
PORT ?= 8080
# tests start Python many times, and from bytecode it starts quicker
unexport PYTHONDONTWRITEBYTECODE

.PHONY: explore test check format screenshot chromium compiler clean

explore: $(VENV)/.runtime $(VENV)/.kernel
	$(BIN)/tensatlas explore --host $(HOST) --port $(PORT)

# one process more than there are cores: one of them drives a browser, which waits often, and so do others
WORKERS := $(shell n=$$(getconf _NPROCESSORS_ONLN) && [ $$n -lt 4 ] && echo $$((n + 1)) || echo 4)

test: $(VENV)/.dev $(VENV)/.kernel chromium compiler
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder

check: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

screenshot: $(VENV)/.dev chromium
	$(BIN)/python -m tests.browser.screenshot

chromium: $(VENV)/.dev
	@sh tests/browser/chromium.sh $(BIN)/python

# the firmware's tests compile it; without a compiler they are skipped
compiler:
	@command -v c++ >/dev/null || command -v g++ >/dev/null || command -v clang++ >/dev/null || \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; \
	  then apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq g++ >/dev/null; \
	  else echo "The firmware is not tested without a C++ compiler; install one with: sudo apt install g++"; fi

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "TensAtlas needs Python 3.11 or newer; say which with: make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; \
	  then apt-get update -qq && apt-get install -y -qq python3-venv; \
	  else echo "Python's venv module is missing; run: sudo apt install python3-venv"; exit 1; fi
	$(PYTHON) -m venv $(VENV)

$(VENV)/.runtime: $(VENV)/bin/python pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[video]'
	@touch $@

# the simulation compiled for this processor: no click has to wait for that
$(VENV)/.kernel: $(VENV)/.runtime $(shell find engine/simulation/kernel -name '*.py')
	$(BIN)/python -m engine.simulation.compile_kernel
	@touch $@

$(VENV)/.dev: $(VENV)/.runtime
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

clean:
	rm -rf $(VENV) build *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
