#!/usr/bin/env bash
# Makes ready what luxmap needs: Embree 4, which it loads when it runs, a C linker and make.
# A second run finds everything in place and does nothing. Works as root and, once a C linker is there, as a plain user.
# With the argument `mpi`: also OpenMPI and libclang, for the feature `mpi`; with `chromium`: also a browser for the tests of
# the live page. Exit code 77 where only root could install them.
set -euo pipefail
shopt -s nullglob
cd "$(dirname "${BASH_SOURCE[0]}")/.."

say() { echo "setup: $*" >&2; }
fail() { say "$*"; exit 1; }
has() { command -v "$1" >/dev/null; }
any() { local file; for file; do if [[ -e $file ]]; then return; fi; done; return 1; }
is_root() { [[ $EUID -eq 0 ]]; }
use_embree_dir="unpack an Embree 4.3 or 4.4 release and set EMBREE_DIR to the folder that holds its lib"
unreachable="no package source is reachable, and nothing was installed"

# --- what is there already -------------------------------------------------------------------------------------------

have_libclang() {
    local found=(/usr/lib/llvm*/lib/libclang{.so,-[0-9]}* /usr/lib/*-linux-gnu/libclang{.so,-[0-9]}*
        /usr/lib{,64}/libclang{.so,-[0-9]}* /usr/local/lib/libclang{.so,-[0-9]}*)
    [[ -e ${LIBCLANG_PATH:-} || ${#found[@]} -gt 0 ]]
}

# Where luxmap looks when it runs. `.embree` appears by one rename, so if it is there it is whole.
have_embree() {
    if [[ -n ${EMBREE_DIR:-} ]]; then
        any "$EMBREE_DIR"/{lib,lib64,lib/*-linux-gnu}/libembree4.so{,.4} ||
            fail "EMBREE_DIR is $EMBREE_DIR, but $EMBREE_DIR/lib/libembree4.so.4 is missing; $use_embree_dir"
    else
        any .embree/usr/lib/*-linux-gnu/libembree4.so.4 \
            /usr/{lib,lib64,lib/*-linux-gnu,local/lib,local/lib64}/libembree4.so.4
    fi
}

# Whether the second version is at least the first.
at_least() { [[ $(printf '%s\n' "$1" "$2" | sort -V | head -n 1) == "$1" ]]; }

# --- Debian's packages, for root -------------------------------------------------------------------------------------

# The version apt would install; nothing if it knows none.
candidate() { LC_ALL=C apt-cache policy "$1" | sed -n 's/^ *Candidate: \([^(]\)/\1/p'; }

# Fails, rather than warns, where a source can't be reached.
update=(apt-get -q -o APT::Update::Error-Mode=any -o Acquire::Retries=1 update)

# A fresh container has no package lists.
fetch_lists_if_none() {
    [[ -n $(apt-get indextargets 'Created-By: Packages') ]] || "${update[@]}" || fail "$unreachable; $use_embree_dir"
}

# apt fetches all packages before it installs the first.
install() {
    say "installing $*"
    fetch_lists_if_none
    local get=(env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$@")
    # Lists too old name packages that the mirror no longer has.
    "${get[@]}" || { "${update[@]}" && "${get[@]}"; } || fail "$* can't be installed; without Debian's packages, $use_embree_dir"
}

# --- a private Embree, for anybody -----------------------------------------------------------------------------------

# Debian 12 has only Embree 3, and a plain user can't install: take Debian 13's packages from the mirror this system
# already uses, signatures checked by apt, and unpack them beside the sources. apt's own state stays untouched.
unpack_private_embree() {
    local keyring=/usr/share/keyrings/debian-archive-keyring.gpg
    [[ -e $keyring ]] || fail "no Embree 4 among this system's packages; $use_embree_dir"

    local work
    work=$(mktemp -d "$PWD/.embree.XXXXXX")
    # shellcheck disable=SC2064  # expand now: `work` is gone when the trap runs
    trap "rm -rf '$work'" EXIT
    mkdir -p "$work"/{lists/partial,cache/archives/partial,root}
    local private=(-o Dir::State::Lists="$work/lists" -o Dir::Cache="$work/cache" -o Dir::State::Status=/dev/null
        -o Acquire::Languages=none -o APT::Sandbox::User= -o Debug::NoLocking=1 -q)

    local mirror
    mirror=$(debian_mirror)
    if [[ -z $mirror ]]; then # apt names a mirror only once it holds that mirror's lists
        "${update[@]}" "${private[@]}" >&2 || fail "$unreachable; $use_embree_dir"
        mirror=$(debian_mirror "${private[@]}")
    fi
    [[ -n $mirror ]] || fail "this system's apt knows no Debian mirror; $use_embree_dir"

    say "fetching Embree 4 of Debian 13 into .embree"
    echo "deb [signed-by=$keyring target=Packages] $mirror trixie main" >"$work/debian-13.list"
    private+=(-o Dir::Etc::SourceList="$work/debian-13.list" -o Dir::Etc::SourceParts=/dev/null
        -o Dir::Etc::Preferences=/dev/null -o Dir::Etc::PreferencesParts=/dev/null)
    "${update[@]}" "${private[@]}" >&2 || fail "$unreachable; $use_embree_dir"
    # The header is for a test, which holds what is written down of Embree's interface against it.
    (cd "$work" && apt-get "${private[@]}" download libembree-dev libembree4-4 libtbb12 >&2)
    local package
    for package in "$work"/*.deb; do dpkg -x "$package" "$work/root"; done
    any "$work"/root/usr/lib/*-linux-gnu/libembree4.so.4 || fail "Debian 13's libembree4-4 came without Embree 4"
    chmod 755 "$work/root"
    mv -T "$work/root" .embree
    touch build.rs # cargo asks it again: it looks for .embree
}

debian_mirror() {
    # shellcheck disable=SC2016  # $(REPO_URI) is apt's to fill in
    apt-get "$@" indextargets --format '$(REPO_URI)' \
        'Created-By: Packages' 'Origin: Debian' 'Label: Debian' 'Component: main' | sed -n 1p
}

# --- what is missing -------------------------------------------------------------------------------------------------

needed=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
rust=$(has cargo && rustc --version 2>/dev/null | cut -d ' ' -f 2) || true
at_least "$needed" "${rust:-0}" ||
    fail "Rust $needed or newer is needed, found ${rust:-none}: install it with rustup, or on Debian 13 by \"apt-get install cargo-web rustc-web\""
for tool in fmt clippy; do
    cargo "$tool" --version >/dev/null 2>&1 || say "cargo $tool is missing; only \"make test\" needs it"
done

missing=()
has cc || missing+=(gcc libc6-dev)
has make || missing+=(make)
if [[ ${#missing[@]} -gt 0 ]]; then
    has apt-get || fail "please install a C compiler and make; then run this again"
    is_root || fail "please have root run \"apt-get install ${missing[*]}\"; then run this again"
fi

# Embree first: where it can't be had, nothing else is installed.
if ! have_embree; then
    has apt-get || fail "Embree 4 is missing and this system has no apt; $use_embree_dir"
    if is_root; then fetch_lists_if_none; fi
    if is_root && [[ -n $(candidate libembree4-4) ]]; then
        missing+=(libembree4-4)
    else
        unpack_private_embree
    fi
fi
if [[ ${#missing[@]} -gt 0 ]]; then install "${missing[@]}"; fi

# The crate `mpi` reads MPI's header with libclang.
if [[ ${1:-} == mpi ]]; then
    missing=()
    { has mpicc && has mpirun; } || missing+=(libopenmpi-dev openmpi-bin)
    have_libclang || missing+=(libclang-dev)
    if [[ ${#missing[@]} -gt 0 ]]; then
        if has apt-get && is_root; then
            install "${missing[@]}"
        else
            say "please have root run \"apt-get install ${missing[*]}\"; or put another MPI's mpicc and mpirun on the PATH, and" \
                "set LIBCLANG_PATH to libclang's folder"
            exit 77
        fi
    fi
fi

have_chromium() { has "${CHROMIUM:-chromium}" || has chromium-browser || has google-chrome || has google-chrome-stable; }

if [[ ${1:-} == chromium ]] && ! have_chromium; then
    if has apt-get && is_root; then
        install chromium
    else
        say "please have root run \"apt-get install chromium\", or set CHROMIUM to the program of another Chromium"
        exit 77
    fi
fi
