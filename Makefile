# Every target sets up what it needs first, from a bare checkout; a second run reuses what is there.
# PYTHON=python3.12 names the interpreter that .venv is made with.

SHELL := bash
.DEFAULT_GOAL := help
.PHONY: setup course test lint book notebooks bench mutation drop-in lab student-kit clean help

export PATH := $(CURDIR)/.venv/bin:$(PATH)
# What is newer than these is made again.
BOOK := _build/.made
NOTEBOOKS := build/.notebooks-made
files = $(shell find $(1) -mindepth 1 -not -path '*/__pycache__*' -not -path '*/.ipynb_checkpoints*')

setup: ## the environment and vendor files alone (every other target calls it)
	@tools/setup.sh

course: setup ## book, student notebooks, a sample class graded in the sandbox, feedback, grades.csv
	@$(MAKE) --no-print-directory $(NOTEBOOKS) $(BOOK)
	python tools/course.py

$(NOTEBOOKS): $(call files,solutions notebooks book) tools/notebooks.py requirements.lock
	python tools/notebooks.py
	@touch $@

$(BOOK): $(call files,book notebooks src) _config.yml _toc.yml requirements.lock package-lock.json
	jupyter-book build -W -n --keep-going .
	@touch $@

# Four processes on two processors: many tests wait, for a limit, a server or a browser.
test: lint ## everything CI runs
	@$(MAKE) --no-print-directory $(BOOK)
	OPENBLAS_NUM_THREADS=1 pytest -n 4 --dist loadfile --no-loadscope-reorder
	python tools/course.py

lint: setup ## ruff: rules and format
	ruff check .
	ruff format --check .

book: setup ## the web book, _build/html/index.html
	@$(MAKE) --no-print-directory $(BOOK)

notebooks: setup ## the student notebooks, notebooks/, from solutions/
	@$(MAKE) --no-print-directory $(NOTEBOOKS)

bench: setup ## every speed claim, as a ratio against a named baseline
	python -m benchmarks

mutation: setup ## the reference stages changed one sign or number at a time: do the hidden checks notice?
	OPENBLAS_NUM_THREADS=1 python tools/mutation.py

drop-in: setup ## nbgrader's own tests of autograding, with the plug-in in between (some minutes)
	python tools/drop_in.py

lab: setup ## JupyterLab on the student notebooks
	jupyter lab notebooks

student-kit: setup ## dist/: student wheel, zip of notebooks, student repository
	python tools/student_kit.py

clean: ## what the other targets made, but not .venv, grades or the course secret
	rm -rf _build build dist .pytest_cache .ruff_cache .hypothesis .jupyter_cache jupyter_execute

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
