#!/bin/sh
# Sparse Cholesky, inertia and modes of dovetail and its peers on the same matrices, interleaved, in
# one run:
#
#     benches/solvers/compare.sh MESH...
#
# MESH: meshes of geometry/dovetail.geo (docs/geometry.md has the parameters). ROUNDS (3), THREADS
# ("1 2") and PEERS ("faer cholmod mumps") may be set; CHOLMOD and MUMPS are installed by apt
# (Debian) where they are missing. faer takes the order of dovetail, CHOLMOD that of METIS, MUMPS
# that of SCOTCH; ARPACK takes the factor of dovetail. The tables have the medians of processor
# seconds with one thread and of the wall clock with more, the peak of memory, and ratios.
set -eu
cd "$(dirname "$0")/../.."
[ $# -gt 0 ] || { sed -n '2,11s/^# \{0,1\}//p' "$0"; exit 1; }
work=target/solvers
mkdir -p $work
peers=${PEERS:-faer cholmod mumps}
case $peers in
*cholmod* | *mumps*)
    if ! [ -e /usr/include/suitesparse/cholmod.h ] && ! [ -e /usr/include/cholmod.h ] || ! [ -e /usr/include/dmumps_c.h ]; then
        apt-get install -y --no-install-recommends libsuitesparse-dev libmumps-seq-dev libopenblas0-pthread
    fi
    cc -O2 -I/usr/include/suitesparse -I/usr/include/mumps_seq benches/solvers/peers.c -o $work/peers \
        -lcholmod -ldmumps_seq -lm
    # OpenBLAS 0.3.21 takes some processors for the oldest of all: an unfair peer.
    if grep -q avx512f /proc/cpuinfo; then export OPENBLAS_CORETYPE=SkylakeX; fi
    ;;
esac
cargo bench --locked --no-run --bench solvers
own="cargo bench --locked --quiet --bench solvers --"
log=$work/log.txt
: > $log
for mesh in "$@"; do
    name=$(basename "$mesh" .msh)
    matrix=$PWD/$work/$name.matrix
    $own matrix "$(realpath "$mesh")" "$matrix"
    for round in $(seq "${ROUNDS:-3}"); do
        for threads in ${THREADS:-1 2}; do
            export OPENBLAS_NUM_THREADS=$threads OMP_NUM_THREADS=$threads
            for program in dovetail $peers; do
                echo "= solve $program $threads $name" >> $log
                case $program in
                dovetail | faer) $own solve $program "$matrix" "$threads" ;;
                *) $work/peers $program "$matrix" "$threads" ;;
                esac >> $log
            done
            for task in "inertia dovetail" "inertia faer" "modes blocks" "modes arpack"; do
                echo "= $task $threads $name" >> $log
                $own $task "$matrix" "$threads" >> $log
            done
        done
    done
    rm "$matrix"
done
python3 benches/solvers/table.py $log
