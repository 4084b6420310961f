# Targets of StereoCell. Make runs the phases of a build, whose results are files of OUT. Inside a phase,
# the program runs the tasks of all tiles and channels by itself.
.DEFAULT_GOAL := help
SHELL := /bin/bash

# Values of these variables come from users and may hold any characters. Make does not expand them and
# hands them to commands through the environment. Recipes write "$$OUT", never $(OUT), so that no shell
# interprets the value.
SET := INPUT OUT SAMPLE WORKERS ARGS T PYTHON CHROMIUM BLENDER_BASE STEREOCELL_DATA CI
$(foreach name,$(SET),$(if $(filter-out undefined,$(origin $(name))),$(eval override export $(name) := $$(value $(name)))))

export PYTHON ?= python3
export SAMPLE ?= cycif
export ARGS ?=
ifndef WORKERS
export WORKERS := $(shell nproc)
endif
ifeq ($(SAMPLE),brain-cells)
export OUT ?= out/brain-cells
DEMO_INPUT := out/samples/brain-cells.ome.tif
DEMO_ARGS := --preset lightsheet --grid 2x2
else ifeq ($(SAMPLE),mri)
export OUT ?= out/mri-demo
DEMO_INPUT := out/samples/head
DEMO_ARGS := --preset mri
else ifeq ($(SAMPLE),cells)
export OUT ?= out/cells
DEMO_INPUT := out/samples/cells.ome.zarr
DEMO_ARGS := --grid 2x1 --channels DNA,panCK,CD3,CD68 --labels cells --table out/samples/cells.csv
else ifeq ($(SAMPLE),cycif)
export OUT ?= out/demo
DEMO_INPUT := out/samples/cycif.ome.zarr
DEMO_ARGS := --preset cycif --grid 5x2
else
$(error SAMPLE is $(SAMPLE), expected cycif, brain-cells, mri or cells)
endif

# Quotes a value as one word of bash. Shells that make starts while it reads this file need this, since
# make's variables are not in their environment.
define newline


endef
quoted = $$'$(subst $(newline),\n,$(subst ',\',$(subst \,\\,$(1))))'

# .venv belongs to the version of Python that made it. A PYTHON of another version gets its own folder,
# such as .venv-3.13, so that the two environments never overwrite each other.
VENV := .venv
ifneq ($(PYTHON),python3)
ifeq ($(origin VENV),file)
VERSION := $(filter 2.% 3.%,$(shell $(call quoted,$(PYTHON)) -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null))
ifneq ($(filter-out .venv/lib/python$(VERSION),$(wildcard .venv/lib/python3.*)),)
VENV := .venv-$(or $(VERSION),missing)
endif
endif
endif
BIN := $(VENV)/bin
RUN := $(BIN)/stereocell
WITH_ARGS := $(BIN)/python pipeline/with_args.py
READY := $(VENV)/.ready
DEV_READY := $(VENV)/.ready-dev
KERNELS_READY := $(VENV)/.kernels
PIP := $(BIN)/pip install --quiet --disable-pip-version-check --no-compile
# uv takes a fifth of pip's time. pip is the fallback, for example behind an index that only pip is configured for.
INSTALL = $(BIN)/uv pip install --quiet --python $(BIN)/python $(1) || $(PIP) $(1)
VIEWER := viewer_gltf
VIEWER_READY := $(VIEWER)/node_modules/.ready
VIEWER_DIST := $(VIEWER)/dist/index.html
VIEWER_SOURCES := $(shell find $(VIEWER)/src $(VIEWER)/public $(VIEWER)/scripts/types.ts $(VIEWER)/*.html $(VIEWER)/*.ts $(VIEWER)/*.json schemas -type f 2>/dev/null) \
  $(addprefix pipeline/stereocell/,filters/min_max_bricks.py formats/voxel_bvh.py inbox/item.py live/build_state.py $(patsubst %,transfer/%.py,presets opacity mr_grey channel_statistics))
ifndef CHROMIUM
export CHROMIUM := $(shell command -v chromium || command -v chromium-browser || command -v google-chrome)
endif
# Turns on Python's cache of bytecode, which some systems turn off. Without it, each process compiles the
# modules that it imports. Compiling all of .venv in advance takes 30 s, and most of it is never imported.
export PYTHONDONTWRITEBYTECODE :=
# Folder of real volumes. Tests that need one are skipped where the folder is missing.
ifneq ($(wildcard ../shared/data),)
export STEREOCELL_DATA ?= $(abspath ../shared/data)
endif

.PHONY: help setup setup-dev demo plan units stage bundle view serve report check lint record-steps test test-python test-viewer test-pages test-built test-bundles test-here test-fast test-newest test-newest-here test-exhaustive blender test-blender test-dcc torture careless bench bench-build bench-builds bench-demo bench-live bench-start bench-size bench-scale bench-scene bench-breadth bench-iso bench-level-score bench-threshold bench-tissue bench-unit bench-cells bench-wrap bench-serve bench-viewer bench-fps object-store wheel docs docs-pictures notebook lock platforms licences format-table benchmarks clean browser mono

help: ## Show this help
	@echo "StereoCell: volumes to USD stage, web bundle and stereo view. make TARGET [NAME=VALUE ...]"
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  %-15s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

REQUIRE_NODE := node -e 'const [a, b] = process.versions.node.split("."); process.exit(+(a * 100 + +b < 2019))' || \
  { echo "setup: node is missing or older than 20.19, expected Node.js 20.19 or newer" >&2; exit 1; }

setup: $(READY) $(KERNELS_READY) $(VIEWER_DIST) ## Make .venv and the viewer (Python 3.11+, Node 20.19+; PYTHON=python3.13: .venv-3.13 beside .venv)

setup-dev: setup $(DEV_READY) ## The same with the packages of tests, linters, benchmarks and docs (1.7 GB more)

$(READY): requirements.lock pyproject.toml
	@"$$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || \
	  { found=$$("$$PYTHON" --version 2>/dev/null); \
	    echo "setup: $$PYTHON is $${found:-not installed}, expected 3.11 or newer (PYTHON=... names another)" >&2; exit 1; }
	test -x $(BIN)/python || "$$PYTHON" -m venv $(VENV)
	@sed -n '/^uv==/,/[^\\]$$/p' requirements.lock > $(VENV)/uv.lock
	$(PIP) --require-hashes -r $(VENV)/uv.lock
	$(call INSTALL,--require-hashes -r requirements.lock)
	$(call INSTALL,--no-deps --no-build-isolation -e .)
	@touch $@

# Packages of tests, linters, benchmarks and docs. They take as much space as those of users.
$(DEV_READY): requirements-dev.lock $(READY)
	$(call INSTALL,--require-hashes -r requirements.lock -r requirements-dev.lock)
	@touch $@

# Compiles the loops over voxels and triangles, within a minute on two cores, so that no build waits.
$(KERNELS_READY): $(READY)
	@$(BIN)/python -m stereocell.kernels
	@touch $@

$(VIEWER_READY): $(VIEWER)/package-lock.json
	@$(REQUIRE_NODE)
	cd $(VIEWER) && npm ci --no-audit --no-fund --loglevel=error
	@touch $@

$(VIEWER_DIST): $(VIEWER_READY) $(VIEWER_SOURCES)
	cd $(VIEWER) && npm run --silent build
	@touch $@

browser: ## Install Debian's Chromium and Mesa's software renderer for the browser tests, if Chromium is missing (needs root)
	@if [ -n "$$CHROMIUM" ]; then :; \
	elif [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
	    chromium libegl-mesa0 libgl1-mesa-dri >/dev/null; \
	elif [ -n "$$CI" ]; then echo "browser: no chromium, and CI needs one: apt-get install chromium" >&2; exit 1; \
	else echo "browser: no chromium, so the browser tests are skipped; get it by: sudo apt-get install chromium"; fi

# Runs after `browser`, because dpkg allows one installation at a time.
mono: browser ## Install Debian's Mono and shader compilers for the tests of the Unity package (needs root)
	@if [ -e /usr/lib/cli/Newtonsoft.Json-5.0 ] && [ -e /usr/lib/mono/4.5/System.IO.Compression.FileSystem.dll ] && (for each in mcs mono glslangValidator spirv-cross; do command -v $$each >/dev/null || exit 1; done); then :; \
	elif [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
	    mono-mcs mono-runtime libnewtonsoft-json5.0-cil libmono-system-io-compression-filesystem4.0-cil \
	    glslang-tools spirv-cross >/dev/null; } \
	  || echo "mono: can't be installed here, so tests of the Unity package are skipped" >&2; \
	else echo "mono: no Mono or shader compilers, so tests of the Unity package are skipped; on Debian get them by: sudo make mono"; fi

# The packages of Python, those of the viewer, the kernels and the sample are made side by side. Node is
# looked for first, since its error would otherwise stand between the lines of other steps.
demo: ## Build and check a sample that comes with StereoCell (SAMPLE=cycif, brain-cells, mri or cells)
	@test -e $(VIEWER_READY) || $(REQUIRE_NODE)
	@$(MAKE) --no-print-directory -j3 setup $(DEMO_INPUT)
	$(WITH_ARGS) $(RUN) build $(DEMO_INPUT) --out="$$OUT" --workers="$$WORKERS" $(DEMO_ARGS) ARGS
	@echo
	@du -sh -- "$$OUT"/{stage,bundle,report}
	$(RUN) check --deep --workers="$$WORKERS" -- "$$OUT"
	@printf 'look at it:  make view OUT=%q\n' "$$OUT"

$(DEMO_INPUT): | $(READY)
	@mkdir -p $(@D)
	$(RUN) sample "$$SAMPLE" $@

# Make accepts no space, `%` or `:` in the name of a file. It therefore finds the files of a phase through
# a link to OUT. The link lies in a folder named by a checksum of OUT, together with a link to INPUT and a
# file of the arguments.
PLACE := out/.make/$(firstword $(shell printf %s $(call quoted,$(OUT)) | sha256sum))
ifneq ($(filter plan units stage bundle report,$(MAKECMDGOALS)),)
ifeq ($(INPUT),)
$(error INPUT is not set, expected INPUT=volume.ome.zarr OUT=folder)
endif
ifeq ($(OUT),)
$(error OUT is empty, expected OUT=folder)
endif
$(shell mkdir -p $(PLACE); out=$(call quoted,$(OUT)) input=$(call quoted,$(INPUT)) args=$(call quoted,$(ARGS)); \
  ln -sfnr -- "$$out" $(PLACE)/out; rm -f $(PLACE)/input; [ ! -e "$$input" ] || ln -sr -- "$$input" $(PLACE)/input; \
  printf '%q ' "$$input" "$$args" | cmp -s - $(PLACE)/asked || printf '%q ' "$$input" "$$args" > $(PLACE)/asked)
endif

plan: $(PLACE)/out/plan.json ## Plan the build (channels, levels, tiles):  INPUT=... OUT=... [ARGS="--grid 5x2"]
units: $(PLACE)/out/units/done.json ## Plan, and build the meshes and volumes of every tile and channel
stage: $(PLACE)/out/stage/stage.usda ## All of the above, and the USD stage
bundle: $(PLACE)/out/bundle/manifest.json ## All of the above, and the web bundle
report: $(PLACE)/out/report/index.html ## All of the above, and a page with pictures

# A changed INPUT or changed ARGS make the plan again.
$(PLACE)/out/plan.json: $(PLACE)/asked $(wildcard $(PLACE)/input) | setup
	$(WITH_ARGS) $(RUN) plan --out="$$OUT" ARGS -- "$$INPUT"
	@touch -c $@
$(PLACE)/out/units/done.json: $(PLACE)/out/plan.json
	$(RUN) units --workers="$$WORKERS" -- "$$OUT"
	@touch -c $@
$(PLACE)/out/stage/stage.usda: $(PLACE)/out/units/done.json
	$(RUN) stage --workers="$$WORKERS" -- "$$OUT"
	@touch -c $@
$(PLACE)/out/bundle/manifest.json: $(PLACE)/out/stage/stage.usda $(VIEWER_DIST)
	$(RUN) bundle --workers="$$WORKERS" -- "$$OUT"
	@touch -c $@
$(PLACE)/out/report/index.html: $(PLACE)/out/bundle/manifest.json
	$(RUN) report --workers="$$WORKERS" -- "$$OUT"
	@touch -c $@

check: setup ## Check OUT by its schemas and by the rules of USD, glTF and KTX2
	$(RUN) check -- "$$OUT"

view: setup ## Serve the bundle of OUT on this machine and open a browser
	$(RUN) view -- "$$OUT"

serve: setup ## Serve OUT and stream the voxels that the viewer looks at:  OUT=... [ARGS=--lan]
	$(WITH_ARGS) $(RUN) serve ARGS -- "$$OUT"

lint: $(DEV_READY) $(VIEWER_READY) ## Check style, types, imports between packages, versions of steps and plain English: ruff, mypy, biome, tsc
	$(BIN)/ruff check pipeline tests docs
	@# Files opened without an encoding use the system's, which is not UTF-8 on Windows.
	$(BIN)/ruff check --quiet --preview --select PLW1514 pipeline
	$(BIN)/ruff format --check pipeline tests docs
	$(BIN)/mypy
	PYTHONPATH=pipeline $(BIN)/lint-imports --no-cache --no-logo
	$(SUPPORT).step_record
	$(SUPPORT).prose
	cd $(VIEWER) && npm run --silent lint && npm run --silent typecheck

record-steps: $(DEV_READY) ## Record the code that each step uses, after you have decided whether its VERSION changes
	$(SUPPORT).step_record --write

# One process for each core, and one thread in each. More threads would compete for the cores.
PYTEST := OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n "$$WORKERS"
SUPPORT := PYTHONPATH=tests $(BIN)/python -m support
VITEST := cd $(VIEWER) && npm exec --silent -- vitest run

test-here: setup-dev ## Quick tests of one package (T=meshes) or of one folder of the viewer (T=panel)
	@found=; \
	if [ -n "$$T" ] && [ -e "tests/$$T" ]; then found=1; code=0; $(PYTEST) -m "not slow" "tests/$$T" || code=$$?; \
	  [ $$code != 5 ] || printf 'all tests of %s are slow: %s tests/%s runs them\n' "$$T" $(BIN)/pytest "$$T"; \
	  [ $$code = 0 ] || [ $$code = 5 ] || exit $$code; fi; \
	if [ -n "$$T" ] && [ -e "$(VIEWER)/src/$$T" ]; then found=1; $(VITEST) --project unit "src/$$T" || exit; fi; \
	[ -n "$$found" ] || { printf 'T is %s, expected a folder of tests or of %s, as T=meshes\n' "$$T" $(VIEWER)/src >&2; exit 2; }

test-fast: setup-dev ## Quick tests: no whole builds, no malformed inputs, no browser
	$(PYTEST) -m "not slow" --ignore tests/system --ignore tests/malformed
	$(VITEST) --project unit

# Tests of Python and of the viewer run side by side. While a browser waits, Python uses the cores.
test: setup-dev browser mono ## All tests, also those in headless Chromium
	$(MAKE) --no-print-directory -j2 test-python test-viewer

# Linux shares the cores between sessions first, and applies `nice` only within a session. Browsers have a
# session of their own. In CI pytest gets one as well, and that session yields to the browsers'. Elsewhere
# it stays in the terminal's session, so that Ctrl+C reaches it.
BEHIND := $(if $(CI),setsid --wait sh -c 'echo 10 > /proc/self/autogroup 2>/dev/null; exec "$$@"' behind) nice -n 10
# While browsers have priority, the server of a test can answer later than its client waits for. CI
# therefore runs failed tests a second time, alone and at normal priority. A real fault fails both times.
AGAIN := $(if $(CI),|| $(BIN)/pytest --last-failed --last-failed-no-failures none)
# Three processes share two cores, because tests of builds, servers and clusters often wait. The tests of
# one file stay in one process, because they share what they have built. In a fresh clone one process
# compiles all test modules first. Otherwise each of the three would compile them.
test-python: setup-dev
	[ -d tests/__pycache__ ] || $(BEHIND) $(BIN)/pytest --collect-only -qq > /dev/null
	OPENBLAS_NUM_THREADS=1 STEREOCELL_MESSAGES=out/messages.md $(BEHIND) $(BIN)/pytest -n $$((WORKERS + (WORKERS + 1) / 2)) --dist loadfile --no-loadscope-reorder --durations 25 $(AGAIN)

# CI has no time to run all tests with two versions of Python. The newest version therefore gets a
# selection: files read and written by libraries, a full disk, and a build and an export by the installed
# wheel. The Python of pyenv is found even if pyenv has not activated it.
NEWEST := 3.13
test-newest: setup ## A few tests with Python 3.13, where it is installed (all: make test PYTHON=python3.13)
	@for each in python$(NEWEST) "$${PYENV_ROOT:-$$HOME/.pyenv}"/versions/$(NEWEST).*/bin/python$(NEWEST); do \
	  if "$$each" -c '' 2>/dev/null; then exec $(MAKE) --no-print-directory test-newest-here PYTHON="$$each"; fi; \
	done; echo "test-newest: skipped: python$(NEWEST) is not installed"

# These tests may run at the same time as those of another Python, so they do not write pytest's list of
# failed tests.
test-newest-here: setup-dev
	$(BEHIND) $(BIN)/pytest -p no:cacheprovider $(addprefix tests/,$(NEWEST_TESTS))
NEWEST_TESTS := $(patsubst %,read/test_%.py,tiff bare_zarr zarr_collections number_types n5) \
  storage/test_full_disk.py system/test_empty_environment.py

test-exhaustive: setup-dev browser ## All tests, with all cases of the sweeps of which `make test` runs a few
	STEREOCELL_EXHAUSTIVE=1 $(MAKE) --no-print-directory test
	$(MAKE) --no-print-directory torture

# These bundles are the demo's, and one of half of its tiles.
ifdef STEREOCELL_EXHAUSTIVE
SHOWN := demo
DEEP := --deep
else
SHOWN := half
endif

# Tests that need no built bundle run while the bundles of the other tests are built.
test-viewer: setup-dev browser
	$(VITEST) --project unit
	$(MAKE) --no-print-directory -j2 test-pages test-built

test-pages: setup-dev browser
	$(VITEST) --project browser

test-built: test-bundles browser
	out="$$PWD/out" && cd $(VIEWER) && STEREOCELL_TEST_BUNDLE="$$out/$(SHOWN)/bundle" \
	  STEREOCELL_REAL_BUNDLE="$$out/brain-cells/bundle" \
	  STEREOCELL_HEAD_BUNDLE="$$out/mri/bundle" \
	  STEREOCELL_F_BUNDLES="$$out/f/of-f.ome.tif/bundle:$$out/f/of-f.ome.zarr/bundle:$$out/f/of-f.nii.gz/bundle:$$out/f/of-dicom/bundle" \
	  STEREOCELL_FORM_BUNDLES="$$out/forms/fluorescence/bundle:$$out/forms/ct/bundle:$$out/forms/mr/bundle" \
	  STEREOCELL_EDIT_BUNDLES="$$out/edit/before:$$out/edit/built/bundle" \
	  npm exec --silent -- vitest run --project built

test-bundles: setup-dev
ifdef STEREOCELL_EXHAUSTIVE
	$(MAKE) --no-print-directory demo SAMPLE=cycif OUT=out/$(SHOWN)
endif
	$(SUPPORT).viewer_bundles out $(DEEP)
	$(MAKE) --no-print-directory demo SAMPLE=mri OUT=out/mri

# Blender's Python module needs Python 3.11 and numpy 1, so it gets an environment of its own.
BLENDER := $(VENV)/blender
export BLENDER_BASE ?= python3.11
blender: setup
	@$(BLENDER)/bin/python -c 'import bpy' >/dev/null 2>&1 \
	  || { "$$BLENDER_BASE" -m venv --clear $(BLENDER) \
	       && { $(BIN)/uv pip install --quiet --python $(BLENDER)/bin/python bpy==5.0.1 'numpy<2' \
	            || $(BLENDER)/bin/pip install --quiet --disable-pip-version-check bpy==5.0.1 'numpy<2'; }; } \
	  || echo "blender: bpy 5.0.1 can't be installed here (it wants $$BLENDER_BASE and 350 MB)" >&2

test-blender: $(DEV_READY) blender browser ## The Blender add-on in headless Blender (bpy 5.0.1 in .venv/blender)
	@if $(BLENDER)/bin/python -c 'import bpy' 2>&1; then \
	  STEREOCELL_BLENDER=$(BLENDER)/bin/python $(BIN)/pytest tests/blender; \
	else echo "test-blender: skipped: no Blender to run the add-on in"; fi

# The last sample is real data. It is left out where the folder of real volumes is missing.
DCC_SAMPLES := cycif brain-cells mri cells
DCC_REAL := $(wildcard $(STEREOCELL_DATA)/brain_cells_2ch/brain_cells_2ch.ome.tif)
test-dcc: $(DEV_READY) blender browser ## Render the samples in Storm, Blender, the add-on, three.js and Cesium; pictures in out/dcc/sheet.png
	@for sample in $(DCC_SAMPLES); do \
	  $(MAKE) --no-print-directory demo SAMPLE=$$sample OUT=out/dcc/$$sample || exit; done
	@[ -z "$(DCC_REAL)" ] || $(RUN) build "$(DCC_REAL)" --out=out/dcc/brain-cells-2ch --workers="$$WORKERS"
	STEREOCELL_BLENDER=$(abspath $(BLENDER))/bin/python STEREOCELL_DCC_SHEET=out/dcc/sheet.png \
	  STEREOCELL_DCC="$(foreach one,$(DCC_SAMPLES) $(if $(DCC_REAL),brain-cells-2ch),$(one)=out/dcc/$(one))" \
	  $(BIN)/pytest tests/blender/test_programs.py

object-store: setup ## Install versitygw by Go, an object store for the tests (they use moto's server without it)
	GOBIN="$$PWD/$(BIN)" go install github.com/versity/versitygw/cmd/versitygw@latest

torture: setup-dev ## Kill 50 builds, spread over all phases, and build all malformed inputs and 2640 altered files
	$(SUPPORT).torture 50
	$(BIN)/python tests/malformed
	$(BIN)/python tests/malformed/sweep.py

careless: setup-dev browser ## Use a bundle's page carelessly by script for ten minutes:  [OUT=out/demo] (figures in out/careless.json)
	out="$$(realpath -- "$$OUT")" && report="$$PWD/out/careless.json" && cd $(VIEWER) && \
	  STEREOCELL_TEST_BUNDLE="$$out/bundle" STEREOCELL_CARELESS_S=600 STEREOCELL_CARELESS_REPORT="$$report" \
	  npm exec --silent -- vitest run --project built test/page/careless.built.test.ts -t "changes only"

bench: setup-dev ## Compare pairs of alternatives in one run (ratios of medians)
	$(BIN)/python tests/bench/bench.py

bench-build: setup-dev ## Measure each phase of a build of INPUT into OUT, with the check  (WORKERS=1 ARGS="--preset mri")
	$(WITH_ARGS) $(BIN)/python tests/bench/phases.py "$$OUT" "$$WORKERS" "$$INPUT" ARGS

bench-builds: setup-dev ## Measure each phase of a sample tile and of real volumes, on 1 and 2 workers  (ARGS="--baseline CHECKOUT --publish")
	$(WITH_ARGS) $(BIN)/python tests/bench/builds.py out/bench-builds ARGS

bench-demo: setup-dev ## Time `make demo` in a fresh clone of the last commit, step by step
	$(BIN)/python tests/bench/demo.py out/bench-demo

bench-live: setup-dev ## Time `stereocell view SOURCE`: first picture, its colours, and answers while a build runs
	$(BIN)/python tests/bench/live_view.py
	$(BIN)/python tests/bench/live_color.py

bench-start: setup-dev ## Time the start of each command, up to its help or a missing input
	PYTHONPATH=tests $(BIN)/python tests/bench/start.py

bench-size: setup-dev ## Measure the disk space of each requirement
	$(BIN)/python tests/bench/install_size.py

bench-scale: setup-dev ## Measure units per second, memory and bytes read for 4 to 32 units, noise, and a whole dataset  (ARGS=--publish: for the docs)
	$(WITH_ARGS) $(BIN)/python tests/bench/scale.py out/bench-scale ARGS

bench-scene: setup-dev ## Time the paper's scene (5 x 2 tiles of 194 x 512 x 512, 3 channels) on 1 and 2 workers and a cluster  (ARGS=--publish)
	$(WITH_ARGS) $(BIN)/python tests/bench/scene.py out/bench-scene ARGS

bench-breadth: setup-dev ## Time builds of many small units: up to 22 x 11 tiles of 64^3, 4 channels  (ARGS=--publish: for the docs)
	$(WITH_ARGS) $(BIN)/python tests/bench/breadth.py out/bench-breadth ARGS

bench-iso: setup-dev ## Score the iso-values found on a corpus of volumes, and those of other programs; also on empty volumes
	$(BIN)/python tests/bench/iso.py

bench-level-score: setup-dev ## Compare a scored choice of the iso-value with the sequence of tests, by cross-validation over sources
	$(BIN)/python tests/bench/level_score.py

bench-threshold: setup-dev ## Compare the adaptive threshold with Otsu's and Li's on the head phantom
	$(BIN)/python tests/bench/threshold.py

bench-tissue: setup-dev ## Compare tissue classes with multi-Otsu on the head phantom  (ARGS=--publish: for the docs)
	$(WITH_ARGS) $(BIN)/python tests/bench/tissue.py ARGS

# The other programs that benchmarks compare with have folders of their own. Benchmarks report which are
# missing.
PEERS := out/bench-peers
ZMESH = test -d $(PEERS)/python || { mkdir -p $(PEERS) && $(BIN)/uv pip install --quiet --no-deps \
  --python $(BIN)/python --target $(PEERS)/python zmesh==1.15.0; } || rm -rf $(PEERS)/python
GLTFPACK = test -d $(PEERS)/node_modules || { mkdir -p $(PEERS) \
  && npm install --silent --prefix $(PEERS) gltfpack@1.3.0; } || rm -rf $(PEERS)/node_modules
bench-unit: setup-dev ## Time a whole unit, and meshes of the same solids by the paper's chain, VTK, gltfpack and zmesh
	@$(ZMESH)
	@$(GLTFPACK)
	PYTHONPATH=$(PEERS)/python GLTFPACK=$(PEERS)/node_modules/.bin $(BIN)/python tests/bench/unit.py

bench-cells: setup-dev ## Compare closed surfaces of touching cells with zmesh's  (ARGS=--large: about 1500 cells)
	@$(ZMESH)
	PYTHONPATH=$(PEERS)/python $(WITH_ARGS) $(BIN)/python tests/bench/cells.py out/bench-cells ARGS

bench-wrap: setup-dev ## Compare closing holes on voxels with the first paper's chain on triangles (needs CGAL and g++)
	$(BIN)/python tests/bench/wrap.py

bench-serve: setup-dev ## Measure the tree of bricks, picture quality by bytes loaded, and 50 clients for a minute
	$(BIN)/python tests/bench/brick_curve.py
	$(BIN)/python tests/bench/serve_load.py

BENCH_VIEWER := tests/bench/viewer
bench-viewer: $(DEV_READY) ## Compare the ray march with vtk.js, NiiVue, three's example and a float64 reference  (ARGS=--full-mri)
	@if ! command -v npm >/dev/null; then echo "bench-viewer: skipped: no node and npm"; \
	elif [ -z "$$CHROMIUM" ]; then echo "bench-viewer: skipped: no Chromium: make browser, or set CHROMIUM"; \
	else \
	  cd $(BENCH_VIEWER) && { test node_modules/.ready -nt package-lock.json \
	    || { npm ci --ignore-scripts --no-audit --no-fund --loglevel=error && touch node_modules/.ready; }; } \
	  && cd "$$OLDPWD" && $(WITH_ARGS) $(BIN)/python $(BENCH_VIEWER)/bench.py out/bench-viewer ARGS; \
	fi

bench-fps: setup-dev ## Measure frames per second, mono and stereo, and CPU time on the split screen  (ARGS="--beside /other/viewer_gltf/dist")
	@mkdir -p out/samples
	test -e out/samples/head-512.ome.tif || $(BIN)/python tests/bench/fps_volume.py out/samples/head-512.ome.tif 512
	$(RUN) build out/samples/head-512.ome.tif --out=out/head-512 --workers="$$WORKERS" --preset mri --grid 1x1
	@if [ -z "$$CHROMIUM" ]; then echo "bench-fps: skipped: no Chromium: make browser, or set CHROMIUM"; \
	else out="$$PWD/out" && cd $(VIEWER) && "../$(BIN)/python" ../pipeline/with_args.py \
	  npm run --silent bench-fps -- "$$out/bench-fps" "$$out/head-512/bundle" ARGS; fi

wheel: setup out/wheel/constraints.txt ## Make a wheel and a source distribution that contain the built viewer: out/wheel
	$(BIN)/hatchling build -t wheel -t sdist -d out/wheel

# The versions that the tests run with, for `pip install --constraint`. Hashes are left out, because pip
# would then require a hash of the wheel as well.
out/wheel/constraints.txt: requirements.lock requirements-dev.lock
	@mkdir -p $(@D)
	sed -n '/^[A-Za-z0-9]/s/ *\\$$//p' $^ > $@

docs: $(DEV_READY) $(if $(DRAW),docs-pictures) ## Make the documentation as a site: out/docs (DRAW=1 draws its pictures again)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

# Chromium draws the pages of three samples; the command draws the pictures of wrong and right iso-values
docs-pictures: setup-dev browser
	$(MAKE) demo OUT=out/demo
	$(MAKE) demo SAMPLE=cells OUT=out/cells
	$(MAKE) demo SAMPLE=mri OUT=out/mri-demo
	cd $(VIEWER) && npm run --silent docs-pictures -- ../out
	$(BIN)/python docs/iso_value_pictures.py out/samples/cycif.ome.zarr out/iso-values

notebook: setup-dev ## Run docs/jupyter.ipynb and store it with its pictures
	$(BIN)/python docs/run_jupyter.py

# The versions are chosen for users and developers at once. The second file has the packages that are not
# in the first.
LOCK := uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
  --no-emit-index-url --no-header --no-annotate pyproject.toml
lock: setup ## Write requirements.lock and requirements-dev.lock again from pyproject.toml
	@mkdir -p out
	$(BIN)/$(LOCK) --upgrade --group dev -o out/all.lock
	$(BIN)/$(LOCK) --upgrade --group setup --constraints out/all.lock -o requirements.lock
	awk 'NR == FNR { has[$$0]; next } /^[^ ]/ { new = !($$0 in has) } new' requirements.lock out/all.lock \
	  > requirements-dev.lock

platforms: setup-dev ## Resolve the requirements for each system and Python, and write the table of docs/systems.md
	$(BIN)/python docs/platforms.py

licences: $(DEV_READY) ## Write docs/licences.md from the packages that are installed
	$(BIN)/python docs/licences.py

format-table: $(DEV_READY) ## Write the table of formats in docs/input-formats.md from the formats' rows
	$(BIN)/python docs/format_table.py

benchmarks: $(DEV_READY) ## Write docs/benchmarks.md from the figures in tests/bench/figures
	$(BIN)/python docs/benchmarks.py

clean: ## Remove .venv, the viewer's packages and build, and caches; builds in out/ stay
	rm -rf .venv .venv-* $(VIEWER)/node_modules $(VIEWER)/dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
