# make demo     build, render scenes/demo.glb, print where the pictures are
# make test     all tests
# make bench    rays per second, and the share of a render spent inside Embree
# make figures  docs/results.md: all integrators on twenty-two scenes, two hours on two cores; see below
# make install  header, library, CLI, pkg-config and CMake files under PREFIX (and DESTDIR)
# Each first installs what is missing: scripts/setup.sh.

PREFIX  ?= /usr/local
DESTDIR ?=
VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
TARGET  := $(or $(CARGO_TARGET_DIR),target)
# A Rust that rustup put into the home directory is not always on the PATH.
export PATH := $(HOME)/.cargo/bin:$(PATH)

.PHONY: setup demo test bench figures install
.DEFAULT_GOAL := demo

setup:
	@scripts/setup.sh

demo: setup
	cargo build --release --locked --bin caustica
	@mkdir -p out
	$(TARGET)/release/caustica render scenes/demo.glb -o out/demo.png -o out/demo.exr --size 640x480 --time 40
	@echo "$(CURDIR)/out/demo.png"
	@echo "$(CURDIR)/out/demo.exr"

test: setup
	cargo test --locked

bench: setup
	cargo bench --locked --bench rays

# In pieces: FIGURES='eye water --no-knobs', or FIGURES='demo --only-knobs'; FIGURES=--help lists all options.
figures: setup
	cargo bench --locked --bench figures -- $(FIGURES)

install: setup
	cargo build --release --locked
	PREFIX='$(PREFIX)' DESTDIR='$(DESTDIR)' VERSION='$(VERSION)' BUILT='$(TARGET)/release' scripts/install.sh
