# toile: every command that people and machines run.
#   make demo    build, compile a C host, drape a garment on a body, leave a picture and a model file
#   make test    the whole check, the same as on the build machine
#   make quick   unit tests only, under a minute once built
#   make bench   tables of speed and error; bench-yarn: those of yarns; bench-mixed: of mixed cloth
#   make fuzz    every fuzz target, FUZZ_SECONDS (20) each
#   make soak    the long random runs, fuzz targets included
#   make wheel   the Python package with the library as one file, in out/wheels
#   make header  write include/toile.h and tests/golden/abi.txt anew
#   make install PREFIX=/usr/local

CARGO  ?= cargo
CC     ?= cc
PREFIX ?= /usr/local
OUT    ?= out
LIB    := target/release/libtoile.so
PYTHON := target/venv/bin/python
export TOILE_PYTHON ?= $(abspath $(PYTHON))

.PHONY: all demo test quick bench bench-yarn bench-mixed fuzz soak header wheel install tools lint clean

all:
	$(CARGO) build --release

demo: all
	@mkdir -p $(OUT)/demo
	$(CC) -std=c11 -O2 -Wall -Wextra -Wpedantic -Iinclude examples_c/03_drape.c -o $(OUT)/demo/03_drape -Ltarget/release -ltoile -Wl,-rpath,$(abspath target/release) -lm
	target/release/toile mannequin $(OUT)/demo/mannequin.obj
	$(OUT)/demo/03_drape examples/tshirt.json $(OUT)/demo/mannequin.obj $(OUT)/demo/garment.obj
	target/release/toile picture $(OUT)/demo/garment.obj --body $(OUT)/demo/mannequin.obj --out $(OUT)/demo/picture.png
	@echo "picture: $(OUT)/demo/picture.png   model: $(OUT)/demo/garment.obj"

tools:
	@bash scripts/tools.sh

lint:
	$(CARGO) fmt --check
	$(CARGO) clippy --release --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --no-deps

test: tools lint
	$(CARGO) test --release

quick:
	$(CARGO) test --release --lib

bench: all
	$(CARGO) bench

bench-yarn: all
	$(CARGO) bench --bench yarn
	$(CARGO) bench --bench yarn_terms
	$(CARGO) bench --bench yarn_fabrics
	$(CARGO) bench --bench yarn_garment

bench-mixed: all
	$(CARGO) bench --bench mixed
	$(CARGO) bench --bench rings
	$(CARGO) bench --bench waves

fuzz:
	@bash scripts/fuzz.sh $(FUZZ_SECONDS)

soak: all
	@bash scripts/fuzz.sh $(or $(FUZZ_SECONDS),300)
	TOILE_SOAK=1 $(CARGO) test --release -- --include-ignored

header:
	TOILE_BLESS=1 $(CARGO) test --release --test suite -- header:: abi::

wheel:
	$(or $(wildcard $(PYTHON)),python3) -m pip wheel ./python --no-deps --wheel-dir $(OUT)/wheels

install: all
	bash scripts/install.sh "$(PREFIX)"

clean:
	$(CARGO) clean
	rm -rf $(OUT)
