#!/usr/bin/env bash
# Makes what installs without a compiler, with the libraries inside that the program needs: ARPACK,
# LAPACK, BLAS and those of Fortran.
#   tools/package.sh wheel   the Python package and the program in one wheel, in target/wheels
#   tools/package.sh dist    an archive of the program, its man pages, completions and scenes, in
#                            target/dist
# The system that runs them has to be as new as the one that made them, in its C library alone.
set -euo pipefail
cd "$(dirname "$0")/.."
PATH=$PWD/target/venv/bin:$PATH
built=${CARGO_TARGET_DIR:-target}/release

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Libraries that a program needs and that not every system has, one path a line.
libraries() {
    if ldd "$1" | grep 'not found' >&2; then
        echo "package: $1 lacks these libraries here: run tools/setup.sh" >&2
        return 1
    fi
    ldd "$1" | awk '$2 == "=>" { print $3 }' |
        grep -Ev '/(libc|libm|libpthread|libdl|librt|libutil|libgcc_s)\.so' | sort -u
}

# Puts the licences into a folder: of dovetail, and of the libraries of a program, which Debian's
# packages have.
licences() {
    local folder=$2 library owner
    mkdir -p "$folder"
    cp LICENSE-MIT LICENSE-APACHE "$folder"
    for library in $(libraries "$1"); do
        owner=$(dpkg -S "$(readlink -f "$library")" 2>/dev/null | head -n 1 | cut -d: -f1) || true
        if [ -n "$owner" ] && [ -e "/usr/share/doc/$owner/copyright" ]; then
            cp "/usr/share/doc/$owner/copyright" "$folder/$owner.txt"
        else
            echo "package: no licence is found for $library: add it before you give this away" >&2
        fi
    done
}

wheel() {
    cargo build --release --locked
    maturin build --release --locked --auditwheel skip --manifest-path crates/python/Cargo.toml \
        --out "$work"
    python -m wheel unpack --dest "$work" "$work"/dovetail-*.whl
    local tree
    tree=$(echo "$work"/dovetail-*/)
    install -D -m 755 "$built/dovetail" "$tree/dovetail/program/dovetail"
    strip "$tree/dovetail/program/dovetail"
    licences "$built/dovetail" "$(echo "$tree"dovetail-*.dist-info)/licenses"
    mkdir -p "$work/whole" target/wheels
    python -m wheel pack --dest-dir "$work/whole" "$tree"
    rm -f target/wheels/dovetail-*.whl
    # The tag is that of the oldest C library that has all that the wheel asks for.
    auditwheel repair --wheel-dir target/wheels "$work"/whole/dovetail-*.whl
    auditwheel show target/wheels/dovetail-*.whl
}

dist() {
    cargo build --release --locked
    local version name tree library shell
    version=$("$built/dovetail" --version | awk '{ print $2 }')
    name=dovetail-$version-$(uname -m)-linux
    tree=$work/$name
    install -D -m 755 "$built/dovetail" "$tree/bin/dovetail"
    strip "$tree/bin/dovetail"
    mkdir -p "$tree/lib"
    for library in $(libraries "$built/dovetail"); do
        # The name that the program asks for, and the file that it stands for here.
        install -m 644 "$(readlink -f "$library")" "$tree/lib/$(basename "$library")"
        patchelf --set-rpath '$ORIGIN' "$tree/lib/$(basename "$library")"
    done
    patchelf --set-rpath '$ORIGIN/../lib' "$tree/bin/dovetail"
    "$tree/bin/dovetail" man "$tree/share/man/man1"
    mkdir -p "$tree"/share/{bash-completion/completions,zsh/site-functions,fish/vendor_completions.d}
    "$tree/bin/dovetail" completions bash >"$tree/share/bash-completion/completions/dovetail"
    "$tree/bin/dovetail" completions zsh >"$tree/share/zsh/site-functions/_dovetail"
    "$tree/bin/dovetail" completions fish >"$tree/share/fish/vendor_completions.d/dovetail.fish"
    licences "$built/dovetail" "$tree/licences"
    # What the repository has of these folders, and no output of runs.
    git archive HEAD README.md LICENSE-MIT LICENSE-APACHE CHANGELOG.md CITATION.cff docs scenes \
        geometry meshes studies |
        tar -x -C "$tree"
    mkdir -p target/dist
    rm -f target/dist/dovetail-*.tar.gz
    tar --owner=0 --group=0 --numeric-owner -C "$work" -czf "target/dist/$name.tar.gz" "$name"
    ls -l "target/dist/$name.tar.gz"
}

case "${1:-}" in
wheel) wheel ;;
dist) dist ;;
*)
    echo "usage: tools/package.sh wheel|dist" >&2
    exit 2
    ;;
esac
