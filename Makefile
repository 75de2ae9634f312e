# Each target works first on a fresh clone: it sets up .venv where that is missing or out of date.
.PHONY: help setup demo run large paper ui test test-all durations lint docs validate clean
.DEFAULT_GOAL := run

help:                 # this list
	@sed -n 's/^\([a-z][a-z -]*\):[^#]*# /\1\t/p' $(MAKEFILE_LIST) | expand -t 16

setup: .venv/ready    # .venv with everything that is needed

DEMO = data/raw/band1/dips/band1-dips.mcap

demo: setup           # a virtual band: recorded with dips, fitted, launched once and fitted again
	@test -f $(DEMO) || .venv/bin/python -m stages.record band1-dips
	.venv/bin/sling fit $(DEMO) --mass 0.023 --diameter 0.0072 --rest-length 0.52 --name mine
	@test -f bands/mine/launches.csv || .venv/bin/sling observe bands/mine --draw=-0.30,-0.15 \
		--landing $$(.venv/bin/python -m tools.virtual_launch band1 -0.30 -0.15)
	@echo "Next: source .venv/bin/activate, then sling aim bands/mine --target 1.925"

.venv/ready: pyproject.toml constraints.txt tools/setup.sh
	@bash tools/setup.sh

run: setup            # everything that is stale, as `dvc repro` does it, on all cores
	PATH="$(CURDIR)/.venv/bin:$$PATH" sling flow

large: setup          # the same with ten times the rollouts a method; an hour and more
	PATH="$(CURDIR)/.venv/bin:$$PATH" .venv/bin/python tools/preset.py large

paper: setup          # the same as the paper prints it (presets/paper.yaml)
	PATH="$(CURDIR)/.venv/bin:$$PATH" .venv/bin/python tools/preset.py paper

ui: setup             # what `sling flow` does, in a browser on this machine: http://127.0.0.1:4200
	@.venv/bin/sling ui

test: setup           # the tests that prove that it works: five minutes
	.venv/bin/python -m pytest

test-all: setup       # all tests but the campaigns: slow ones too, and ten times the examples
	.venv/bin/python -m pytest -m 'not validation' --hypothesis-profile thorough

durations: setup      # which tests take longest
	.venv/bin/python -m pytest --durations=30

lint: setup           # ruff; basedpyright: types; import-linter and deptry: who imports what; codespell; code lines
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/basedpyright
	.venv/bin/lint-imports
	.venv/bin/deptry .
	.venv/bin/codespell
	.venv/bin/python tools/size.py

docs: setup           # the pages as a site, build/site/index.html; broken links fail
	@.venv/bin/pip install --disable-pip-version-check -q -e '.[docs]' -c constraints.txt
	@.venv/bin/python tools/site.py

validate: setup       # slow campaigns, and tests by other engines and readers; results are committed
	.venv/bin/pip install --disable-pip-version-check -q -e '.[dev,validation]' -c constraints.txt
	.venv/bin/sling verify
	.venv/bin/python -m pytest tests/validation/engines tests/validation/test_throughput.py tests/exporting tests/recording/masks \
		tests/recording/test_kinematics.py tests/cli/preflight/test_pictures.py \
		tests/rig/recorder/test_record.py
	.venv/bin/python -m pytest -m validation -n 0 validation/campaigns tests/validation \
		tests/recording/test_orange.py

clean:                # all but data, .checkpoints and DVC's cache
	rm -rf .venv build *.egg-info .hypothesis .pytest_cache .ruff_cache
	find . -name __pycache__ -not -path './.dvc/*' -prune -exec rm -rf {} +
