#!/bin/sh
# Sparse Cholesky of dovetail, CHOLMOD and MUMPS on the same stiffness matrices, interleaved, in one run:
#
#     benches/solvers/compare.sh MESH...
#
# MESH: meshes of geometry/dovetail.geo (docs/geometry.md has the parameters). Debian: installs the peers by apt
# where they are missing. ROUNDS (3) and THREADS ("1 2") may be set; the table has the medians of processor seconds
# with one thread and of the wall clock with more, and the ratio of factor + solves to the best peer.
set -eu
cd "$(dirname "$0")/../.."
[ $# -gt 0 ] || { sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 1; }
work=target/solvers
mkdir -p $work
if ! [ -e /usr/include/suitesparse/cholmod.h ] && ! [ -e /usr/include/cholmod.h ] || ! [ -e /usr/include/dmumps_c.h ]; then
    apt-get install -y --no-install-recommends libsuitesparse-dev libmumps-seq-dev libopenblas0-pthread
fi
cc -O2 -I/usr/include/suitesparse -I/usr/include/mumps_seq benches/solvers/peers.c -o $work/peers \
    -lcholmod -ldmumps_seq -lm
# OpenBLAS 0.3.21 takes some processors for the oldest of all: an unfair peer.
if grep -q avx512f /proc/cpuinfo; then export OPENBLAS_CORETYPE=SkylakeX; fi
cargo bench --locked --no-run --bench solvers
own="cargo bench --locked --quiet --bench solvers --"
log=$work/log.txt
: > $log
for mesh in "$@"; do
    matrix=$work/$(basename "$mesh" .msh).matrix
    $own matrix "$(realpath "$mesh")" "$PWD/$matrix"
    for round in $(seq "${ROUNDS:-3}"); do
        for threads in ${THREADS:-1 2}; do
            export OPENBLAS_NUM_THREADS=$threads OMP_NUM_THREADS=$threads
            for program in dovetail cholmod mumps; do
                echo "= $program $threads $(basename "$mesh" .msh)" >> $log
                if [ $program = dovetail ]; then $own solve "$PWD/$matrix" "$threads"
                else $work/peers $program $matrix "$threads"; fi >> $log
            done
        done
    done
    rm $matrix
done
echo "load: $(cut -d' ' -f1-3 /proc/loadavg)"
python3 benches/solvers/table.py $log
