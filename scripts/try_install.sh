#!/usr/bin/env bash
# Tries the wheel of `make wheel` and the archive of `make dist` in a bare root: a minimal Debian or
# Ubuntu with Python and with no compiler, no gmsh, no BLAS, and no network while anything runs. Needs
# root, and debootstrap (tools/setup.sh root).
#   scripts/try_install.sh [wheel] [dist]     both, where neither is named
set -euo pipefail
cd "$(dirname "$0")/.."

codename=$(. /etc/os-release && echo "$VERSION_CODENAME")
bare=$PWD/target/root-$codename
work=$(mktemp -d "$PWD/target/try.XXXXXX")
root=$work/root
trap 'rm -rf "$work"' EXIT

say() { printf 'try: %s\n' "$*"; }
fail() { printf 'try: %s\n' "$*" >&2; exit 1; }

# Runs words of a shell in the root, without network and with an environment of its own.
within() {
    unshare --net --mount --pid --fork --kill-child --mount-proc="$root/proc" \
        chroot "$root" env -i HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin \
        timeout 600 sh -ec "cd /root; $1"
}

# As within, where the words have to end with a code; prints what they say.
ends_with() {
    local code=$1 said ended=0
    said=$(within "$2" 2>&1) || ended=$?
    [ "$ended" = "$code" ] || fail "code $ended and not $code of: $2
$said"
    printf '%s\n' "$said"
}

# Fails if the root has what the packages have to do without.
is_bare() {
    local found
    found=$(within 'for name in cc gcc c++ g++ clang ld as gfortran cargo rustc make gmsh dovetail; do
        command -v $name || true; done')
    [ -z "$found" ] || fail "the root is not bare, it has $found"
    found=$(find "$root"/usr/lib* "$root"/usr/local "$root"/opt \
        \( -name 'lib*blas*.so*' -o -name 'liblapack*.so*' -o -name 'libarpack*.so*' \
        -o -name 'libgfortran*.so*' -o -name 'libmkl*' -o -name 'libgmsh*' \) -print)
    [ -z "$found" ] || fail "the root is not bare, it has $found"
}

# A root that nothing was tried in yet.
new_root() {
    if [ ! -e "$bare/made" ]; then
        say "making a minimal $codename in $bare"
        rm -rf "$bare"
        debootstrap --variant=minbase --include=python3,python3-venv "$codename" "$bare" >"$work/log" ||
            { tail -n 20 "$work/log" >&2; fail "debootstrap fails: is there a network?"; }
        touch "$bare/made"
    fi
    rm -rf "$root"
    cp -a "$bare" "$root"
    is_bare
}

# Fails unless the text has the peak of the paper's scene, to a part of its amplitude and so many Hz:
# with the ready mesh to the digits shown, with the mesh of another gmsh than 4.8.4 to some thousandths
# and a tenth of a hertz.
has_peak() {
    local mm hz
    mm=$(grep -m 1 -Eo '[0-9.]+ mm' <<<"$1" | cut -d' ' -f1) || true
    hz=$(grep -m 1 -Eo '[0-9.]+ Hz' <<<"$1" | cut -d' ' -f1) || true
    awk -v mm="${mm:-0}" -v hz="${hz:-0}" -v part="$2" -v off_hz="$3" 'BEGIN {
        exit !((mm / 6.49 - 1) ^ 2 <= part ^ 2 && (hz - 450.09) ^ 2 <= off_hz ^ 2) }' ||
        fail "no peak of 6.49 mm at 450.09 Hz in:
$1"
}

try_wheel() {
    local wheel python said needed
    wheel=$(ls target/wheels/dovetail-*.whl) || fail "no wheel: run make wheel"
    new_root
    python=$(within 'python3 -c "import sys; print(\"%d.%d\" % sys.version_info[:2])"')
    say "$(basename "$wheel") in a bare $codename with Python $python"
    mkdir -p "$root/root/wheels"
    # Besides the wheel what it depends on, for the Python of the root.
    target/venv/bin/python -m pip download --quiet --only-binary :all: --python-version "$python" \
        --dest "$root/root/wheels" "$wheel"
    within 'python3 -m venv venv
        venv/bin/pip install --quiet --no-index --find-links wheels dovetail'

    # The remedy for the libraries of gmsh is what has to be installed, and all of it.
    said=$(ends_with 1 'venv/bin/dovetail-gmsh -version')
    needed=$(sed -n 's/.*run `apt-get install \(.*\)`.*/\1/p' <<<"$said")
    [ -n "$needed" ] || fail "no remedy in: $said"
    say "libraries for gmsh: $needed"
    # The network is for this step alone.
    chroot "$root" sh -c "apt-get update -qq &&
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $needed" \
        >"$work/log" 2>&1 || { tail -n 20 "$work/log" >&2; fail "these packages are not installed"; }
    is_bare

    # The scene without the ready mesh: gmsh makes it.
    mkdir "$root/root/scenes" "$root/root/geometry"
    # What the notebook computes, without its picture.
    python3 - crates/python/examples/paper.ipynb >"$root/root/paper.py" <<'END'
import json, sys
cells = [cell for cell in json.load(open(sys.argv[1]))["cells"] if cell["cell_type"] == "code"]
print('scene_file, options = "scenes/paper.toml", {}')
print("".join(cells[1]["source"]))
END
    cp scenes/paper.toml "$root/root/scenes"
    cp geometry/dovetail.geo "$root/root/geometry"
    said=$(ends_with 0 'venv/bin/python paper.py 2>/dev/null')
    has_peak "$said" 0.004 0.1
    say "paper.ipynb, meshed by gmsh: $(head -n 1 <<<"$said")"
    mkdir "$root/root/meshes"
    cp meshes/dovetail.msh "$root/root/meshes"
    said=$(ends_with 0 'export DOVETAIL_GMSH=/nowhere
        venv/bin/python paper.py 2>/dev/null')
    has_peak "$said" 0.0001 0.02
    say "paper.ipynb, the ready mesh: $(head -n 1 <<<"$said")"

    # The program, whose folder is not in PATH.
    say "$(ends_with 0 'venv/bin/dovetail --version')"
    ends_with 2 'venv/bin/dovetail run' >/dev/null
    said=$(ends_with 0 'venv/bin/dovetail new blade && venv/bin/dovetail run blade/scene.toml')
    say "dovetail new and run:" $(grep -m 1 'peak of' <<<"$said")
    # The processes of a study are the program, too, and SIGTERM leaves a readable folder.
    cp -r scenes/verification "$root/root/scenes"
    printf '%s\n' 'name = "two"' 'scene = "scenes/verification/den_hartog.toml"' '[[parameter]]' \
        'key = "response.harmonics"' 'values = [1, 3]' >"$root/root/two.toml"
    ends_with 0 'venv/bin/dovetail study two.toml' >"$work/log"
    grep -q '\[2/2\]' "$work/log" || fail "no two cases in: $(cat "$work/log")"
    say "dovetail study: two cases"
    ends_with 0 'venv/bin/dovetail run scenes/paper.toml --no-cache --out ended 2>said & pid=$!
        until grep -q "\"state\": *\"running\"" ended/summary.json 2>/dev/null; do sleep 0.1; done
        kill -TERM $pid; code=0; wait $pid || code=$?
        grep "\"state\"" ended/summary.json; echo "code $code"' >"$work/log"
    grep -q '"interrupted"' "$work/log" || fail "not interrupted: $(cat "$work/log")"
    say "a run that SIGTERM ends: $(tail -n 1 "$work/log")"
}

try_dist() {
    local archive name said
    archive=$(ls target/dist/dovetail-*.tar.gz) || fail "no archive: run make dist"
    name=$(basename "$archive" .tar.gz)
    new_root
    say "$name.tar.gz in a bare $codename"
    tar -x -C "$root/root" -f "$archive"
    say "$(ends_with 0 "$name/bin/dovetail --version")"
    # gmsh is missing, and the ready mesh is taken.
    said=$(ends_with 0 "cd $name; bin/dovetail run scenes/paper.toml --out /root/paper")
    # With all its digits, of which the run prints those that the estimated error supports.
    said=$(python3 -c 'import json, sys
found = json.load(open(sys.argv[1]))["response"]
print("%.2f mm at %.3f Hz" % (1e3 * found["peak_amplitude_m"], found["peak_frequency_hz"]))' \
        "$root/root/paper/summary.json")
    has_peak "$said" 0.0001 0.02
    say "dovetail run scenes/paper.toml: $said"
    within "test -s $name/share/man/man1/dovetail-run.1
        bash -n $name/share/bash-completion/completions/dovetail
        test -s $name/share/zsh/site-functions/_dovetail
        test -s $name/share/fish/vendor_completions.d/dovetail.fish
        test -s paper/report.html"
}

[ "$(id -u)" = 0 ] || fail "the root is made by the superuser: run it with sudo"
[ $# -gt 0 ] || set -- wheel dist
for what; do
    case $what in
    wheel | dist) "try_$what" ;;
    *) fail "usage: scripts/try_install.sh [wheel] [dist]" ;;
    esac
done
say "all is well"
