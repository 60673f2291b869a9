# omniroll: `make` runs the whole chain, `make test` the tests. Both set up .venv themselves; neither needs root.
# Needed beforehand: make, a C compiler (cc, or $CC) and Python 3.11 or newer with venv ($PYTHON).

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT := out/motions
BUILT := runtime/omniroll/kernels/built
PYTEST_ARGS ?= --numprocesses=logical --dist=worksteal

# Stamps carry a checksum of what they depend on, so a stamp is stale whenever that changes, in either direction.
key = $(shell { $(1); } 2>/dev/null | cksum | tr -s ' ' '-')
KERNEL_SOURCES := $(sort $(wildcard generated/c/*.h generated/data/*.json runtime/csrc/*.* runtime/csrc/*/*.c runtime/csrc/*/*.h codegen/*.py codegen/templates/*)) \
	setup.py pyproject.toml runtime/omniroll/kernels/building.py
VENV_STAMP := $(VENV)/.venv-$(call key,echo "$(CURDIR)"; $(PYTHON) -c "import sys; print(sys.version + sys.base_prefix)")
DEPS_STAMP := $(VENV)/.dependencies-$(call key,cat requirements.txt; echo $(VENV_STAMP))
BUILD_STAMP := $(VENV)/.build-$(call key,cat $(KERNEL_SOURCES); echo "$(CC) $(OMNIROLL_CFLAGS)"; echo $(DEPS_STAMP))

PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
say = @printf '\n==> %s\n' "$(1)"

.DEFAULT_GOAL := all
.PHONY: all setup build wheel test-aarch64 regenerate check-generated what-if equation maxima formulas motions test test-long bench \
	accuracy hard viewer check-viewer test-viewer docs pictures test-docs test-exports test-extras lines test-times flips \
	clean help
.DELETE_ON_ERROR:

# One after the other even under -j; each step reads the files that the step before it wrote.
STEPS := setup regenerate build motions
all:
	@printf '%s\n' 'omniroll: derive the equations and prove them (2.5 minutes of a processor, in two processes), compile the kernels (80 s), run' \
	    'the paper'"'"'s motions (seconds). make build does without the derivation.'
	@for step in $(STEPS); do began=$$(date +%s); $(MAKE) --no-print-directory $$step || exit 1; \
	    took="$$took $$step=$$(($$(date +%s) - began))"; done; $(BIN)/python -m codegen.last_screen $$took

$(VENV_STAMP):
	$(call say,environment: $(VENV))
	@$(PYTHON) -c "import sys; sys.version_info >= (3, 11) or sys.exit('omniroll needs Python 3.11 or newer, and $(PYTHON) is ' + sys.version.split()[0] + '; set PYTHON=...')"
	@$(PYTHON) -m venv --clear $(VENV)
	@touch $@

# pip would compile all modules on one core, the packages' tests among them.
$(DEPS_STAMP): $(VENV_STAMP)
	$(call say,dependencies: $$(grep -c == requirements.txt) pinned packages (the first time this takes a minute))
	@$(PIP) install --no-compile --require-hashes --requirement requirements.txt
	@$(BIN)/python -m compileall -qq -j 0 -x '/(tests?|OpenGL)/' $(VENV)/lib || true
	@rm -f $(VENV)/.dependencies-* && touch $@

$(BUILD_STAMP): $(DEPS_STAMP)
	$(call say,build: the C kernels and the package)
	@OMNIROLL_MUST_COMPILE=1 $(PIP) install --no-deps --no-build-isolation --editable .
	@rm -f $(VENV)/.build-* && touch $@

setup: $(DEPS_STAMP) ## create .venv and install the pinned dependencies

build: $(BUILD_STAMP) ## compile the kernels and install omniroll into .venv

WHEEL := OMNIROLL_MUST_COMPILE=1 $(PIP) wheel --no-deps --no-build-isolation --wheel-dir
CROSS := aarch64-linux-gnu-gcc
ARM := OMNIROLL_LEVELS=armv8-a CC=$(CROSS) $(WHEEL)

wheel: $(DEPS_STAMP) ## build wheels for other machines into dist/: x86-64; aarch64 where Debian's cross compiler is
	$(call say,wheels -> dist/)
	@OMNIROLL_LEVELS="x86-64 x86-64-v3 x86-64-v4" $(WHEEL) dist .
	@if command -v $(CROSS) > /dev/null; then $(ARM) dist .; \
	    else echo 'none for aarch64: $(CROSS) is not here (gcc-aarch64-linux-gnu, libc6-dev-arm64-cross)'; fi

test-aarch64: build ## build C programs and a wheel for aarch64, run them in QEMU: the same bits as here
	$(call say,aarch64 -> out/aarch64/)
	@for tool in $(CROSS) qemu-aarch64; do command -v $$tool > /dev/null \
	    || { echo "$$tool is not here: install gcc-aarch64-linux-gnu, libc6-dev-arm64-cross and qemu-user"; exit 1; }; done
	@rm -rf out/aarch64 && OMNIROLL_SETS=free OMNIROLL_CFLAGS=-O1 $(ARM) out/aarch64 .
	@$(BIN)/python tests/packaging/aarch64.py out/aarch64/*.whl out/aarch64

regenerate: $(DEPS_STAMP) ## derive with Maxima and write generated/
	$(call say,regenerate: Maxima -> generated/)
	@$(BIN)/python -m codegen

check-generated: $(DEPS_STAMP) ## derive again and compare with the committed generated/, byte by byte
	$(call say,check-generated: Maxima -> compare with generated/)
	@$(BIN)/python -m codegen --check

what-if: $(DEPS_STAMP) $(if $(RUN),$(BUILD_STAMP)) ## derive from a changed maxima/ (ONLY=paper: in seconds; RUN=SCENE NUMBERS="e=0.02": and simulate)
	$(call say,what-if: Maxima -> failing proofs and changed equations)
	@$(BIN)/python -m codegen.what_if $(if $(filter paper,$(ONLY)),--only-paper) $(if $(RUN),--run $(RUN)) $(addprefix --number ,$(NUMBERS))

equation: $(DEPS_STAMP) ## print the LaTeX of derived equations, ID="7.1:13 PP12"; without ID their list
	@$(BIN)/python -m codegen.equation $(ID)

maxima: $(DEPS_STAMP) ## open Maxima with the paper's part of the derivation loaded, in seconds
	@$(BIN)/python -m codegen.interactive

formulas: ## derive again, then print the comparison with the paper's formulas
	@$(MAKE) --no-print-directory regenerate build
	@$(BIN)/python -m omniroll formulas

# A program for an environment beside .venv, whose name is its argument: it sees what .venv has, omniroll among it.
SEES_VENV := import pathlib, sys, sysconfig as s; own = s.get_path('purelib'); pathlib.Path(own, 'omniroll-environment.pth').write_text('import site; site.addsitedir(' + repr(own.replace(sys.argv[1], '$(VENV)')) + ')\n')

BENCH_VENV := .venv-bench
BENCH_STAMP := $(BENCH_VENV)/.peers-$(call key,cat tests/benchmarks/requirements.txt; echo $(DEPS_STAMP))

# The peers have an environment of their own.
$(BENCH_STAMP): tests/benchmarks/requirements.txt
	$(call say,peers to compare with: $(BENCH_VENV))
	@$(PYTHON) -m venv --clear $(BENCH_VENV)
	@$(BENCH_VENV)/bin/python -m pip --disable-pip-version-check --quiet install --require-hashes --requirement $<
	@$(BENCH_VENV)/bin/python -c "$(SEES_VENV)" $(BENCH_VENV)
	@touch $@

bench: build ## compare with peers (CasADi, SymPy, heyoka, SciPy, MuJoCo), results into docs/benchmarks.md
	@$(MAKE) --no-print-directory $(BENCH_STAMP)
	$(call say,benchmarks -> docs/benchmarks.md)
	@cd tests && ../$(BENCH_VENV)/bin/python -m benchmarks $(QUESTIONS)

DOCS_VENV := .venv-docs
DOCS_STAMP := $(DOCS_VENV)/.tools-$(call key,cat docs/site/requirements.txt; echo $(DEPS_STAMP))

$(DOCS_STAMP): docs/site/requirements.txt
	$(call say,tools of the documentation: $(DOCS_VENV))
	@$(PYTHON) -m venv --clear $(DOCS_VENV)
	@$(DOCS_VENV)/bin/python -m pip --disable-pip-version-check --quiet install --require-hashes --requirement $<
	@$(DOCS_VENV)/bin/python -c "$(SEES_VENV)" $(DOCS_VENV)
	@touch $@

MATHJAX_STAMP := docs/site/node_modules/.packages-$(call key,cat docs/site/package-lock.json)

$(MATHJAX_STAMP):
	@cd docs/site && npm ci --ignore-scripts --loglevel=error
	@touch $@

docs: build $(MATHJAX_STAMP) ## build the documentation as a site, out/site/index.html (needs npm)
	@$(MAKE) --no-print-directory $(DOCS_STAMP)
	$(call say,pictures -> out/pictures/)
	@$(BIN)/python docs/site/pictures.py out/pictures
	$(call say,notebooks of the tutorials -> out/notebooks/)
	@$(BIN)/python docs/site/notebooks.py out/notebooks
	$(call say,docs -> out/site/index.html)
	@$(DOCS_VENV)/bin/python docs/site/assemble.py out/site-sources out/pictures out/notebooks
	@$(DOCS_VENV)/bin/python -m sphinx --quiet --fail-on-warning --keep-going -c docs/site out/site-sources out/site

pictures: build ## draw the pictures of the pages anew, into docs/
	$(call say,pictures -> docs/)
	@$(BIN)/python docs/site/pictures.py docs

test-docs: docs ## build that site and test it in Chromium; needs Playwright, which this installs into .venv
	$(call say,tests of the site in Chromium)
	@$(PIP) install --require-hashes --requirement tests/viewing/requirements.txt
	@$(BIN)/python -m pytest $(PYTEST_ARGS) tests/documentation_site/test_in_browser.py

ACCURACY := accuracy-motion-3

accuracy: build ## measure what accuracy costs on motion 3, results into docs/accuracy-motion-3.md
	@$(MAKE) --no-print-directory $(BENCH_STAMP)
	$(call say,accuracy -> docs/$(ACCURACY).md)
	@$(BENCH_VENV)/bin/python -m omniroll accuracy scenes/motion-3.toml --duration 8 --within 1800 --error 1e-6 --folder out/$(ACCURACY)
	@cp out/$(ACCURACY)/accuracy.png docs/$(ACCURACY).png
	@sed 's/(accuracy.png)/($(ACCURACY).png)/' out/$(ACCURACY)/accuracy.md > docs/$(ACCURACY).md

hard: build ## measure the hard cases, results into docs/hard-cases.md
	$(call say,hard cases -> docs/hard-cases.md)
	@cd tests && ../$(BIN)/python -m hard $(CASES)

motions: build ## run the paper's motions into out/motions/
	$(call say,motions: section 5 of the paper -> $(OUT)/)
	@$(BIN)/python -m omniroll motions $(OUT)

# Tests run on all cores at once; threads of the linear algebra beside them would wait for each other.
test test-long: export OPENBLAS_NUM_THREADS = 1

test: build ## run the tests that take a moment each
	$(call say,tests)
	@$(BIN)/python -m pytest $(PYTEST_ARGS) -m "not long"

test-long: build ## run the others: whole studies, other compilers, changed derivations, thousands of wrong inputs
	$(call say,long tests)
	@$(BIN)/python -m pytest $(PYTEST_ARGS) -m long

VIEWER := runtime/omniroll/viewer/assets
PACKAGES_STAMP := viewer/node_modules/.packages-$(call key,cat viewer/package-lock.json)

# Needs node and npm, which nobody else needs: what is built here is committed.
$(PACKAGES_STAMP):
	@cd viewer && npm ci --ignore-scripts --loglevel=error
	@touch $@

viewer: $(PACKAGES_STAMP) ## build the page of `omniroll view` from viewer/ into the package (needs node and npm)
	$(call say,viewer -> $(VIEWER))
	@node viewer/build.mjs

check-viewer: $(PACKAGES_STAMP) ## build that page again and compare it with the package's, byte by byte
	$(call say,check-viewer: viewer/ -> compare with $(VIEWER))
	@node viewer/build.mjs out/viewer
	@diff --recursive --brief out/viewer $(VIEWER)

test-viewer: build ## run the tests of that page in Chromium; they need Playwright, which this installs into .venv
	$(call say,tests of the page in Chromium)
	@$(PIP) install --require-hashes --requirement tests/viewing/requirements.txt
	@$(BIN)/python -m pytest $(PYTEST_ARGS) tests/viewing/test_in_browser.py

test-exports: build ## run the tests of FMUs and CasADi functions; they need FMPy and CasADi, which this installs into .venv
	$(call say,tests of exports)
	@$(PIP) install --no-deps --require-hashes --requirement tests/exports/requirements.txt
	@$(BIN)/python -m pytest $(PYTEST_ARGS) tests/exports

test-extras: build ## install each extra alone, into out/extras/, and run what it is for
	$(call say,extras -> out/extras/)
	@rm -rf out/extras && $(PIP) wheel --no-deps --no-build-isolation --wheel-dir out/extras .
	@$(BIN)/python tests/packaging/extras.py out/extras/*.whl out/extras $(EXTRAS)

lines: ## count lines by room beside their budgets, and what the preprocessor is asked in csrc
	@$(PYTHON) tests/lines.py

test-times: ## print the processor time that tests took, by folder beside their budgets
	@$(PYTHON) tests/processor_time.py

flips: $(DEPS_STAMP) ## ask each proof with a changed sign: none may hold
	$(call say,flips: each proof asked with a changed sign)
	@$(BIN)/python tests/flips.py

clean: ## remove all that make has written, .venv too
	rm -rf $(VENV) $(BENCH_VENV) $(DOCS_VENV) viewer/node_modules docs/site/node_modules build dist out runtime/*.egg-info *.egg-info $(BUILT)
	rm -rf .pytest_cache .hypothesis .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

help: ## list the targets
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/  make \1\t\2/' | expand -t 26
