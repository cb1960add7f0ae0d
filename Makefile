# The commands that one types. `make demo` and `make test` install missing packages, so that either is the first command on a fresh
# Debian or Ubuntu with Rust on it; elsewhere they print the command to type. The work itself is in scripts/.

DEMO_SCENE ?= assets/hall.toml
DEMO_IMAGE ?= hall.png
# A program that is there already, which `make demo` then takes; without it, it builds one.
AFTERLIGHT ?=

# Tells the build the checkout's commit, for `afterlight --version`. Another commit compiles the program anew, but none of the libraries. A folder that is no
# checkout has none, whatever repository it lies in.
WITH_COMMIT = if [ -z "$$AFTERLIGHT_COMMIT" ] && git ls-files --error-unmatch Makefile >/dev/null 2>&1; then \
	export AFTERLIGHT_COMMIT="$$(git rev-parse HEAD)$$(git diff --quiet HEAD || echo ' and changes that are in no commit')"; fi;

.DEFAULT_GOAL := help
.PHONY: help demo test test-all test-swiftshader check cross-check bless book package setup

help: ## Print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-16s %s\n", $$1, $$2}' Makefile

demo: ## Set up, build, render DEMO_SCENE into DEMO_IMAGE and print its table
	@scripts/setup demo
ifeq ($(AFTERLIGHT),)
	@cargo fetch --locked || { echo "demo: crates could not be fetched: the first build needs the network" >&2; exit 1; }
	@$(WITH_COMMIT) set -x; cargo build --release --locked
	@$(WITH_COMMIT) set -x; cargo run --release --quiet -- render $(DEMO_SCENE) -o $(DEMO_IMAGE) --verbose
else
	$(AFTERLIGHT) render $(DEMO_SCENE) -o $(DEMO_IMAGE) --verbose
endif

test: ## Set up, lint, and run the tests: on the machine's own Vulkan stack, and on Debian 13's what only that one sees
	@scripts/setup test
	@cargo fmt --all --check
	@scripts/test

test-all: ## The same with every case of every test, on all stacks: also Debian unstable's, and SwiftShader (hours)
	@scripts/setup test
	@cargo fmt --all --check
	@scripts/test all

test-swiftshader: ## Draw the tests again on SwiftShader, a second software driver
	@scripts/setup test
	@scripts/test swiftshader

check: ## Format and lints alone, warnings as errors
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --features afterlight-cli/hot-reload -- -D warnings
	cargo clippy --package afterlight --no-default-features --example triangle -- -D warnings

cross-check: ## Ask Mitsuba 3 (from PyPI, into .cache) for the reference renderer's pictures; a few minutes
	cargo build --release
	python3 -m venv .cache/mitsuba
	.cache/mitsuba/bin/pip install --quiet --requirement tests/mitsuba/requirements.txt
	.cache/mitsuba/bin/python tests/mitsuba/cross_check.py --prove

bless: ## Render the golden images anew and keep those that have changed (look at the diff before committing)
	@scripts/setup test
	@AFTERLIGHT_BLESS=1 AFTERLIGHT_TESTS=all scripts/test machine draw golden::

book: ## Make the book's listings, pictures, tables and numbers anew, and build its pages into target/book
	@scripts/setup test
	@AFTERLIGHT_BLESS=1 scripts/test machine book text::
	@AFTERLIGHT_BLESS=1 AFTERLIGHT_TESTS=all scripts/test machine book sessions:: patches::every_patch_is_built
	@scripts/book

package: ## Make crates, a tarball and a Debian package of the program in target/package (some minutes)
	@scripts/setup demo
	@scripts/package

setup: ## Install what is missing, and unpack Debian 13's Vulkan stack into .cache
	@scripts/setup test
	@scripts/fetch-debian13
