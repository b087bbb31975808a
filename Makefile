# Two commands set everything up: `make demo` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: install demo test test-camera test-linuxcnc test-deb deb release bench-camera bench bench-link bench-daemon bench-page bench-start bench-replays bench-plant soak-plant bench-opcua profile accuracy methods refusals rules soak soak-camera soak-daemon hil check format clean

install: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	@echo "Installing into $(VENV): a minute or two"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	@touch $(STAMP)

demo: install
	@$(BIN)/combtrace demo --output demo-output

# Five at a time keep two cores at work all the time. A file's tests stay together, first those that wait most.
test: install
	$(BIN)/python -m pytest --numprocesses $(or $(WORKERS),5) --dist loadfile --no-loadscope-reorder

# A real kernel's camera: the tests run in a virtual machine that this boots (QEMU and kernel from Debian's packages).
test-camera: install
	$(BIN)/python tests/camera_guest/guest.py --timeout 3000 -- env COMBTRACE_CAMERA_GUEST=1 \
		$(BIN)/python -m pytest tests/camera_guest tests/contracts/test_camera_contract.py -p no:cacheprovider \
		-o faulthandler_timeout=900 -o faulthandler_exit_on_timeout=true

# Contours driven by a real CNC controller, in simulation (Debian's linuxcnc-uspace).
test-linuxcnc: install
	COMBTRACE_LINUXCNC=1 $(BIN)/python -m pytest tests/linuxcnc

# Wheel, source distribution and Debian packages, in dist/.
deb:
	sh packaging/deb.sh dist

# They are built twice, which must be the same, and installed, run, upgraded and removed in a clean machine. As root.
test-deb: install
	rm -rf dist
	sh packaging/reproduce.sh dist
	COMBTRACE_DEB=dist $(BIN)/python -m pytest tests/deb

# All that a version is handed out as, in dist/, if the tree is fit for it; says how to tag it and publishes nothing.
release: check
	sh packaging/release.sh dist

# FRAMES=100000: how memory fares over that many, half an hour.
bench-camera: install
	$(BIN)/python tests/camera_guest/guest.py --timeout 6000 -- $(BIN)/python -m benchmarks.cameras --frames $(or $(FRAMES),3000)

bench: install
	$(BIN)/python -m benchmarks.accuracy

bench-link: install
	$(BIN)/python -m benchmarks.link --write

bench-daemon: install
	$(BIN)/python -m benchmarks.daemon --write

# First paint and weight of the operator's page, and what a viewer costs a job.
bench-page: install
	$(BIN)/python -m benchmarks.daemon.page --write

# What telemetry costs a job, how soon it is there, and the fleet page of fifty cells.
bench-plant: install
	$(BIN)/python -m benchmarks.daemon.plant --write
# What node-opcua sees of 1,000 jobs, and what OPC UA's clients cost a job.
bench-opcua: install
	$(BIN)/python -m benchmarks.daemon.opcua --write

# A command's start and a first trace, over what they cannot be without.
bench-start: install
	$(BIN)/python -m benchmarks.start --write

# An archive of 2,000 jobs done again by one process, two, a Dask cluster, from a bucket, and under kills (JOBS=200: fewer).
bench-replays: install
	$(BIN)/python -m benchmarks.replays $(if $(JOBS),--jobs $(JOBS),--write)

# Times, passes over the picture, arrays and the largest of them, step by step, at 2, 12 and 48 MP; outlines a second.
profile: install
	$(BIN)/python -m benchmarks.profile --write
	$(BIN)/python -m benchmarks.live --write

accuracy: install
	$(BIN)/python -m benchmarks.accuracy --random 300 --first 998000 --write
	$(BIN)/python -m benchmarks.accuracy.shop_floor --workers 2 --write
	$(BIN)/python -m benchmarks.accuracy.shop_floor --workers 2 --taught --write
	$(BIN)/python -m benchmarks.covers.covered_edges --workers 2 --write
	$(BIN)/python -m benchmarks.accuracy.edge_kinds --workers 2 --write

# Every figure and table of docs/reports/methods.md; a test redraws them.
methods: install
	$(BIN)/python -m benchmarks.methods

# Each rule of the protocol taken out of a copy of the code: its test must fail then. A quarter of an hour on two cores.
rules: install
	$(BIN)/python -m tests.rules.mutate

# Campaigns under faults and kills, an hour or so on two cores; resumes where it was broken off (SOAK=--fresh: anew).
soak: install
	$(BIN)/python -m tests.soak $(SOAK)
	$(BIN)/python -m tests.soak.gige_run

# Software triggers of a GigE Vision camera on loopback that loses packets and is killed (TRIGGERS=10000), minutes.
soak-camera: install
	$(BIN)/python -m tests.soak.gige_run $(if $(TRIGGERS),--triggers $(TRIGGERS))

# Fifty cells at one broker that is killed and started again a hundred times, ten minutes.
soak-plant: install
	$(BIN)/python -m tests.soak.plant_run

# One daemon for 20,000 jobs: memory, descriptors, archive (JOBS=3000: fewer, and no report).
soak-daemon: install
	$(BIN)/python -m tests.soak.long_run $(if $(JOBS),--jobs $(JOBS),--write)

# The protocol's suite on a real controller. Whole contours, which may make it move, only with MOVE=yes.
hil: install
	@test -n "$(CONTROLLER)" || { echo "which controller? make hil CONTROLLER=tcp://HOST:PORT [MOVE=yes]"; exit 2; }
	$(BIN)/python -m pytest tests/hil/test_controller.py -p no:cacheprovider -vv -rs --hil-controller='$(CONTROLLER)' $(if $(filter yes,$(MOVE)),--hil-move)

# Pictures without a block, which must be refused by name, and traceable ones, which must not.
refusals: install
	$(BIN)/python -m benchmarks.refusals --write

check: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

format: install
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) build dist *.egg-info demo-output
