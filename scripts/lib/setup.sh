# Shared by scripts/run and scripts/test: makes and fills virtual environments, once.
# Sourced with the repository root as working directory; needs nothing but bash, coreutils and a Python.

say() { printf '%s\n' "$*" >&2; }
die() { say "error: $*"; exit 1; }

# Path of the first Python >= 3.11 that can make virtual environments; PYTHON=... takes precedence.
find_python() {
    local candidate
    for candidate in ${PYTHON:-python3 python3.14 python3.13 python3.12 python3.11 /usr/bin/python3}; do
        if "$candidate" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then
            command -v "$candidate"
            return
        fi
    done
    say "found: $(${PYTHON:-python3} --version 2>&1 | head -n 1 || true)"
    die "hpcdem needs Python 3.11 or newer with its venv module (Debian, Ubuntu: apt install python3-venv);" \
        "name another one with PYTHON=/path/to/python3"
}

# fingerprint PYTHON TEXT...: what an environment depends on: place, Python's version (not its path, which shims change),
# the project's requirements, this recipe, and whatever else is given.
fingerprint() {
    { printf '%s\n' "$PWD" "${@:2}"; "$1" -VV; cat pyproject.toml scripts/lib/setup.sh; } | sha256sum | cut -d' ' -f1
}

# make_venv DIR PYTHON [OPTION]: an empty environment, unless a usable one of the same Python is there already.
make_venv() {
    local dir=$1 python=$2
    if [[ "$("$dir/bin/python" -VV 2>/dev/null)" == "$("$python" -VV)" ]] &&
        [[ "$("$dir/bin/pip" --version 2>/dev/null)" == *" $PWD/$dir/"* ]]; then
        return
    fi
    "$python" -m venv --clear "${@:3}" "$dir"
}

# install DIR ARGUMENTS: pip with a word of explanation when it fails.
install() {
    "$1/bin/pip" install -qq --disable-pip-version-check "${@:2}" ||
        die "pip could not install the packages (its message is above). Is a package index within reach?" \
            "Behind a proxy set HTTPS_PROXY, for a mirror PIP_INDEX_URL."
}

# ready DIR NAME KEY: whether DIR carries the stamp NAME with this key, and its Python is still on the machine.
ready() { [[ -x $1/bin/python && -e $1/.ready-$2 && $(<"$1/.ready-$2") == "$3" ]]; }

# once DIR NAME KEY COMMAND...: run the command unless the environment DIR is ready; one at a time.
once() {
    if ready "${@:1:3}"; then return; fi
    (
        if command -v flock >/dev/null; then flock 9; fi
        if ready "${@:1:3}"; then exit; fi
        "${@:4}" && printf '%s\n' "$3" >"$1/.ready-$2"
    ) 9>"${1%/}.setup.lock"
}

# wheels_venv DIR EXTRAS: everything from wheels, MPI included; no root, any Linux.
wheels_venv() {
    local python
    python=$(find_python)
    once "$1" "wheels-$2" "$(fingerprint "$python" "$2" "$(<requirements.lock)")" fill_from_wheels "$1" "$python" "$2"
}

fill_from_wheels() {
    local uv_at filled= extras=
    if [[ $3 != mpi ]]; then extras=[$3]; fi
    say "Setting up $1 from wheels with $("$2" --version) (once; some 10 s where the network is quick) ..."
    uv_at=$(mktemp -d)
    if get_uv "$uv_at" "$2" "$1" && fill_with_uv "$uv_at" "$1" "$2" "$extras"; then filled=yes; fi
    rm -r "$uv_at"
    if [[ -n $filled ]]; then return; fi
    make_venv "$1" "$2" || return
    if ! install_locked "$1" || [[ -n $extras ]]; then install "$1" --editable ".[$3]"; fi
}

# lock_without_uv FILE / lock_of_uv FILE: requirements.lock is what is installed, and the installer.
lock_without_uv() { awk '/^[^# ]/ { skip = /^uv==/ } !skip' requirements.lock >"$1"; }
lock_of_uv() { awk '/^[^# ]/ { take = /^uv==/ } take' requirements.lock >"$1"; }

# get_uv WHERE PYTHON DIR: the installer uv, by pip: that of PYTHON, or else of the environment DIR. It does with half
# the work and all at a time what pip takes one after the other.
get_uv() {
    local pip=("$2" -m pip)
    if ! "${pip[@]}" --version >/dev/null 2>&1; then
        make_venv "$3" "$2" || return
        pip=("$3/bin/pip")
    fi
    lock_of_uv "$1/lock"
    "${pip[@]}" install -qq --disable-pip-version-check --no-compile --no-deps --only-binary :all: --require-hashes \
        --target "$1/uv" --requirement "$1/lock" >/dev/null 2>&1
}

# fill_with_uv WHERE DIR PYTHON [EXTRAS]: hpcdem with the extra mpi, in the versions of requirements.lock, each checked by
# its hash; then EXTRAS in versions of their own. It is silent where it does not work: pip knows more ways, and says more.
fill_with_uv() {
    local uv=$1/uv/bin/uv index job failed=
    make_venv "$2" "$3" --without-pip || return
    # uv does not read the settings of pip; these are what it takes to reach the packages.
    index=$("$3" -m pip config list 2>/dev/null | sed -n "s/^[^=]*[.]index-url='\(.*\)'$/\1/p" | tail -n 1)
    if [[ -n $index ]]; then export UV_DEFAULT_INDEX=${UV_DEFAULT_INDEX:-$index}; fi
    if [[ -n ${PIP_CERT:-} ]]; then export SSL_CERT_FILE=${SSL_CERT_FILE:-$PIP_CERT}; fi
    lock_without_uv "$1/lock"
    "$uv" pip install -q --python "$2/bin/python" --require-hashes --only-binary :all: --no-deps --requirement "$1/lock" \
        >/dev/null 2>&1 &
    job=$!
    "$uv" pip install -q --python "$2/bin/python" --no-deps --editable . pip >/dev/null 2>&1 || failed=yes
    wait "$job" || failed=yes
    if [[ -z $failed && -n ${4:-} ]]; then
        "$uv" pip install -q --python "$2/bin/python" --editable ".$4" >/dev/null 2>&1 || failed=yes
    fi
    [[ -z $failed ]] && compile_modules "$2"
}

# compile_modules DIR: pip and uv leave modules uncompiled here, as all of them would take longer than to install them.
# Those that every run begins with are compiled on all cores; Python does the others when it first imports them.
compile_modules() {
    local packages
    packages=$("$1/bin/python" -c 'import sysconfig; print(sysconfig.get_paths()["platlib"])')
    "$1/bin/python" -m compileall -q -j 0 -x '/tests?/' "$packages"/{numpy,numba,llvmlite,pydantic} || true
}

# install_locked DIR: the same by pip, half of the packages at a time, as pip takes one after the other. Where they do not
# fit, as with a Python or processor that has no such wheels, it says so and leaves the choice to the ranges of
# pyproject.toml.
install_locked() {
    local parts job jobs=() failed=
    parts=$(mktemp -d)
    lock_without_uv "$parts/lock"
    awk -v all="$(grep -c '^[^# ]' "$parts/lock")" -v dir="$parts" \
        '/^[^# ]/ { n++ } !/^#/ { print > (dir "/" (2 * n > all)) }' "$parts/lock"
    for job in 0 1; do
        "$1/bin/pip" install -q --disable-pip-version-check --require-hashes --only-binary :all: --no-compile --no-deps \
            --requirement "$parts/$job" >"$parts/said-$job" 2>&1 &
        jobs+=($!)
    done
    "$1/bin/pip" install -q --disable-pip-version-check --no-deps --editable . >"$parts/said-2" 2>&1 &
    jobs+=($!)
    for job in "${jobs[@]}"; do wait "$job" || failed=yes; done
    if [[ -z $failed ]]; then
        compile_modules "$1"
    else
        say "The versions of requirements.lock cannot be had for $("$1/bin/python" --version 2>&1) on $(uname -sm):"
        say "  $(cat "$parts"/said-* | grep -i error | tail -n 1)"
        say "Going on with the newest versions that pyproject.toml allows."
    fi
    rm -r "$parts"
    [[ -z $failed ]]
}

# debian_venv DIR EXTRAS: Debian's MPI, parallel HDF5, PETSc and Slurm; pip adds the rest around Debian's numpy.
debian_venv() {
    once "$1" "debian-$2" "$(fingerprint /usr/bin/python3 "$2")" fill_from_debian "$1" "$2"
}

debian_packages=(
    python3-venv python3-dev python3-mpi4py python3-petsc4py python3-h5py-mpi python3-scipy python3-matplotlib
    openmpi-bin libopenmpi-dev slurmctld slurmd slurm-client munge libpmix-dev tmux
    libglu1-mesa libxrender1 libxcursor1 libxft2 libxinerama1 # libraries that the gmsh wheel loads
)

# Command prefix that makes us root, empty when we are; fails where there is no way without a password.
root_prefix() {
    if [[ $(id -u) == 0 ]]; then return; fi
    if command -v sudo >/dev/null && sudo -n true 2>/dev/null; then echo "sudo -n"; return; fi
    return 1
}

# Says why on failure; nothing is installed then, or only packages that do no harm.
have_debian_packages() {
    local sudo
    if ! command -v apt-get >/dev/null; then say "no apt-get on this machine"; return 1; fi
    if ! dpkg -s "${debian_packages[@]}" >/dev/null 2>&1; then
        if ! sudo=$(root_prefix); then say "apt-get needs root or a sudo without password"; return 1; fi
        say "Installing Debian packages for parallel HDF5, PETSc, Open MPI and Slurm (once; about a minute) ..."
        apt_install "$sudo" "${debian_packages[@]}" ||
            { say "apt-get could not install: ${debian_packages[*]}"; return 1; }
    fi
    if ! /usr/bin/python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
        say "the system's $(/usr/bin/python3 --version) is older than 3.11"
        return 1
    fi
}

# A browser for the tests of the page of `hpcdem grade --serve`: one that is here, else Debian's (about half a minute;
# Ubuntu has none of this name).
have_browser() {
    local sudo name
    for name in chromium-headless-shell chromium chromium-browser google-chrome google-chrome-stable; do
        if command -v "$name" >/dev/null; then return; fi
    done
    if ! apt-cache show chromium-headless-shell >/dev/null 2>&1; then say "no browser, and apt-get has none"; return 1; fi
    if ! sudo=$(root_prefix); then say "no browser, and apt-get needs root"; return 1; fi
    say "Installing a browser without windows for the tests of the page (once; about half a minute) ..."
    apt_install "$sudo" chromium-headless-shell fonts-dejavu-core ||
        { say "apt-get could not install chromium-headless-shell"; return 1; }
}

# apt_install SUDO PACKAGE...: another apt may be at work (a fresh cloud machine updates itself): wait for its locks, up
# to five minutes each.
apt_install() {
    local try log options=(-qq -o DPkg::Lock::Timeout=300)
    for try in {1..10}; do
        if $1 apt-get update "${options[@]}" >&2; then break; fi
        say "apt-get update did not work (try $try of 10)"
        if ((try < 10)); then sleep 30; fi
    done
    if ! log=$($1 env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends "${options[@]}" \
        "${@:2}" </dev/null 2>&1); then
        tail -n 20 <<<"$log" >&2
        return 1
    fi
}

fill_from_debian() {
    say "Setting up $1 around Debian's packages (once; about half a minute) ..."
    make_venv "$1" /usr/bin/python3 --system-site-packages &&
        # Debian's binaries hold to the numpy they were built with.
        /usr/bin/python3 -c 'import numpy; print("numpy==" + numpy.__version__)' >"$1/constraints.txt" &&
        install "$1" --constraint "$1/constraints.txt" --editable ".[$2]" &&
        # pip does not see Debian's h5py and brings its own without MPI, which would hide it.
        "$1/bin/pip" uninstall -qq --yes h5py
}

# Environment of the Debian stack; each line answers a trap (see docs on installing).
debian_environment() {
    local petsc
    petsc=$(ls -d /usr/lib/petscdir/petsc*/*-real 2>/dev/null | sort -V | tail -n 1)
    if [[ -n $petsc ]]; then export PETSC_DIR=$petsc; fi # petsc4py does not find its library otherwise
    export H5PY_ALWAYS_USE_MPI=1                          # the serial build is taken otherwise
}
