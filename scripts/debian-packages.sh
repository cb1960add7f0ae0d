# Packages of a release of Debian, fetched without root and without touching the machine's own apt: for the scripts fetch-NAME, which set
# RELEASE, define `fail`, and `is_there` for what they make, and then call `begin`.
#
# Packages come from the mirror that this machine's apt uses, and are checked against Debian's own keys.
#
# shellcheck shell=bash

# Ends the script if its tree is there, else makes $work, a folder of its own beside it that goes when the script ends. One at a time:
# whoever waited finds the tree done.
begin() { # the tree's name in the cache
    cache=${AFTERLIGHT_CACHE:-$(dirname -- "$scripts")/.cache}
    target=$cache/$1
    ! is_there || exit 0
    local tool
    for tool in apt-get apt-config dpkg dpkg-deb; do
        command -v "$tool" >/dev/null || fail "$tool is missing: Debian's packages can be unpacked on Debian, Ubuntu and their kin only"
    done
    architecture=$(dpkg --print-architecture)
    keyring=$(find_keyring)
    mkdir -p "$cache" || fail "cannot make $cache (AFTERLIGHT_CACHE names another place)"
    cache=$(cd -- "$cache" && pwd)
    target=$cache/$1
    exec 9>"$cache/$1.lock"
    if command -v flock >/dev/null; then
        flock 9
        ! is_there || exit 0
        # A killed run left these: under the lock nobody else is at work.
        rm -rf -- "$cache/$1".part.*
    fi
    work=$(mktemp -d "$cache/$1.part.XXXXXX")
    trap 'rm -rf -- "$work"' EXIT
    trap 'exit 130' INT TERM
    # mktemp makes it private; the tree is to be as readable as the project.
    chmod 755 "$work"
    write_apt_configuration
}

# Puts what is finished in its place. A rename is the last thing that happens, so that what is there is complete.
finish() { # the finished tree
    rm -rf -- "$target"
    mv -T -- "$1" "$target"
}

# Debian's archive keyring, under either of the names that it has had.
find_keyring() {
    local file
    for file in /usr/share/keyrings/debian-archive-keyring.{gpg,pgp}; do
        [[ -r $file ]] && echo "$file" && return 0
    done
    fail "Debian's archive keys are missing; type: sudo apt-get install -y debian-archive-keyring"
}

# The mirrors to try, one a line: those that this machine takes Debian's main archive from, then Debian's own.
mirrors() {
    local codename
    if grep -qx 'ID=debian' /etc/os-release; then
        codename=$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release)
        # $(REPO_URI) and its like are apt's own placeholders.
        # shellcheck disable=SC2016
        apt-get indextargets --no-release-info --format '$(COMPONENT) $(RELEASE) $(REPO_URI)' 'Created-By: Packages' |
            awk -v codename="$codename" '$1 == "main" && $2 ~ "^(" codename "|stable|oldstable|testing|unstable|sid)$" && !seen[$3]++ {print $3}'
    fi
    echo http://deb.debian.org/debian/
}

# Gives apt a world of its own under $work: the machine's proxy and mirror settings, and nothing else of its configuration, lists,
# installed packages or hooks.
write_apt_configuration() {
    mkdir -p "$work"/state/lists/partial "$work"/cache/archives/partial "$work"/empty
    : >"$work/state/status"
    {
        # Index targets of the machine's would fetch data that only software centres read.
        apt-config dump | grep '^Acquire::' | grep -v '^Acquire::IndexTargets'
        cat <<CONF
Acquire::Languages "none";
Acquire::Retries "3";
APT::Architecture "$architecture";
APT::Architectures { "$architecture"; };
APT::Install-Recommends "false";
// apt's own download user cannot enter a project that lies in a private home.
APT::Sandbox::User "root";
Dir::Cache "$work/cache";
Dir::State "$work/state";
Dir::State::status "$work/state/status";
Dir::Etc::main "/dev/null";
Dir::Etc::parts "$work/empty";
Dir::Etc::preferences "/dev/null";
Dir::Etc::preferencesparts "$work/empty";
Dir::Etc::sourcelist "$work/sources.list";
Dir::Etc::sourceparts "$work/empty";
CONF
    } >"$work/apt.conf"
}

# apt-get in that world; the machine's own is asked by the plain name.
own_apt_get() {
    APT_CONFIG=$work/apt.conf apt-get -qq -y "$@"
}

# Fetches the lists from the first mirror that has the release and proves to be Debian's; false where none has, with apt's words in update.log.
try_lists() {
    local mirror
    while read -r mirror; do
        printf 'deb [signed-by=%s] %s %s main\n' "$keyring" "$mirror" "$RELEASE" >"$work/sources.list"
        if own_apt_get update >"$work/update.log" 2>&1 && ! grep -q '^[EW]:' "$work/update.log"; then
            return 0
        fi
    done < <(mirrors)
    return 1
}

fetch_lists() {
    try_lists && return 0
    sed 's/^/    /' "$work/update.log" >&2
    fail "no mirror gave Debian $RELEASE's package lists (what apt said is above)"
}
