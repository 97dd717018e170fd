#!/usr/bin/env bash
# All that has to pass (`make test`): form, lints, documentation, fuzz targets, the tests, those of MPI and of the live page.
# What a machine can't do is left out, and said so. Each step says its seconds; at the end stand the slowest tests.
#
# `scripts/test.sh mpi` and `scripts/test.sh live` run one group of tests alone.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

export CARGO_TERM_COLOR=never # what is printed is read again, below
only=${1:-}
mkdir -p target
log=target/test.log
: >"$log"
seconds=()
left_out=()

# step NAME COMMAND...: runs a command and keeps what it prints and how long it took.
step() {
    local name=$1 start=$SECONDS
    shift
    echo "== $name: $*"
    "$@" 2>&1 | tee -a "$log"
    seconds+=("$(printf '%5d s  %s' $((SECONDS - start)) "$name")")
}

leave_out() {
    echo "== $*"
    left_out+=("$*")
}

# At the end, whatever it is: the slowest tests, the seconds of each step, what was left out, and how the tests ended.
summary() {
    if grep -q '^ *PASS \[' "$log"; then
        echo "== slowest tests"
        sed -n 's/^ *PASS \[ *\([0-9.]*\)s\] *\(([^)]*)\)\? *\(.*\)/\1 \3/p' "$log" | sort -rn | head -10 |
            while read -r time name; do printf '%7.1f s  %s\n' "$time" "$name"; done
    fi
    echo "== seconds"
    printf '%s\n' "${seconds[@]}" "$(printf '%5d s  in all' $SECONDS)"
    if [[ ${#left_out[@]} -gt 0 ]]; then printf 'left out: %s\n' "${left_out[@]}"; fi
    echo "== results"
    grep -E '^test result: |^ *Summary \[' "$log" || true
}
trap summary EXIT

# Whether scripts/setup.sh finds or installs something; false where only root could install it.
is_there() {
    local status=0
    scripts/setup.sh "$1" || status=$?
    [[ $status -eq 0 || $status -eq 77 ]] || exit 1
    [[ $status -eq 0 ]]
}

# One set of features for all that follows, so that nothing is compiled twice.
features=()
if is_there mpi; then features=(--features mpi); else leave_out "MPI is not tested"; fi
live=false
if [[ $only != mpi ]]; then
    if is_there chromium; then live=true; else leave_out "the live page is not tested in a browser"; fi
fi

# Both runners run the same tests; cargo-nextest tells how long each takes.
if cargo nextest --version >/dev/null 2>&1; then
    run_tests() { cargo nextest run "${features[@]}"; }
    run_group() { cargo nextest run "${features[@]}" --test it -E "test(/^$1::/)"; }
    run_ignored() { cargo nextest run "${features[@]}" --test it --run-ignored only -E "test(/^$1::/)"; }
else
    run_tests() { cargo test "${features[@]}" --no-fail-fast --lib --test it; }
    run_group() { cargo test "${features[@]}" --test it -- "$1::"; }
    run_ignored() { cargo test "${features[@]}" --test it -- --ignored "$1::"; }
fi

case $only in
mpi) if [[ ${#features[@]} -gt 0 ]]; then step "MPI" run_group mpi; fi ;;
live) if $live; then step "live page" run_ignored live; fi ;;
"")
    step "form" cargo fmt --check
    step "lints" cargo clippy --all-targets "${features[@]}" -- -D warnings
    if [[ ${#features[@]} -gt 0 ]]; then step "without MPI" cargo check; fi
    step "documentation" env RUSTDOCFLAGS="-D warnings" cargo doc --no-deps "${features[@]}"
    # libFuzzer itself, in C++, is not compiled: nothing is linked here.
    host=$(rustc -vV | sed -n 's/^host: //p')
    if cargo fetch --offline --locked --target "$host" --manifest-path fuzz/Cargo.toml 2>/dev/null; then
        step "fuzz targets" env CUSTOM_LIBFUZZER_PATH="$PWD/target/libfuzzer.a" \
            cargo check --offline --locked --manifest-path fuzz/Cargo.toml --target-dir target
    else
        leave_out "fuzz targets are not checked: their packages are not at hand"
    fi
    msrv=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
    if rustup run "$msrv" rustc --version >/dev/null 2>&1; then
        step "Rust $msrv" rustup run "$msrv" cargo check --target-dir "target/rust-$msrv"
    else
        leave_out "Rust $msrv, the oldest that luxmap asks for, is not tested: it is not installed"
    fi
    step "compile tests" cargo test "${features[@]}" --no-run --lib --examples --test it
    step "tests" run_tests
    step "doc tests" cargo test "${features[@]}" --doc
    if $live; then step "live page" run_ignored live; fi
    ;;
*) echo "test.sh: found $only, expected mpi, live or nothing" >&2 && exit 2 ;;
esac
