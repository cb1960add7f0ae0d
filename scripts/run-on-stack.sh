# Starts a program on a stack's dynamic linker, libraries, Vulkan loader, lavapipe and validation layers, in place of this machine's own: for
# on-debian13 and on-newest, which set NAME and TITLE, and whose arguments are the program and its own.
#
# PROGRAM is a path, a name in the stack's own usr/bin (vulkaninfo), or a name in PATH; it must be a dynamically linked executable.
# It sees the host's files: this is a choice of libraries, not a container.
#
# A program that is started so must know:
# - /proc/self/exe is the dynamic linker: std::env::current_exe() is of no use to find files or to start oneself again.
# - A child that it starts as usual runs on the host's linker with this stack's driver, and fails. AFTERLIGHT_RUNNER, set here, is
#   the path of the script: put it before the child's own path.
#
# shellcheck shell=bash

fail() {
    printf 'on-%s: %s\n' "$NAME" "$*" >&2
    exit 127
}

# The file that a name stands for.
find_program() { # name
    case $1 in
    */*) [[ -f $1 ]] && echo "$1" ;;
    *) if [[ -f $stack/usr/bin/$1 ]]; then echo "$stack/usr/bin/$1"; else type -P "$1"; fi ;;
    esac
}

[[ $# -gt 0 ]] || fail "usage: scripts/on-$NAME PROGRAM [ARGUMENT...]"
scripts=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
# The stack's own variable: a test may give its children a cache of their own.
variable=AFTERLIGHT_${NAME^^}
stack=${!variable:-${AFTERLIGHT_CACHE:-$(dirname -- "$scripts")/.cache}/$NAME}
[[ -r $stack/packages.txt ]] || fail "there is no stack in $stack; type: scripts/fetch-$NAME"
stack=$(cd -- "$stack" && pwd)

case $(uname -m) in
x86_64) libraries=$stack/usr/lib/x86_64-linux-gnu linker=ld-linux-x86-64.so.2 ;;
aarch64) libraries=$stack/usr/lib/aarch64-linux-gnu linker=ld-linux-aarch64.so.1 ;;
*) fail "no stack of $TITLE for $(uname -m)" ;;
esac
[[ -x $libraries/$linker ]] || fail "$stack is for another machine; remove it, then type: scripts/fetch-$NAME"

program=$(find_program "$1") || fail "no such program: $1"
[[ $(head -c 2 -- "$program") != '#!' ]] || fail "$program is a script: name the executable that it starts"
shift

# Manifests of this stack only, whatever the host has; their libraries are bare names, found through --library-path.
unset VK_ADD_DRIVER_FILES VK_ADD_LAYER_PATH
# AFTERLIGHT_DRIVER is another driver's manifest (scripts/on-swiftshader).
export VK_DRIVER_FILES=${AFTERLIGHT_DRIVER:-$stack/usr/share/vulkan/icd.d/lvp_icd.json}
export VK_ICD_FILENAMES=$VK_DRIVER_FILES
# AFTERLIGHT_LAYERS is a folder with manifests of further layers, such as a test's own.
export VK_LAYER_PATH=$stack/usr/share/vulkan/explicit_layer.d${AFTERLIGHT_LAYERS:+:$AFTERLIGHT_LAYERS}
export VK_LOADER_LAYERS_DISABLE='~implicit~'
export AFTERLIGHT_RUNNER=$scripts/on-$NAME
declare -x "$variable=$stack"

exec "$libraries/$linker" --library-path "$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}" --argv0 "$program" "$program" "$@"
