# make install  the locked packages, into .venv (every other target does so first where it is missing)
# make repro    run every stage of every experiment from nothing, in a copy, and compare: paper, committed results, ours
# make test     set up everything, then run the tests
# make lint     formatting, lint, import rules, types
# make force    run every stage again in place, whether or not anything changed
# make status   whether the committed results are those of the committed code
# make checker  write checker.pyz: checks a certificate on any Python, with nothing installed
# make attack   20,000 changed certificates and 2,000 random references against prover and checker (minutes)
# make lab      Jupyter on the notebooks
# make docs     write report/site/index.html: documentation and results as pages that need neither a server nor a network
# make report   the same
# make paper    write paper/paper.md with the numbers of the results, and paper.pdf (pandoc, pdflatex, rsvg-convert)
# make bench    measure against other software, in an environment of its own (minutes; on a machine that is idle)
# make rivals   side by side with everything else that hands out trajectories, in an environment of its own (minutes)
# make study    10,000 drawn problems for all rivals, into .study; goes on where it was stopped (hours)
# make theorem  Coq proves its checker sound, and with NAME=example1 (or all) certificates, for the record; needs Coq
# make extracted  the same checker as a program, theorem/extracted/check, for files that are written for Coq; needs OCaml
# make lock     pin the newest versions that pyproject.toml allows, with hashes

PYTHON ?= python3
BIN := $(CURDIR)/.venv/bin
export PATH := $(BIN):$(PATH)
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: install repro test collected docs report paper lint style types user-types force status checker attack lab bench rivals study theorem extracted lock
.DELETE_ON_ERROR:

install: .venv/installed

repro: .venv/installed
	python -m pipeline reproduce

# Dozens of processes load the library: each would compile it again if none may keep what it has compiled. There is one
# more of them than there are cores, as some tests wait for programs that they start.
test collected: export PYTHONDONTWRITEBYTECODE :=
test: .venv/installed
	python -m pytest -n $$(python -c 'import os; print((os.cpu_count() or 1) + 1)') --dist loadfile

# What tests load is compiled by one process, where all workers would compile it at the same time.
collected: .venv/installed
	@python -m pytest --collect-only --quiet > .venv/collected || { cat .venv/collected; exit 1; }

lint: style types user-types

style: .venv/installed
	ruff format --check .
	ruff check .
	lint-imports

types: .venv/installed
	mypy

# Other options need a cache of their own: in a common one each run would throw away what the other keeps.
user-types: .venv/installed
	mypy --config-file= --strict --cache-dir .mypy_cache/user tests/trackably/user.py

force: .venv/installed
	dvc repro --force

status: .venv/installed
	@dvc status --quiet || { dvc status; echo "results and code do not belong together: run 'dvc repro' and commit" >&2; exit 1; }

checker: .venv/installed
	python -m pipeline.bundle checker.pyz

attack: TAMPERINGS ?= 20000
attack: REFERENCES ?= 2000
attack: SEED ?= 0
attack: .venv/installed
	OPENBLAS_NUM_THREADS=1 python -m tests.attack --tamperings $(TAMPERINGS) --references $(REFERENCES) --seed $(SEED)

lab: .venv/installed
	jupyter lab --LabApp.default_url=/lab/tree/notebooks  # served from here, as notebooks show files of data/

docs report: .venv/installed
	python -m pipeline report

paper: .venv/installed
	python -m pipeline paper
	@if command -v pandoc && command -v pdflatex && command -v rsvg-convert; \
	then cd paper && pandoc paper.md --citeproc --output paper.pdf; \
	else echo "paper.pdf needs pandoc, pdflatex and rsvg-convert"; fi

bench: .venv-bench/installed
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 .venv-bench/bin/python -m benchmarks

rivals: .venv-rivals/installed
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 .venv-rivals/bin/python -m benchmarks.rivals

study: .venv/installed
	python -m benchmarks.rivals.study --folder .study --summary benchmarks/rivals/study.json
	python -m benchmarks.rivals page

# Each file is compiled by itself: `coqc` would otherwise be the only program that knows what depends on what.
COQC := coqc -q -Q theorem Trackably

theorem: theorem/assumptions $(if $(NAME),theorem-of-$(NAME))

theorem-of-%: theorem/assumptions .venv/installed
	python -m pipeline theorem $(filter-out all,$*)

theorem/assumptions: theorem/Assumptions.v theorem/assumptions.txt theorem/Checker.vo
	$(COQC) $< | grep -oE '^[A-Z][A-Za-z0-9_.]+|^Axioms:' | diff theorem/assumptions.txt -
	@touch $@

theorem/Polynomials.vo: theorem/Statement.vo theorem/Jets.vo
theorem/Forms.vo: theorem/Polynomials.vo
theorem/Disturbance.vo: theorem/Statement.vo
theorem/Checker.vo: theorem/Forms.vo theorem/Disturbance.vo
theorem/%.vo: theorem/%.v | coq
	$(COQC) $<

extracted: theorem/extracted/check

theorem/extracted/check: theorem/Extraction.v theorem/program.ml theorem/Checker.vo
	@ocamlfind query zarith > /dev/null 2>&1 && test -e "$$(ocamlfind query coq-core.kernel 2> /dev/null)/kernel.cmxa" || \
		{ echo "OCaml with Coq's libraries is needed: apt-get install ocaml-findlib libcoq-core-ocaml-dev" >&2; exit 1; }
	@mkdir -p theorem/extracted
	cp theorem/Extraction.v theorem/program.ml theorem/extracted
	cd theorem/extracted && coqc -q -Q .. Trackably Extraction.v && ocamlfind ocamlopt -thread -rectypes -O3 -w -a \
		-package coq-core.kernel,zarith -linkpkg verified.mli verified.ml program.ml -o check

.PHONY: coq
coq:
	@test -d "$$(coqc -where 2> /dev/null)/user-contrib/Interval" || \
		{ echo "Coq with CoqInterval is needed: apt-get install coq libcoq-interval" >&2; exit 1; }

lock: .venv/installed
	python -m uv pip compile pyproject.toml --all-extras --group dev --universal --python-version 3.11 --upgrade \
		--generate-hashes --no-annotate --no-header --output-file requirements.lock
	python -m uv pip compile pyproject.toml --extra all --extra pipeline --group bench --constraint requirements.lock --universal \
		--python-version 3.11 --generate-hashes --no-annotate --no-header --output-file requirements-bench.lock
	python -m uv pip compile pyproject.toml --extra all --extra pipeline --group rivals --constraint requirements.lock --universal \
		--python-version 3.11 --generate-hashes --no-annotate --no-header --output-file requirements-rivals.lock

LOCKED := pip install --quiet --no-deps --require-hashes --requirement

# pip, which comes with Python, installs uv, and uv all other packages, in a third of the time. Where uv cannot, as it does
# not know pip's configuration of indexes, pip does.
.venv/installed: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Python 3.11 or newer is needed; name one with 'make PYTHON=python3.12 …'" >&2; exit 1; }
	test -x .venv/bin/python || $(PYTHON) -m venv .venv
	awk '/^[^ ]/ { wanted = /^uv==/ } wanted' $< > .venv/lock-uv
	python -m $(LOCKED) .venv/lock-uv
	python -m uv $(LOCKED) $< --python .venv/bin/python || python -m $(LOCKED) $<
	python -m pip install --quiet --no-deps --no-build-isolation --editable .
	python -m pip check
	touch $@

.venv-bench/installed: requirements-bench.lock pyproject.toml
	test -x .venv-bench/bin/python || $(PYTHON) -m venv .venv-bench
	.venv-bench/bin/python -m pip install --quiet --no-deps --require-hashes --requirement $<
	.venv-bench/bin/python -m pip install --quiet --no-deps --editable .
	touch $@

.venv-rivals/installed: requirements-rivals.lock
	test -x .venv-rivals/bin/python || $(PYTHON) -m venv .venv-rivals
	.venv-rivals/bin/python -m pip install --quiet --no-deps --require-hashes --requirement $<
	touch $@
