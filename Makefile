# make demo, make test: all the set-up a fresh machine needs is Python >= 3.11 and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
DOCS_READY := $(VENV)/.docs-ready

.PHONY: demo test check docs coverage licences audit bench example-report format clean help

help:
	@echo "make demo    make the environment, process the example test folder, print where the report is"
	@echo "make test    make the environment, run the tests"
	@echo "make check   format, lint, types, imports, then the tests"
	@echo "make docs    build the site into build/docs; every warning fails it"
	@echo "make coverage  run the tests, and tell by room which lines they ran; at least 90 %"
	@echo "make licences   print the licence of every package that is needed at run time"
	@echo "make audit   look those packages up in the lists of known vulnerabilities"
	@echo "make example-report    write reports/example anew"
	@echo "make bench   measure speed against error into reports/speed-error/"

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev,raw,tdms,bayes,cluster]'
	$(BIN)/python -m ploughval.run.warm
	@touch $@

$(DOCS_READY): $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	@touch $@

demo: $(READY)
	$(BIN)/ploughval process data/example --out build/demo

test: $(READY)
	$(BIN)/python -m pytest -q -n 2 --dist worksteal

check: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(MAKE) test

docs: $(DOCS_READY)
	$(BIN)/sphinx-build -E -W --keep-going -q -c docs -d build/doctrees . build/docs
	$(BIN)/python -m pytest -q tests/docs/site # skipped by make test, which has no Sphinx
	@echo build/docs/docs/index.html

# compiled kernels are not traced: tests of theirs that take seconds as plain Python run once more like that
INTERPRETED := $(wildcard tests/model/test_model_mechanism*.py tests/model/test_model_surface*.py) \
	tests/model/test_model_blocks.py tests/model/test_model_layers.py tests/model/test_model_softening.py

coverage: $(READY)
	rm -f .coverage
	$(BIN)/python -m pytest -q -n 2 --dist worksteal --cov --cov-report=
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -q -n 2 --cov --cov-append --cov-report= $(INTERPRETED)
	$(BIN)/python benchmarks/coverage_rooms.py

licences: $(READY)
	$(BIN)/python .ci/licences

audit: $(READY)
	$(BIN)/python .ci/audit

example-report: $(READY)
	$(BIN)/ploughval process data/example --out build/example-report --fresh
	cp build/example-report/report.html reports/example/report.html

bench: $(READY)
	$(BIN)/ploughval bench

format: $(READY)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

clean:
	rm -rf build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
