# make demo | test | lint | bench | gallery | setup.  Every target sets up what it needs; nothing but python3.11+ is required.

SHELL := /bin/bash
PY := .venv/bin/python
STAMP := .venv/.ready
SYSTEM_STAMP := .venv/.system-packages

# The first interpreter that is new enough.
PYTHONS := python3 python3.11 python3.12 python3.13 python3.14 python
PYTHON := $(shell for p in $(PYTHONS); do \
	"$$p" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { command -v "$$p"; break; }; done)

# What a headless Debian lacks: OpenVDB's binding, and the GL libraries that VTK loads at import and at render time.
APT_PACKAGES := python3-openvdb libegl1 libosmesa6 libgl1 libxrender1 libgl1-mesa-dri

# $(call apt,packages,then): install what is missing where root or a passwordless sudo may; elsewhere say so and go on.
# `then` is run once nothing is missing.
define apt
	@command -v apt-get >/dev/null || exit 0; \
	missing=$$(for p in $(1); do dpkg -s $$p >/dev/null 2>&1 || echo $$p; done); \
	[ -n "$$missing" ] || { $(2); exit 0; }; \
	if [ "$$(id -u)" = 0 ]; then sudo=; elif sudo -n true 2>/dev/null; then sudo="sudo -n"; \
	else echo "note: not root, so please install:" $$missing >&2; exit 0; fi; \
	echo "installing" $$missing; \
	$$sudo apt-get update -qq; \
	for p in $$missing; do $$sudo env DEBIAN_FRONTEND=noninteractive \
		apt-get install -y -qq --no-install-recommends $$p >/dev/null \
		|| echo "note: apt-get could not install" $$p >&2; done
endef

.PHONY: setup test lint format demo bench gallery baselines lock clean apt-venv

setup: $(STAMP) $(SYSTEM_STAMP)

.venv/bin/pip:
	@test -n "$(PYTHON)" || { echo "frep needs Python 3.11 or newer; none of: $(PYTHONS) is" >&2; exit 1; }
# Debian splits ensurepip from python3; a venv without it is made and then is of no use.
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || $(MAKE) --no-print-directory apt-venv
	$(PYTHON) -m venv .venv

apt-venv:
	$(call apt,python3-venv $(notdir $(realpath $(PYTHON)))-venv,true)

# -e . needs no second resolve: everything it wants is in the lock.
$(STAMP): .venv/bin/pip requirements.lock pyproject.toml
	$(PY) -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(PY) -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps -e .
	@touch $@

# Never fails: without these the VDB export and the pictures say what is missing.
$(SYSTEM_STAMP): | .venv/bin/pip
	$(call apt,$(APT_PACKAGES),touch $@)

test: setup
	$(PY) -m pytest

lint: setup
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m pyright --pythonpath $(PY)

format: setup
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

demo: setup
	$(PY) -m gallery --out out --only bcc_parabola schwarz_p_linear infill

gallery: setup
	$(PY) -m gallery

baselines: setup
	$(PY) -m gallery --update

# Files whose name starts with an underscore are what the benchmarks share.
bench: setup
	@for script in benchmarks/[a-z]*.py; do echo "== $$script"; $(PY) "$$script" || exit 1; done

lock:
	$(PY) -m pip install --quiet --disable-pip-version-check uv
	{ echo "# Exact versions of everything, for Python 3.11+; made by: make lock"; \
	$(PY) -m uv pip compile --quiet --upgrade --universal --python-version 3.11 --extra dev \
		--no-annotate --no-header pyproject.toml; } > requirements.lock.new
	mv requirements.lock.new requirements.lock

clean:
	rm -rf .venv out build *.egg-info .pytest_cache .ruff_cache
