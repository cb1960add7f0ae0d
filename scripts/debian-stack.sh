# A Vulkan stack of a release of Debian: loader, lavapipe, validation layers and what they need down to libc, unpacked into a directory of its
# own, for scripts/on-NAME to start programs on. For fetch-debian13 and fetch-newest, which set NAME, TITLE, RELEASE, PACKAGES and RECIPE, and
# then call `begin`, `fetch_stack`.
#
# The stack is unpacked beside its place, tried out, and only then renamed into it. Its packages.txt lists recipe, date and versions.
#
# shellcheck shell=bash

fail() {
    printf 'fetch-%s: %s\n' "$NAME" "$*" >&2
    exit 1
}

# Unpacks one tree from all packages, and leaves out what no program opens.
unpack() {
    local package
    mkdir "$work/stack"
    # ${Package} and ${Version} are dpkg-deb's own placeholders.
    # shellcheck disable=SC2016
    for package in "$work"/cache/archives/*.deb; do
        dpkg-deb --extract "$package" "$work/stack"
        dpkg-deb --show --showformat='${Package} ${Version}\n' "$package"
    done | LC_ALL=C sort >"$work/packages"
    rm -rf "$work"/stack/usr/share/{doc,man,locale,lintian,bug}
    {
        echo "recipe $RECIPE"
        echo "files $(count_files "$work/stack")"
        echo "fetched $(date -u +%Y-%m-%dT%H:%M:%SZ)"
        cat "$work/packages"
    } >"$work/stack/packages.txt"
}

# Of the tree itself: packages.txt comes last.
count_files() { # tree
    find "$1" -mindepth 2 ! -type d | wc -l
}

# Starts the stack's vulkaninfo on it: it must list lavapipe and the validation layer, or the stack is of no use.
try_out() {
    local summary
    summary=$(env "AFTERLIGHT_${NAME^^}=$work/stack" "$scripts/on-$NAME" vulkaninfo --summary 2>"$work/try.log") || {
        sed 's/^/    /' "$work/try.log" >&2
        fail "the unpacked stack does not run (what vulkaninfo said is above)"
    }
    [[ $summary == *llvmpipe* ]] || fail "the unpacked stack lists no lavapipe device"
    [[ $summary == *VK_LAYER_KHRONOS_validation* ]] || fail "the unpacked stack lists no validation layer"
}

# The last thing that goes in is the rename, so that packages.txt stands for the whole tree. A tree that has lost files since is fetched again.
is_whole() {
    [[ -r $target/packages.txt && $(head -n 1 "$target/packages.txt") == "recipe $RECIPE" ]] || return 1
    [[ $(sed -n 's/^files //p' "$target/packages.txt") == "$(count_files "$target")" ]] && return 0
    [[ -n ${told:-} ]] || echo "the stack in $target is incomplete"
    told=1
    return 1
}

# Fetches what apt resolves the packages to, and puts the tried-out tree in its place.
fetch_stack() {
    own_apt_get install --download-only "${PACKAGES[@]}" >"$work/download.log" 2>&1 || {
        sed 's/^/    /' "$work/download.log" >&2
        fail "could not fetch ${PACKAGES[*]} (what apt said is above)"
    }
    unpack
    try_out
    finish "$work/stack"
}

scripts=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=scripts/debian-packages.sh
. "$scripts/debian-packages.sh"
