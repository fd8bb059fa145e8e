# make study   runs the default study (experiment=NAME and overrides="..." choose another)
# make test    runs the tests
# make test-long  runs the longest ones, which repeat at other faults what quicker tests show
# Each sets everything up in .venv first, which needs Python 3.11 and git.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
CORES ?= all
experiment ?= paper
overrides ?=

BIN := $(CURDIR)/.venv/bin
export PATH := $(BIN):$(PATH)
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
# pip installs without compiling, which is quicker; Python compiles a module when it is first imported, and keeps that
export PYTHONDONTWRITEBYTECODE :=

.PHONY: study test test-long

study: .venv/ready
	snakemake --cores $(CORES) --config experiment=$(experiment) "overrides=$(overrides)"

test: .venv/ready
	python -m pytest -n logical --maxprocesses 4

test-long: .venv/ready
	python -m pytest -n logical --maxprocesses 4 --dist load -m long

.venv/ready: requirements.txt pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed, PYTHON=... names one") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv .venv
	pip install --quiet --disable-pip-version-check --no-compile -r requirements.txt
	touch $@
