#!/bin/sh
# dovetail beside pyHarm (PyPI: pyHarm-os) and tmdsimpy on their published examples of contact through springs:
#
#     benches/peers/penalty/compare.sh
#
# The exit code says whether the motions agree. The peers are installed in target/peers: tmdsimpy is cloned from GitHub, and left
# out where that fails. dovetail runs as its Python package, which `make python` puts in target/python.
set -eu
cd "$(dirname "$0")/../../.."
root=$PWD here=benches/peers/penalty work=target/peers/penalty
commit=00dc7ad7cfbe4875a5e5833bdb85b4c091b8bdcf
mkdir -p $work
if ! [ -e target/peers/venv/installed ]; then
    python3 -m venv target/peers/venv
    target/peers/venv/bin/pip install --quiet numpy==2.4.6 scipy==1.17.1 pyHarm-os==1.2.2
    touch target/peers/venv/installed
fi
tmdsimpy=target/peers/tmdsimpy
if ! [ -e $tmdsimpy ]; then
    if git clone --quiet https://github.com/tmd-lab/tmdsimpy $tmdsimpy.part && git -C $tmdsimpy.part checkout --quiet $commit; then
        mv $tmdsimpy.part $tmdsimpy
    else
        rm -rf $tmdsimpy.part
        echo "compare.sh: tmdsimpy cannot be cloned, it is left out" >&2
    fi
fi
[ -e target/python/dovetail/_dovetail.abi3.so ] || make python
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 PYTHONWARNINGS=ignore
python=$root/target/peers/venv/bin/python
rm -f $work/*.json
PYTHONPATH=target/python $python $here/dovetail_penalty.py $work/dovetail.json
# It leaves folders where it runs and at home.
(cd $work && HOME=$PWD $python "$root/$here/pyharm_penalty.py" pyharm.json)
if [ -e $tmdsimpy ]; then $python $here/tmdsimpy_penalty.py $tmdsimpy $work/tmdsimpy.json; fi
$python $here/table.py $work
