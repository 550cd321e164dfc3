# Every target sets up what it needs: python3 with venv, make and git are all that a machine must have.
VENV := .venv
PYTHON := $(VENV)/bin/python
INSTALL := $(PYTHON) -m pip install --quiet --quiet -c constraints.txt
READY := $(VENV)/.ready

.PHONY: demo test test-openvino lint types docs lock dist clean

# With SCAN=path, it ends with a scan of your own.
demo: $(READY)
	$(VENV)/bin/derain demo $(if $(SCAN),--scan "$(SCAN)")

# Two processes, half of the tests each; the one that finishes first takes over half of what is left.
# Nearly every file stays in one process, which makes what the file's tests share once.
test: $(READY)
	$(PYTHON) -m pytest --numprocesses 2 --dist worksteal

# Not among `make test`: a runtime of 180 MB, which nobody has to have.
test-openvino: $(READY)
	$(INSTALL) --no-build-isolation -e ".[openvino]"
	$(PYTHON) -m pytest tests/export/runtimes

lint: $(READY)
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .

# mypy and import-linter see the package as it installs: the top-level folders as sub-packages of derain.
types: $(READY)
	rm -rf build
	$(PYTHON) -m pip install --quiet --no-deps --no-build-isolation --target build/types .
	$(VENV)/bin/mypy build/types/derain
	cd build/types && $(CURDIR)/$(VENV)/bin/lint-imports --no-cache --no-logo $(CURDIR)/pyproject.toml

# The site in build/site; a warning is an error.
docs: $(READY)
	$(PYTHON) -m docs.tools.package_tree
	$(PYTHON) -m docs.tools.notebook docs/first_scan.ipynb build/docs/first_scan.md
	$(PYTHON) -m zensical build --clean --strict
	$(PYTHON) -m docs.tools.llms_text

# constraints.txt anew, from the newest versions that pyproject.toml admits; torch stays.
lock: $(READY)
	$(PYTHON) -m release.lock

# The wheel and the source distribution, each built, compared, installed alone, and run. With TAG=name,
# only where that is the tag of this version.
dist: $(READY)
	$(PYTHON) -m release.build --out dist $(if $(TAG),--tag "$(TAG)")

# pip first: that of an older Python knows no dependency groups. setuptools with it, to build derain.
$(READY): pyproject.toml constraints.txt
	python3 -m venv $(VENV)
	$(INSTALL) pip setuptools
	$(INSTALL) --no-build-isolation --group dev -e ".[all,docs]"
	$(PYTHON) -m derain.system.open3d_import
	touch $@

clean:
	rm -rf $(VENV) .cache build dist demo runs *.egg-info
