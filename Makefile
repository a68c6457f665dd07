# Every job of this repository is one command; `make` lists them.
# They need Python 3.11 or newer, make and a package index. Everything else goes into .venv.

PYTHON ?= python3
VENV   ?= .venv
ARGS   ?=

BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --quiet --disable-pip-version-check --no-input

MADE    := $(VENV)/.made
RUNTIME := $(VENV)/.runtime
DEV     := $(VENV)/.dev
KERNELS := $(VENV)/.kernels

.DEFAULT_GOAL := help
.PHONY: help kernels wheel paper test fuzz validate mutants processors lint format docs bench coverage lock clean distclean

help: ## this list
	@echo 'usage: make JOB [PYTHON=python3.13] [ARGS="..."]'
	@echo
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

kernels: $(KERNELS) ## the numerical kernels, compiled (the jobs that use them do it by themselves)

paper: $(KERNELS) ## every figure and number of the paper, into paper-figures/ (ARGS="--only 5" for one)
	$(BIN)/darboux paper $(ARGS)

test: export MPLBACKEND = Agg
test: export OPENBLAS_NUM_THREADS = 1
test: $(DEV) $(KERNELS) ## the tests, on every processor (ARGS="-k elastica" for some, ARGS="-n 0" in one process)
	$(BIN)/python -m pytest --numprocesses logical --dist worksteal $(ARGS)

fuzz: export MPLBACKEND = Agg
fuzz: export DARBOUX_FUZZ = 2000
fuzz: $(DEV) $(KERNELS) ## 2,000 random problems, 2,000 that buckle or snap, 300 by two methods, 500 random motions and 10,000 damaged files of each kind (an hour)
	$(BIN)/python -m pytest tests/test_any_problem.py tests/test_any_rest.py tests/test_any_motion.py tests/test_any_file.py \
		tests/test_close_places.py $(ARGS)

validate: export MPLBACKEND = Agg
validate: $(DEV) $(KERNELS) ## every reference case by every method, and docs/validation.md; all other tests marked long
	$(BIN)/python -m tests.validation.page $(ARGS)
	$(BIN)/python -m pytest -m long --ignore tests/validation

mutants: $(DEV) ## wrong formulas that tests must see (some minutes; ARGS="band link" for some files)
	$(BIN)/python -m tests.tools.mutants $(ARGS)

processors: $(DEV) ## the catalogue and the solver's tests as other processors compute them, and disturbed (a quarter of an hour)
	$(BIN)/python -m tests.tools.processors $(ARGS)

lint: $(DEV) ## style, format, types, and the direction of imports
	$(BIN)/python -m ruff check
	$(BIN)/python -m ruff format --check
	$(BIN)/python -m mypy
	$(BIN)/lint-imports --no-logo

format: $(DEV) ## put the source into its form
	$(BIN)/python -m ruff check --fix
	$(BIN)/python -m ruff format

docs: export OPENBLAS_NUM_THREADS = 1
docs: $(DEV) $(KERNELS) ## the site, into docs/_build/html/index.html: every page is executed, every warning is an error
	$(BIN)/python -m sphinx --jobs auto --fail-on-warning --keep-going --quiet --builder html $(ARGS) docs docs/_build/html

# One core, so that the ratios mean the same everywhere.
bench: export OMP_NUM_THREADS = 1
bench: export OPENBLAS_NUM_THREADS = 1
bench: export MKL_NUM_THREADS = 1
bench: export NUMBA_NUM_THREADS = 1
bench: $(DEV) $(KERNELS) ## the benchmarks, against SciPy and PyElastica
	$(BIN)/python benchmarks/run.py $(ARGS)

# All tests as ever, then some on uncompiled kernels, so that the kernels' lines are counted; NumPy warns where they do not.
coverage: export MPLBACKEND = Agg
coverage: $(DEV) $(KERNELS) ## the lines and branches that tests reach, kernels included; fails below 95 % (half an hour)
	$(BIN)/python -m coverage erase
	$(BIN)/python -m coverage run -m pytest $(ARGS)
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m coverage run -m pytest -W ignore::RuntimeWarning $(UNCOMPILED)
	$(BIN)/python -m coverage combine
	$(BIN)/python -m coverage report

UNCOMPILED := tests/kernels tests/test_numerics.py \
	tests/test_collocation.py::test_rows_of_the_end_conditions_are_their_derivatives \
	tests/test_collocation.py::test_the_tangent_is_the_derivative_by_the_load

# As a user gets it: in an environment of its own, where numba is not installed.
wheel: $(KERNELS) ## the wheel, into dist/, and what it can do without numba
	rm -rf dist .venv-wheel
	$(PIP) wheel --no-deps --no-build-isolation --wheel-dir dist .
	'$(PYTHON)' -m venv .venv-wheel
	grep '^[a-z]' requirements.txt | tr -d '\\' > .venv-wheel/constraints.txt
	.venv-wheel/bin/python -m pip --quiet --disable-pip-version-check --no-input install --constraint .venv-wheel/constraints.txt \
		dist/*.whl
	.venv-wheel/bin/python -I tests/tools/without_numba.py

# Environment variables of the caller's own index or settings do not reach the lock.
LOCK = .venv-lock/bin/uv --no-config --quiet pip compile --universal --python-version 3.11 --upgrade --generate-hashes \
	--no-emit-index-url --no-emit-find-links --no-annotate --custom-compile-command "make lock" --group build pyproject.toml
lock: ## choose the locked versions anew (needs uv from the package index)
	'$(PYTHON)' -m venv .venv-lock
	.venv-lock/bin/python -m pip --quiet --disable-pip-version-check install uv
	$(LOCK) --extra dev --extra bench --extra docs --extra cosseratbench --extra view --extra web --output-file requirements-dev.txt
	$(LOCK) --constraints requirements-dev.txt --output-file requirements.txt

clean: ## remove what the jobs made, but for the environment
	rm -rf build dist paper-figures docs/_build docs/gallery .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis .coverage .coverage.*
	rm -f src/darboux/kernels/_*.so src/darboux/kernels/_*.pyd $(KERNELS)
	find $(wildcard src tests benchmarks examples) -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## remove the environment too
	rm -rf $(VENV) .venv-lock .venv-wheel

# ---------------------------------------------------------------------------------------- environment
# Each stamp says: so far installed. A second call finds the stamp and installs nothing.

$(MADE):
	@command -v '$(PYTHON)' > /dev/null 2>&1 || { \
	  echo "darboux needs Python 3.11 or newer, but there is no '$(PYTHON)' here: install it, or name another by make PYTHON=/path/to/python." >&2; exit 1; }
	@'$(PYTHON)' -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "darboux needs Python 3.11 or newer, but '$(PYTHON)' is $$('$(PYTHON)' -c 'import platform; print(platform.python_version())'): name a newer one by make PYTHON=/path/to/python." >&2; exit 1; }
	@'$(PYTHON)' -c 'import ensurepip, venv' > /dev/null 2>&1 || { \
	  echo "'$(PYTHON)' cannot make environments: install its venv module (on Debian and Ubuntu: sudo apt install python3-venv), then try again." >&2; exit 1; }
	@echo "making $(VENV) ..."
	@'$(PYTHON)' -m venv $(VENV)
	@touch $@

$(RUNTIME): $(MADE) requirements.txt pyproject.toml
	@echo "installing darboux and what it needs into $(VENV) (a minute or so, once) ..."
	@$(PIP) install --require-hashes --requirement requirements.txt
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

# Without a C compiler nothing is built, and the kernels compile when they are first called.
$(KERNELS): $(RUNTIME) $(wildcard src/darboux/kernels/*.py)
	@$(BIN)/python -m darboux.kernels.build
	@touch $@

$(DEV): $(RUNTIME) requirements-dev.txt
	@echo "installing the tools of development into $(VENV) (once) ..."
	@$(PIP) install --require-hashes --requirement requirements-dev.txt
	@touch $@
