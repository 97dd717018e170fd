"""What the comparison needs on a bare Debian machine, all of it inside one folder that git ignores.

The tools come from PyPI into a virtual environment: `pyradiance` carries Radiance's own binaries, `mitsuba` Mitsuba 3.
Mitsuba compiles its kernels with the system's LLVM, which must be 17 or newer (15 stops with "Cannot select:
fmaximum"); if there is none, Debian's package is unpacked beside the environment. Nothing is installed on the system.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
HOME = PROJECT / "target" / "rivals"

PINNED = {"pyradiance": "1.3.1", "mitsuba": "3.9.1", "drjit": "1.5.0", "numpy": "2.4.6"}

OLDEST_LLVM, LLVM_PACKAGE = 17, "libllvm19"  # both Debian 12 and 13 have this one
LIBRARIES = Path("/usr/lib") / f"{os.uname().machine}-linux-gnu"


def say(text: str) -> None:
    print(f"rivals: {text}", file=sys.stderr, flush=True)


def enter() -> None:
    """Goes on in the virtual environment, which is made first if need be."""
    folder = HOME / "venv"
    if Path(sys.prefix) == folder:
        return
    python, stamp = folder / "bin" / "python", folder / "pinned"
    wanted = " ".join(f"{name}=={version}" for name, version in PINNED.items())
    if not stamp.exists() or stamp.read_text() != wanted:
        say(f"setting up {folder} (about 330 MB)")
        shutil.rmtree(folder, ignore_errors=True)
        try:
            venv.create(folder, with_pip=True)
        except (subprocess.CalledProcessError, SystemExit):
            sys.exit("rivals: Python came without ensurepip; please have root run: apt-get install python3-venv")
        subprocess.run([python, "-m", "pip", "install", "--quiet", *wanted.split()], check=True)
        stamp.write_text(wanted)
    os.execv(python, [str(python), *sys.argv])


def llvm() -> tuple[dict[str, str], str]:
    """Environment variables that show Mitsuba an LLVM it can work with, and its version."""
    private = HOME / "llvm" / LIBRARIES.relative_to("/")
    for folder in (LIBRARIES, private):
        found = newest_llvm(folder)
        if found:
            library, version = found
            variables = {"DRJIT_LIBLLVM_PATH": str(library)}
            if folder == LIBRARIES:
                return variables, f"{version} (the system's)"
            return variables | {"LD_LIBRARY_PATH": str(folder)}, f"{version} (Debian's, in target/rivals)"
    say(f"no LLVM {OLDEST_LLVM} or newer here: unpacking Debian's {LLVM_PACKAGE} into {HOME / 'llvm'}")
    unpack_llvm(HOME / "llvm")
    if not newest_llvm(private):
        sys.exit(f"rivals: {LLVM_PACKAGE} came without a library in {private}")
    return llvm()


def newest_llvm(folder: Path) -> tuple[Path, int] | None:
    """The newest LLVM library in a folder, unless it is too old."""
    pattern = re.compile(r"libLLVM(?:-(\d+))?\.so(?:\.(\d+))?.*")
    matches = ((path, pattern.fullmatch(path.name)) for path in folder.glob("libLLVM*.so*"))
    versions = [(int(match[1] or match[2] or 0), path) for path, match in matches if match]
    version, path = max(versions, default=(0, folder))
    return (path, version) if version >= OLDEST_LLVM else None


def unpack_llvm(target: Path) -> None:
    """Fetches LLVM and what it links to with apt, signatures checked, and unpacks them; apt's own state is left alone."""
    if not shutil.which("apt-get"):
        sys.exit(f"rivals: Mitsuba needs LLVM {OLDEST_LLVM} or newer in {LIBRARIES}; please install it")
    work = HOME / "apt"
    shutil.rmtree(work, ignore_errors=True)
    for folder in ("lists/partial", "cache/archives/partial", "root"):
        (work / folder).mkdir(parents=True)
    # With an empty status file apt thinks that nothing is installed, and names every library LLVM needs.
    options = ["APT::Sandbox::User=", "Debug::NoLocking=1", "Acquire::Languages=none", "Dir::State::Status=/dev/null"]
    options += [f"Dir::Cache={work}/cache", f"Dir::State::Lists={work}/lists"]
    apt = ["apt-get", "-q", *(word for option in options for word in ("-o", option))]
    subprocess.run([*apt, "update"], check=True, stdout=sys.stderr)
    plan = subprocess.run(
        [*apt, "--simulate", "--no-install-recommends", "install", LLVM_PACKAGE],
        check=True, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"},
    )  # fmt: skip
    packages = re.findall(r"^Inst (\S+)", plan.stdout, re.MULTILINE)
    everywhere = re.compile(r"libc6|libgcc-s1|libstdc\+\+6|gcc-\d+-base")  # apt itself needs them
    packages = [name for name in packages if not everywhere.fullmatch(name)]
    subprocess.run([*apt, "download", *packages], check=True, cwd=work, stdout=sys.stderr)
    for package in work.glob("*.deb"):
        subprocess.run(["dpkg", "-x", package, work / "root"], check=True)
    shutil.rmtree(target, ignore_errors=True)
    (work / "root").rename(target)
    shutil.rmtree(work)
