#!/bin/sh
# Writes the files of this folder by CalculiX: matrices of two hexahedra (steel, 1 m x 1 m x 3.5 m),
# free and held at z = 0, a substructure of the free ones, and the eigenvalues of the held ones.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$here"/*.inp "$work"
cd "$work"
sed 's/, SOLVER=MATRIXSTORAGE//' held.inp >frequency.inp
for job in free held substructure frequency; do
    ccx "$job" >"$job.log"
done
cp free.sti free.mas free.dof held.sti held.mas held.dof substruct.mtx "$here"
grep -A 4 '^ *1  *0\.' frequency.dat | head -n 4 | awk '{ print $2 }' >"$here/held.eigenvalues"
