# Every target installs what it needs and is missing (with sudo when not root).
SHELL := /bin/bash
CARGO ?= cargo
BUILD := target/release
PLUGINS := $(BUILD)/gdalplugins
PLUGIN := $(PLUGINS)/ogr_MESHMARK.so
PREFIX ?= /usr/local
# GDAL's own plugin folder, where every program finds the driver without a variable.
GDAL_PLUGIN_DIR ?= $(shell pkg-config --variable=libdir gdal 2>/dev/null || echo $(PREFIX)/lib)/gdalplugins
# The crate gdal-sys knows the C interface of GDAL up to 3.12, and that of later ones has all of it.
WITH_GDAL = $(shell pkg-config --modversion gdal 2>/dev/null | awk -F . '$$2 > 12 { print "GDAL_VERSION=3.12.0" }')
# What the studies below run on; name your own with MAPS="a.gpkg folder".
BENCH_MAPS := $(wildcard ../shared/maps/dev/jp_tokyo_nerima.gpkg ../shared/maps/large/kz_astana_city.gpkg \
	../shared/maps/large/jp_tokyo_adachi_6km.gpkg)
# Also so many copies of the last of BENCH_MAPS side by side: 2.8 and 10 million vertices.
BENCH_TILES ?= 4,14
WHEEL_PYTHON := target/wheel/python/bin/python
BENCH_PYTHON := target/bench-python/bin/python
STUDY_MAPS := $(filter-out %_2km.gpkg,$(wildcard ../shared/maps/dev/*.gpkg))
QGIS_ZIP ?= target/meshmark-qgis.zip
FIXTURES := fixtures/helsinki.gpkg fixtures/kotka.gpkg

.PHONY: build test test-studies demo bench table2 coalitions false-alarms calibration validation faults \
	fuzz sanitizers quality conformance hosts newcomer qgis plugin-for-wheel wheel deb install \
	uninstall fixtures deps lint

build: deps
	$(WITH_GDAL) $(CARGO) build --release --locked -p meshmark-plugin -p meshmark-verifier
	mkdir -p $(PLUGINS)
	install -m 755 $(BUILD)/libmeshmark_plugin.so $(PLUGIN)

# They compile neither plots nor benchmarks. openssl is the time-stamping authority.
test: build
	@./install-deps.sh openssl
	RUST_TEST_THREADS=$$(($$(nproc) * 2)) $(WITH_GDAL) $(CARGO) test --release --locked --no-fail-fast

# What the studies make of their own figures.
test-studies: build
	$(WITH_GDAL) $(CARGO) test --release --locked -p meshmark-studies

demo: build
	GDAL_DRIVER_PATH=$(CURDIR)/$(PLUGINS) ./demo.sh $(BUILD)/meshmark fixtures/helsinki.gpkg

# About half an hour for the maps of docs/performance.md.
bench: build $(BENCH_PYTHON)
	$(WITH_GDAL) $(CARGO) build --release --locked -p meshmark-benches
	$(BUILD)/bench --out target/bench --tiles $(BENCH_TILES) --script $(BENCH_PYTHON) benches/peers/mesh_spectral.py \
		$(or $(MAPS),$(BENCH_MAPS),$(FIXTURES))
	$(WITH_GDAL) $(CARGO) bench --locked -p meshmark-benches --bench kernels

$(BENCH_PYTHON): benches/peers/requirements.txt
	./install-deps.sh python3-venv libopenblas-dev
	python3 -m venv target/bench-python
	$(BENCH_PYTHON) -m pip install --quiet -r $<
	touch $@

# The paper's Table 2 and more, on maps in metres; about an hour for the nine maps of
# docs/evaluation.md.
table2: build
	$(WITH_GDAL) $(CARGO) build --release --locked -p meshmark-studies --bin table2
	$(BUILD)/table2 --out target/table2 $(or $(MAPS),$(STUDY_MAPS),$(FIXTURES))

# What marking does to shape and topology, with every SHAPE and BASIS; fails when anything became
# invalid.
quality: build
	$(WITH_GDAL) $(CARGO) build --release --locked -p meshmark-studies --bin quality
	$(BUILD)/quality $(or $(MAPS),$(wildcard ../shared/maps/dev/*.gpkg ../shared/maps/variety/*.gpkg),$(FIXTURES))

# Who is named when recipients mix their copies; about an hour for the nine maps of docs/security.md.
coalitions: build
	$(WITH_GDAL) $(CARGO) build --release --locked -p meshmark-studies --bin coalitions
	$(BUILD)/coalitions --out target/coalitions $(or $(MAPS),$(STUDY_MAPS),$(FIXTURES))

# p-values of wrong keys and wrong recipients.
false-alarms: build
	$(WITH_GDAL) $(CARGO) build --release --locked -p meshmark-studies --bin false_alarms --bin misses
	$(BUILD)/false_alarms --out target/false_alarms $(or $(MAPS),$(STUDY_MAPS),$(FIXTURES))
	$(BUILD)/misses --out target/misses $(or $(MAPS),$(STUDY_MAPS),$(FIXTURES))

# Likelihood ratios of damaged copies, of other recipients and of wrong keys; about half an hour for
# the three maps of docs/evaluation.md.
calibration: build
	$(WITH_GDAL) $(CARGO) build --release --locked -p meshmark-studies --bin calibration
	$(BUILD)/calibration --out target/calibration $(or $(MAPS),$(STUDY_MAPS),$(FIXTURES))

# docs/validation.md from all studies of errors; some hours for the nine maps, see the sizes in
# studies/validation.sh.
validation: build
	$(WITH_GDAL) $(CARGO) build --release --locked -p meshmark-studies --bin false_alarms --bin misses \
		--bin calibration --bin coalitions
	studies/validation.sh $(BUILD) target/validation $(or $(MAPS),$(STUDY_MAPS),$(FIXTURES))

# Kills and full disks while marked maps are written, more of them than in the tests.
faults: build
	$(WITH_GDAL) $(CARGO) build --release --locked -p meshmark-host-tests --bin faults
	$(BUILD)/faults

# Every fuzz target for so long, side by side: make fuzz SECONDS=600 TARGETS="key record".
fuzz: build
	$(WITH_GDAL) CARGO=$(CARGO) fuzz/run.sh $(or $(SECONDS),60) $(TARGETS)

# The driver under AddressSanitizer, UndefinedBehaviorSanitizer and valgrind.
sanitizers: build
	$(WITH_GDAL) CARGO=$(CARGO) host-tests/sanitizers.sh

conformance: build
	host-tests/conformance/run.sh

# A PostGIS of its own, started and stopped, Python, QGIS with and without the driver, a browser that
# reads reports, the GDAL of pyogrio's wheel and one that is compiled, a notebook, Debian 13 with its
# GDAL and QGIS, the examples, the package in a clean Debian; installs what they need. Takes an hour
# and a half the first time.
hosts: build plugin-for-wheel wheel
	host-tests/hosts/postgis.sh
	host-tests/hosts/python.sh
	host-tests/hosts/qgis.sh
	host-tests/hosts/qgis_plugin.sh
	host-tests/hosts/qgis_without_driver.sh
	host-tests/hosts/chromium.sh
	host-tests/hosts/wheel.sh
	host-tests/hosts/notebook.sh
	host-tests/hosts/wheels.sh
	host-tests/hosts/gdal_3_12.sh
	host-tests/hosts/debian.sh trixie
	host-tests/hosts/examples.sh
	host-tests/hosts/deb.sh

# How long a newcomer waits: for `make demo` on a clean machine, for the first marked file, for a
# report.
newcomer:
	host-tests/newcomer.sh

# The zip for QGIS's plugin manager: the same bytes for the same sources.
qgis:
	@qgis/make_zip.py qgis/meshmark_qgis "$(QGIS_ZIP)"

fixtures:
	fixtures/make_fixtures.sh

# The driver for the GDAL 3.12 in the wheel of pyogrio; PYTHON= names a Python that has one.
ifeq ($(PYTHON),)
plugin-for-wheel: $(WHEEL_PYTHON)
endif
plugin-for-wheel: deps
	packaging/plugin_for_wheel.sh "$(or $(PYTHON),$(WHEEL_PYTHON))" target/wheel

$(WHEEL_PYTHON):
	./install-deps.sh python3-venv curl
	python3 -m venv target/wheel/python
	$@ -m pip install --quiet pyogrio==0.13.0 geopandas==1.1.1

# The Python wheel, and its tests in a clean environment; PYTHON= names another Python.
wheel: build
	./install-deps.sh python3-venv
	python/make_wheel.sh "$(or $(PYTHON),python3)" target/python

deb: export MESHMARK_COMMIT = $(shell git rev-parse HEAD 2>/dev/null)
deb: build
	./install-deps.sh dpkg-dev
	packaging/deb.sh $(BUILD) target/deb

install: build
	install -d "$(DESTDIR)$(GDAL_PLUGIN_DIR)" "$(DESTDIR)$(PREFIX)/bin"
	install -m 755 $(PLUGIN) "$(DESTDIR)$(GDAL_PLUGIN_DIR)/"
	install -m 755 $(BUILD)/meshmark "$(DESTDIR)$(PREFIX)/bin/"

uninstall:
	rm -f "$(DESTDIR)$(GDAL_PLUGIN_DIR)/ogr_MESHMARK.so" "$(DESTDIR)$(PREFIX)/bin/meshmark"

lint: deps
	$(CARGO) fmt --all -- --check
	$(WITH_GDAL) $(CARGO) clippy --release --locked --workspace --all-targets -- -D warnings
	$(WITH_GDAL) $(CARGO) test --release --locked --test architecture

deps:
	@./install-deps.sh
