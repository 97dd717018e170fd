# luxmap: `make demo` shows what it does, `make test` whether it is right, `make bench` how fast it is.
.PHONY: setup build demo test bench check-exr clean

# Embree 4 and libclang; does nothing once they are there.
setup:
	@scripts/setup.sh

build: setup
	cargo build --release

demo: build
	target/release/luxmap render scenes/seed-office.toml

test: setup
	cargo fmt --check
	cargo clippy --all-targets -- -D warnings
	cargo test

bench: setup
	cargo bench

# Reads the demo's EXR files with OpenEXR's own library, from PyPI.
check-exr: demo
	python3 -m venv target/openexr && target/openexr/bin/pip install --quiet OpenEXR numpy
	target/openexr/bin/python scripts/check_exr.py out/seed-office

clean:
	cargo clean
