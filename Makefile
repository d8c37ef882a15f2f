# The commands on a fresh machine with Python 3.11 or 3.12, git and make:
#
#   make demo    run the rig on real ROS 2 nodes and show what comes out
#   make test    run every test
#   make docs    build the documentation: build/docs/index.html
#
# All create the environment first (.venv, once) and install anew into it when setup.py changes.
#   PYTHON=/path/to/python3.12    use this interpreter
#   VENV=folder                   put the environment elsewhere
#   ARGS="..."                    further arguments of `pam demo` or pytest

VENV ?= .venv
ARGS ?=
BIN := $(VENV)/bin
STAMP := $(VENV)/installed
BEFORE := $(VENV).before
EXTRAS := $(VENV)/extras
COMPILED := $(VENV)/compiled
RARELY := plotly|sqlalchemy|debugpy|pip|setuptools|matplotlib|fontTools|mypy|mypyc
SOURCES := $(shell find pam_actuation pam_sim -name '*.py')

# Nothing of a run leaves this machine, and one thread per process is fastest here.
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
export OPENBLAS_NUM_THREADS := 1
# Byte code is kept: without it every process compiles some 300 files again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo test docs env all_of_it clean

# PYTHON names another version than the environment has: another one takes its place.
VERSION_OF = $(shell "$(1)" -c 'import sys; print(sys.version_info[:2])' 2>/dev/null)
ifneq ($(PYTHON),)
ifneq ($(call VERSION_OF,$(PYTHON)),$(call VERSION_OF,$(BIN)/python))
.PHONY: $(STAMP)
endif
endif

help:
	@sed -n '/^#/!q; s/^# \{0,1\}//p' Makefile

demo: env
	@$(BIN)/pam demo $(ARGS)

test: env
ifeq ($(strip $(ARGS)),)
	@$(BIN)/python test/run_all.py
else
	@$(BIN)/python -m pytest $(ARGS)
endif

docs: $(EXTRAS)
	@$(BIN)/python -m sphinx -W --keep-going -q -b html docs build/docs $(ARGS)
	@echo 'documentation: build/docs/index.html'

# pip waits for the network most of the time: meanwhile the cores compile.
env:
	@$(MAKE) --no-print-directory --jobs 2 all_of_it

all_of_it: $(EXTRAS) $(COMPILED)
	@:

clean:
	rm -rf $(VENV) build install log *.egg-info .pytest_cache

INSTALL = PYTHONWARNINGS=ignore '$(BIN)/python' -m pip install --quiet --disable-pip-version-check --no-compile
FAILED = echo 'The installation failed. Without a network, point pip at a folder of wheels:' >&2; \
	echo '  PIP_NO_INDEX=1 PIP_FIND_LINKS=/path/to/wheels make env' >&2; exit 1
BYTE_CODE = '$(BIN)/python' -m compileall -q -j 0 -x 'site-packages/(.*/tests|$(RARELY))/' '$(VENV)/lib' >/dev/null 2>&1

# The pip of Python 3.11 takes twice as long to find what fits together as a present one.
# pip compiles one file after the other, tests of all packages as well; here all cores compile.
# Large packages of which little is imported are left to the first import.
# A name on the PATH proves nothing (version managers put stubs there), so each candidate is run.
# One within the environment would be moved with it, so the interpreter behind it is used.
# An environment that fits is kept. Another one is moved aside, and is back if its heir fails.
FITS = '$(BIN)/python' -c 'import pip, sys; sys.exit(str(sys.version_info[:2]) not in sys.argv)' \
	$(if $(PYTHON),"$(call VERSION_OF,$(PYTHON))","(3, 11)" "(3, 12)") >/dev/null 2>&1

$(STAMP): setup.py pyproject.toml
	@aside=''; \
	$(FITS) || { \
	found=''; \
	for python in $(if $(PYTHON),'$(PYTHON)',python3.12 python3.11 python3 python); do \
	  if "$$python" -c 'import sys, venv, ensurepip; \
	  sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))' >/dev/null 2>&1; then \
	    found="$$python"; break; \
	  fi; \
	done; \
	if [ -z "$$found" ]; then \
	  echo 'No usable Python: this project needs Python 3.11 or 3.12 with the venv module' >&2; \
	  echo '$(if $(PYTHON),(PYTHON=$(PYTHON) is not one or does not start).,(on Debian and Ubuntu: apt install python3-venv). Name one with: make PYTHON=/path/to/python3.12)' >&2; \
	  exit 1; \
	fi; \
	found="$$("$$found" -c 'import sys; print(sys._base_executable)')"; \
	rmdir '$(VENV)' 2>/dev/null; \
	if [ -e '$(BEFORE)' ] || { [ -e '$(VENV)' ] && [ ! -e '$(STAMP)' ]; }; then \
	  echo 'Nothing is replaced: $(VENV) was not finished by make, or $(BEFORE) is in the way.' >&2; \
	  echo 'Remove it, or name another folder with: make VENV=folder' >&2; \
	  exit 1; \
	fi; \
	echo "Creating the environment $(VENV) with $$("$$found" --version) (once; needs a network or a pip cache)"; \
	trap '[ ! -e "$$aside" ] || { rm -rf "$(VENV)"; mv "$$aside" "$(VENV)"; }' EXIT; \
	trap 'exit 1' INT TERM; \
	if [ -e '$(VENV)' ]; then aside='$(BEFORE)'; mv '$(VENV)' "$$aside"; fi \
	&& "$$found" -m venv '$(VENV)' || exit 1; \
	'$(BIN)/python' -m pip install --quiet --no-compile --retries 0 --upgrade pip >/dev/null 2>&1; \
	}; \
	$(INSTALL) --editable . || { $(FAILED); }; \
	rm -rf "$$aside"; \
	$(BYTE_CODE); \
	touch '$@'

# ROS 2 and what tests and documentation need. The project itself stays as it is: it is in use.
$(EXTRAS): $(STAMP)
	@'$(BIN)/python' -c 'from importlib.metadata import requires; \
	print("\n".join(one.partition(";")[0] for one in requires("pam_actuation") \
	if one.endswith(("extra == \"ros\"", "extra == \"test\""))))' > '$(VENV)/extras.txt'; \
	$(INSTALL) --requirement '$(VENV)/extras.txt' || { $(FAILED); }; \
	$(BYTE_CODE); \
	touch '$@'

# Machine code is kept by source file: after a change, or a pull, only what changed is compiled.
$(COMPILED): $(STAMP) $(SOURCES)
	@'$(BIN)/python' -m pam_actuation.warm_up \
	|| echo 'Not compiled ahead: the first run takes longer.' >&2
	@touch '$@'
