#!/bin/sh
# dovetail, a dense Newton in numpy and pyHarm (PyPI: pyHarm-os) on the same reduced model, interleaved, in one run:
#
#     benches/peers/compare.sh
#
# One thread each. ROUNDS (3) and HARMONICS ("1 3") may be set; the tables have medians over the rounds, and the exit code says
# whether the amplitudes agree. STOCK=1 also runs pyHarm with its own condensation, one frequency. The peers are installed in
# target/peers/venv.
set -eu
cd "$(dirname "$0")/../.."
work=target/peers
rounds=${ROUNDS:-3} harmonics=${HARMONICS:-1 3} fine=2048
mkdir -p $work
if ! [ -e $work/venv/installed ]; then
    python3 -m venv $work/venv
    $work/venv/bin/pip install --quiet numpy==2.4.6 scipy==1.17.1 pyHarm-os==1.2.2
    touch $work/venv/installed
fi
cargo build --release --locked --quiet
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1
# An OpenBLAS older than the processor may take it for the oldest of all: an unfair peer.
if grep -q avx512f /proc/cpuinfo; then export OPENBLAS_CORETYPE=SkylakeX; fi
python=$work/venv/bin/python here=benches/peers scene=benches/peers/scene.toml
# It leaves folders where it runs and at home.
pyharm() { (cd $work && HOME=$PWD venv/bin/python ../../$here/pyharm_dlft.py ../../$scene "$@"); }
echo "load before: $(cut -d' ' -f1-3 /proc/loadavg)"
for h in $harmonics; do
    for i in $(seq "$rounds"); do
        $python $here/dovetail_run.py $scene "$h" $work/dovetail-"$h"-"$i".json
        $python $here/numpy_newton.py $scene "$h" $work/periodic-"$h"-"$i".json > $work/periodic-"$h"-"$i".txt
        $python $here/numpy_newton.py $scene "$h" $work/numpy-"$h"-"$i".json 3 > $work/numpy-"$h"-"$i".txt
        pyharm "$h" periodic-"$h"-1.json pyharm-"$h"-"$i".json > $work/pyharm-"$h"-"$i".txt
    done
    # With many samples it makes no difference that dovetail follows pairs between them.
    $python $here/dovetail_run.py $scene "$h" $work/dovetail-"$h"-fine.json $fine
    $python $here/numpy_newton.py $scene "$h" $work/periodic-"$h"-fine.json periodic $fine > $work/periodic-"$h"-fine.txt
    if [ "${STOCK:-0}" = 1 ]; then
        echo "pyHarm with its own condensation, H = $h:"
        pyharm "$h" periodic-"$h"-1.json stock-"$h".json --points 1 --stock
    fi
done
echo "load after: $(cut -d' ' -f1-3 /proc/loadavg)"
# shellcheck disable=SC2086
$python $here/table.py $work "$rounds" $harmonics
