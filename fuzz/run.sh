#!/usr/bin/env bash
# Runs fuzz targets, each for as many seconds as the first argument says: those that are named after
# it, or all. What they have learned stays in fuzz/corpus; an input that breaks one is kept in
# fuzz/artifacts and ends the run.
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=$1
shift
targets=("$@")
[ $# -gt 0 ] || targets=(mesh msh2 deck ansys nastran vtu format scene study reduced_model surface_field matrices)

corpus=fuzz/corpus
dictionaries=fuzz/dictionaries
cargo_fuzz_options=(--sanitizer none --target-dir target/fuzz)

# One input: the files of a folder, each behind a line with its name.
folder_in_one() {
    local file
    for file in "$1"/*.mtx "$1"/model.json; do
        printf '=== %s\n' "$(basename "$file")"
        cat "$file"
        printf '\n'
    done
}

# The inputs of the repository to begin with.
seed() {
    local folder
    mkdir -p $corpus/{mesh,msh2,deck,ansys,nastran,vtu,format,scene,study,reduced_model,surface_field,matrices}
    cp fuzz/seeds/mesh/*.msh meshes/blocks_*.msh meshes/elements/order?.msh $corpus/mesh
    cp fuzz/seeds/msh2/*.msh meshes/elements/*_msh2*.msh $corpus/msh2
    cp fuzz/seeds/deck/*.inp meshes/elements/*.inp $corpus/deck
    cp fuzz/seeds/ansys/*.cdb $corpus/ansys
    cp fuzz/seeds/nastran/*.bdf $corpus/nastran
    cp fuzz/seeds/vtu/*.vtu meshes/elements/*.vtu $corpus/vtu
    cp fuzz/seeds/mesh/*.msh meshes/elements/order1* $corpus/format
    cp scenes/*.toml scenes/verification/*.toml fuzz/fuzz_targets/*.toml fuzz/seeds/scene/*.toml \
        $corpus/scene
    cp fuzz/seeds/surface_field/*.csv scenes/*.csv $corpus/surface_field
    cp crates/matrices/tests/data/*/*.{sti,dof,mtx,mat,rua,op4} fuzz/seeds/matrices/* \
        $corpus/matrices
    cp studies/*.toml fuzz/seeds/study/*.toml $corpus/study
    for folder in scenes/verification/*/; do
        folder_in_one "$folder" >"$corpus/reduced_model/$(basename "$folder")"
    done
}

# Keys, words and examples of the reference: what stands between backquotes in its tables.
keys() {
    grep -h '^|' "$@" | grep -o '`[^`]*`' | tr -d '`' | sort -u |
        sed -e 's/\\/\\\\/g' -e 's/"/\\"/g' -e 's/.*/"&"/'
}

dictionary() {
    case $1 in
    scene) keys docs/scene.md ;;
    study) keys docs/scene.md docs/study.md ;;
    format) cat $dictionaries/{mesh,msh2,deck,ansys,nastran,vtu}.dict ;;
    *) cat "$dictionaries/$1.dict" ;;
    esac
}

# For the files that a target writes: in memory, where the system has such a place.
scratch=$(mktemp -d -p /dev/shm 2>/dev/null || mktemp -d)
trap 'rm -rf "$scratch"' EXIT

seed
cargo fuzz build "${cargo_fuzz_options[@]}"
mkdir -p target/fuzz
for target in "${targets[@]}"; do
    dictionary "$target" >"target/fuzz/$target.dict"
    # Memory that is asked for beyond the limit ends the run as a panic does, used or not.
    (
        ulimit -v $((2 << 20))
        TMPDIR=$scratch cargo fuzz run "${cargo_fuzz_options[@]}" "$target" "$corpus/$target" -- \
            -dict="target/fuzz/$target.dict" -max_total_time="$seconds" -timeout=2 \
            -rss_limit_mb=1024 -max_len=20000 -print_final_stats=1
    )
done
