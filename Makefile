# make study   install what is missing and run the quick study; make test   likewise, then the tests
PYTHON ?= python3
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
BIN := .venv/bin
HIDDEN := results/quick/loaded_seeds
POWDER := results/quick/powder
APT_INSTALL := $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends

.PHONY: study test test-debian13 install yade browser docs reference api results

study: install yade
	$(BIN)/pellet-study bench results/quick
	@test -d $(HIDDEN) || { mkdir -p $(HIDDEN) && cp results/loaded_seeds/study.toml results/loaded_seeds/measurements.csv $(HIDDEN); }
	$(BIN)/pellet-study refine $(HIDDEN)
	$(BIN)/pellet-study report $(HIDDEN)
	$(BIN)/pellet-study calibrate results/full --quick results/full --results $(POWDER)
	$(BIN)/pellet-study report results/quick

test: install yade browser
	$(BIN)/python -m pytest

# the tests that need YADE, on Debian 13 with its YADE 2025.2; the root is made once in $$PELLET_STUDY_DEBIAN13
test-debian13:
	@.ci/debian13 sh -c 'make install yade && .venv/bin/python -m pytest -m yade' || { \
	  status=$$?; [ $$status = 77 ] && echo "the tests on Debian 13 are skipped" || exit $$status; }

# remakes the committed results in full; resumable, some hours on two cores
results: install yade
	$(BIN)/pellet-study calibrate results/full
	$(BIN)/pellet-study doctor --results results/checks
	$(BIN)/pellet-study bench results/bench --effort 4
	$(BIN)/pellet-study audit --results results/paper

install: $(BIN)/.installed

$(BIN)/.installed: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "Python 3.11 or newer is needed, $(PYTHON) is not; name one: make PYTHON=python3.12"; exit 2; }
	@echo "making a virtual environment in .venv and installing pellet-study with its dependencies there"
	@$(PYTHON) -m venv .venv 2>/dev/null || { \
	  echo "python's venv module is missing: installing Debian's python3-venv"; \
	  $(SUDO) apt-get update -qq && $(APT_INSTALL) python3-venv >/dev/null && $(PYTHON) -m venv .venv; }
	@$(BIN)/python -m pip install --quiet --editable ".[test]"
	@touch $@

yade:
	@if [ -n "$$PELLET_STUDY_YADE" ] || command -v yadedaily >/dev/null || command -v yade >/dev/null; then :; else \
	  echo "YADE is missing: installing Debian's package yade (a few minutes)"; \
	  $(SUDO) apt-get update -qq && \
	  $(APT_INSTALL) yade >/dev/null; fi

browser:
	@if command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null; then :; else \
	  echo "installing Debian's chromium, in which the tests open the report"; \
	  $(SUDO) apt-get update -qq && $(APT_INSTALL) chromium >/dev/null || \
	  echo "there is no Chromium to be had: the tests that need one are skipped"; fi

# the pages of docs/ as a static site in build/site; a link that leads nowhere fails
docs: install reference
	$(BIN)/python -m pip install --quiet --editable ".[docs]"
	$(BIN)/python -m mkdocs build --quiet --strict
	@echo "the site: $$PWD/build/site/index.html"

# docs/reference, made of what the code declares
reference: install
	$(BIN)/python docs/generate/reference.py

# the reference of every Python function, from their docstrings
api: install
	$(BIN)/python -m pip install --quiet --editable ".[docs]"
	$(BIN)/python -m pdoc --output-directory docs/api pellet_study yade_scripts '!yade_scripts.checks'
