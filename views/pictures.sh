#!/usr/bin/env bash
# Each view of a run as a picture: views/pictures.sh output/paper docs/images
# Needs ParaView's pvbatch and a display: `make views` gives it one.
set -euo pipefail
run=$1 pictures=$2
for view in flanks period wear; do
    DOVETAIL_OUT=$run DOVETAIL_PICTURE=$pictures/paraview_$view.png pvbatch "$(dirname "$0")/$view.py"
done
