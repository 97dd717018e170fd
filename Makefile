# luxmap: `make demo` shows what it does, `make test` whether it is right, `make bench` how fast it is.
.PHONY: setup build demo test test-mpi test-live bench honesty check check-exr check-blender clean

# Embree 4 and a C linker; does nothing once they are there.
setup:
	@scripts/setup.sh

build: setup
	cargo build --release

demo: build
	target/release/luxmap render scenes/seed-office.toml

# All that has to pass: see scripts/test.sh.
test: setup
	@scripts/test.sh

# Passes spread over MPI processes. Left out, and said so, where OpenMPI is missing and only root could install it.
test-mpi: setup
	@scripts/test.sh mpi

# The live page in headless Chromium. Left out, and said so, where Chromium is missing and only root could install it.
test-live: setup
	@scripts/test.sh live

# Stiff and extreme cases against their exact answers, in some minutes; writes STABILITY.md and STABILITY.csv.
check: build
	target/release/luxmap check -o STABILITY.md

bench: setup
	cargo bench --bench stages --bench loading --bench large --bench trees

# Are the standard errors true? 200 seeds of five rooms, some 20 minutes on two cores; writes docs/HONESTY.md.
honesty: setup
	cargo bench --bench honesty

# Reads the EXR files of the demo and of two cameras, one in colour, with OpenEXR's own library, from PyPI.
check-exr: demo out/box-view/view.exr
	python3 -m venv target/openexr && target/openexr/bin/pip install --quiet OpenEXR numpy
	target/openexr/bin/python scripts/check_exr.py out/seed-office out/box-view out/seed-office-view

out/box-view/view.exr out/seed-office-view/view.exr: build
	target/release/luxmap render --passes 1 scenes/$(notdir $(patsubst %/,%,$(dir $@))).toml

# Finds every layer of an image in Blender's compositor: in an installed Blender, or in PyPI's bpy where pip has one for this
# Python (some 370 MB). Optional: says so and goes on where there is neither.
check-blender: out/seed-office-view/view.exr out/box-view/view.exr
	@scripts/check_blender.sh $^

clean:
	cargo clean
