# luxmap: `make demo` shows what it does, `make test` whether it is right, `make bench` how fast it is.
.PHONY: setup build demo test bench clean

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

clean:
	cargo clean
