#!/bin/sh
# Memory and time of MUMPS on the blade's stiffness: by ranks of MPI, with factors out of core, with
# block low rank (BLR), and with the Schur complement on the flanks:
#
#     benches/beyond/mumps.sh MESH...
#
# MESH: meshes of geometry/dovetail.geo (docs/geometry.md has the parameters). numpy and scipy are in
# target/venv. MUMPS and Open MPI are installed by apt (Debian) where they are missing. Memory is
# that of MUMPS in 10^6 bytes, of the largest rank (INFOG(21)) and of all (INFOG(22)). Entries are in
# millions. Matrices are kept in target/beyond.
set -eu
cd "$(dirname "$0")/../.."
[ $# -gt 0 ] || { sed -n '2,10s/^# \{0,1\}//p' "$0"; exit 1; }
work=target/beyond
mkdir -p $work
if ! command -v mpicc > /dev/null || ! [ -e /usr/include/dmumps_c.h ] || ! [ -e /usr/lib/*/libdmumps.so ]; then
    apt-get install -y --no-install-recommends libmumps-dev libopenmpi-dev openmpi-bin libopenblas0-pthread
fi
mpicc -O2 benches/beyond/mumps.c -o $work/mumps -ldmumps -lm
# OpenBLAS 0.3.21 takes some processors for the oldest of all.
if grep -q avx512f /proc/cpuinfo; then export OPENBLAS_CORETYPE=SkylakeX; fi
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 MUMPS_OOC_TMPDIR=$PWD/$work
mpirun="mpirun --allow-run-as-root --oversubscribe --bind-to none --mca btl_base_warn_component_unused 0"
python3 scripts/origin.py
echo
echo "| unknowns | ranks | settings | factor, s | by the clock | entries | stored | MB, a rank | MB, all | error |"
echo "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
for mesh in "$@"; do
    name=$(basename "$mesh" .msh)
    for part in "" flanks; do
        matrix=$PWD/$work/$name$part.matrix
        [ -e "$matrix" ] || target/venv/bin/python benches/beyond/blade_matrix.py "$mesh" "$matrix" $part > "$matrix.log"
    done
    matrix=$PWD/$work/$name.matrix
    flanks=$(sed -n 's/.* \([0-9]*\) of the flanks.*/\1/p' "$PWD/$work/${name}flanks.matrix.log")
    for ranks in 1 2; do
        $mpirun -n $ranks $work/mumps "$matrix"
        $mpirun -n $ranks $work/mumps "$PWD/$work/${name}flanks.matrix" schur="$flanks"
    done
    $mpirun -n 1 $work/mumps "$matrix" i22=1
    for tolerance in 1e-10 1e-8 1e-6 1e-4; do $mpirun -n 1 $work/mumps "$matrix" i35=2 c7=$tolerance; done
done
