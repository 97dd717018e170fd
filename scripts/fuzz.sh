#!/bin/sh
# Fuzzes one kind of input, or all one after the other: `scripts/fuzz.sh [TARGET|all] [SECONDS]`; `build` builds only.
#
# Needs neither cargo-fuzz nor a nightly compiler: the readers are safe Rust, so that coverage alone guides libFuzzer, and
# what would be a fault of memory is a panic. `--target` keeps build scripts and macros free of coverage.
set -eu
cd "$(dirname "$0")/.."
target=${1:-all}
seconds=${2:-60}
all="scene obj mtl ies ldt gldf tm33 reference checkpoint"
case $target in all) ;; build) all="" ;; *) all=$target ;; esac

triple=$(rustc -vV | sed -n 's/^host: //p')
RUSTFLAGS="--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1 -Cdebug-assertions=on -Coverflow-checks=on" \
    CARGO_INCREMENTAL=0 cargo build --release --manifest-path fuzz/Cargo.toml --target "$triple" --target-dir fuzz/target

if [ -z "${TMPDIR:-}" ] && [ -d /dev/shm ]; then export TMPDIR=/dev/shm; fi
# One allocation of more than is allowed in all ends the program, touched or not.
ulimit -v 3000000
# Files of one kind that are at hand; the rest of them is made up by the target itself.
seeds() {
    case $1 in
    scene) find scenes tests/hostile/scene -name '*.toml' ;;
    obj | mtl | ies | ldt) find scenes tests/material tests/hostile/"$1" fuzz/corpus-seeds -name "*.$1" ;;
    gldf) find tests/hostile/gldf -type f ;;
    tm33) find tests/hostile/tm33 -type f ;;
    reference) find tests/reference tests/hostile/reference -name '*.csv' -o -name '*.exr' ;;
    checkpoint) find tests/hostile/checkpoint -type f ;;
    esac 2>/dev/null
}
for target in $all; do
    corpus=fuzz/corpus/$target
    mkdir -p "$corpus" "fuzz/artifacts/$target"
    seeds "$target" | while read -r file; do cp "$file" "$corpus/$(echo "$file" | tr '/ ' '__')"; done
    echo "fuzz: $target for $seconds s"
    LUXMAP_SEEDS=$corpus "fuzz/target/$triple/release/$target" -max_len=100000 -timeout="${FUZZ_TIMEOUT:-2}" \
        -rss_limit_mb=1024 -malloc_limit_mb=1024 -max_total_time="$seconds" -print_final_stats=1 \
        -dict="fuzz/dictionaries/$target" -artifact_prefix="fuzz/artifacts/$target/" "$corpus"
done
