#!/usr/bin/env bash
# Makes ready what build.rs needs: Embree 4, libclang (bindgen reads Embree's header with it) and a C linker.
# A second run finds everything in place and does nothing. Works as root and, once libclang is there, as a plain user.
# With the argument `mpi`: also OpenMPI, for the feature `mpi`; with `chromium`: also a browser for the tests of the live page.
# Exit code 77 where only root could install them.
set -euo pipefail
shopt -s nullglob
cd "$(dirname "${BASH_SOURCE[0]}")/.."

say() { echo "setup: $*" >&2; }
fail() { say "$*"; exit 1; }
has() { command -v "$1" >/dev/null; }
is_root() { [[ $EUID -eq 0 ]]; }
use_embree_dir="unpack an Embree 4 release and set EMBREE_DIR to the folder that holds its include and lib"

# --- what is there already -------------------------------------------------------------------------------------------

have_libclang() {
    local found=(/usr/lib/llvm*/lib/libclang{.so,-[0-9]}* /usr/lib/*-linux-gnu/libclang{.so,-[0-9]}*
        /usr/lib{,64}/libclang{.so,-[0-9]}* /usr/local/lib/libclang{.so,-[0-9]}*)
    [[ -e ${LIBCLANG_PATH:-} || ${#found[@]} -gt 0 ]]
}

# The order of build.rs. `.embree` appears by one rename, so if it is there it is whole.
have_embree() {
    if [[ -n ${EMBREE_DIR:-} ]]; then
        [[ -e $EMBREE_DIR/include/embree4/rtcore.h ]] ||
            fail "EMBREE_DIR is $EMBREE_DIR, but $EMBREE_DIR/include/embree4/rtcore.h is missing; $use_embree_dir"
    else
        [[ -e .embree/usr/include/embree4/rtcore.h || -e /usr/include/embree4/rtcore.h ||
            -e /usr/local/include/embree4/rtcore.h ]]
    fi
}

# --- Debian's packages, for root -------------------------------------------------------------------------------------

# The version apt would install; nothing if it knows none.
candidate() { LC_ALL=C apt-cache policy "$1" | sed -n 's/^ *Candidate: \([^(]\)/\1/p'; }

# A fresh container has no package lists.
fetch_lists_if_none() { [[ -n $(apt-get indextargets 'Created-By: Packages') ]] || apt-get update -q; }

install() {
    say "installing $*"
    fetch_lists_if_none
    local get=(env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$@")
    "${get[@]}" || { apt-get update -q && "${get[@]}"; } # lists too old name packages the mirror no longer has
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
        apt-get "${private[@]}" update >&2
        mirror=$(debian_mirror "${private[@]}")
    fi
    [[ -n $mirror ]] || fail "this system's apt knows no Debian mirror; $use_embree_dir"

    say "fetching Embree 4 of Debian 13 into .embree"
    echo "deb [signed-by=$keyring target=Packages] $mirror trixie main" >"$work/debian-13.list"
    private+=(-o Dir::Etc::SourceList="$work/debian-13.list" -o Dir::Etc::SourceParts=/dev/null
        -o Dir::Etc::Preferences=/dev/null -o Dir::Etc::PreferencesParts=/dev/null)
    apt-get "${private[@]}" update >&2
    (cd "$work" && apt-get "${private[@]}" download \
        libembree-dev libembree4-4 libtbb12 libc6 libstdc++6 libgcc-s1 >&2)
    local package
    for package in "$work"/*.deb; do dpkg -x "$package" "$work/root"; done
    [[ -e $work/root/usr/include/embree4/rtcore.h ]] || fail "Debian 13's libembree-dev came without Embree 4's header"
    chmod 755 "$work/root"
    mv -T "$work/root" .embree
}

debian_mirror() {
    # shellcheck disable=SC2016  # $(REPO_URI) is apt's to fill in
    apt-get "$@" indextargets --format '$(REPO_URI)' \
        'Created-By: Packages' 'Origin: Debian' 'Label: Debian' 'Component: main' | sed -n 1p
}

# --- what is missing -------------------------------------------------------------------------------------------------

has cargo || fail "cargo is missing: install Rust 1.89 or newer, for instance with rustup"

missing=()
has cc || missing+=(gcc libc6-dev)
has make || missing+=(make)
have_libclang || missing+=(libclang-dev)
if [[ ${#missing[@]} -gt 0 ]]; then
    has apt-get || fail "please install a C compiler, make and libclang; then run this again"
    is_root || fail "please have root run \"apt-get install ${missing[*]}\" (or, for libclang, set LIBCLANG_PATH to its folder); then run this again"
    install "${missing[@]}"
fi

if ! have_embree; then
    has apt-get || fail "Embree 4 is missing and this system has no apt; $use_embree_dir"
    if is_root; then fetch_lists_if_none; fi
    version=$(candidate libembree-dev)
    if is_root && [[ -n $version ]] && dpkg --compare-versions "$version" ge 4; then
        install libembree-dev
    else
        unpack_private_embree
    fi
fi

if [[ ${1:-} == mpi ]] && ! { has mpicc && has mpirun; }; then
    if has apt-get && is_root; then
        install libopenmpi-dev openmpi-bin
    else
        say "please have root run \"apt-get install libopenmpi-dev openmpi-bin\", or put another MPI's mpicc and mpirun on the PATH"
        exit 77
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
