#!/bin/sh
# Builds the static Ceres Solver that Lobefit links. Usage: ceres.sh PREFIX. A prefix that was already
# built by this very script is left alone. CMakeLists.txt runs it and gives the reasons for this way
# of linking Ceres.
set -eu

prefix=$1
stamp="$prefix/built-by"
script_sum=$(sha256sum <"$0")
[ "$(cat "$stamp" 2>/dev/null)" != "$script_sum" ] || exit 0

work="$prefix.work"
rm -rf "$prefix" "$work"
mkdir -p "$work"

# A source distribution brings the source of Ceres along. Where it is missing it comes from Debian's
# source package: the machine's own archive is asked for sources instead of packages, with private
# apt state, so that no privilege is needed and the machine's package lists stay as they are.
source="$(cd "$(dirname "$0")" && pwd)/ceres-solver.tar.xz"
cd "$work"
download_source() {
    mkdir -p lists/partial cache/archives/partial
    . /etc/os-release
    keyring=/usr/share/keyrings/debian-archive-keyring.gpg
    line="deb-src [signed-by=$keyring] \$(REPO_URI) \$(RELEASE) \$(COMPONENT)"
    apt-get indextargets --format "$line" \
        'Created-By: Packages' "Release: $VERSION_CODENAME" 'Component: main' | sort -u >sources.list
    if ! [ -s sources.list ]; then
        echo "ceres.sh: expected an apt source of Debian $VERSION_CODENAME main, found none" >&2
        exit 1
    fi
    private_apt_get update
    private_apt_get source --download-only ceres-solver
    mv ceres-solver_*.orig.tar.xz "$source"
}
private_apt_get() {
    apt-get -qq -o Dir::Etc::sourcelist="$PWD/sources.list" -o Dir::Etc::sourceparts=/dev/null \
        -o Dir::State::lists="$PWD/lists" -o Dir::State::status=/dev/null \
        -o Dir::Cache="$PWD/cache" -o APT::Sandbox::User=root "$@"
}
[ -e "$source" ] || download_source
tar -xf "$source"

# Only what a small dense problem needs. CUDA must be named, because Ceres links it where it finds
# it. At log level -3 the bundled miniglog prints nothing but the reason of an abort.
cmake -S ceres-solver-*/ -B build -G Ninja --log-level=WARNING -Wno-dev \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$prefix" -DCMAKE_INSTALL_LIBDIR=lib \
    -DCMAKE_CXX_STANDARD=17 -DCMAKE_CXX_FLAGS='-ffunction-sections -fdata-sections -w' \
    -DCMAKE_CXX_VISIBILITY_PRESET=hidden -DCMAKE_VISIBILITY_INLINES_HIDDEN=ON \
    -DBUILD_SHARED_LIBS=OFF -DCMAKE_POSITION_INDEPENDENT_CODE=ON \
    -DMINIGLOG=ON -DMINIGLOG_MAX_LOG_LEVEL=-3 -DGFLAGS=OFF \
    -DLAPACK=OFF -DSUITESPARSE=OFF -DCXSPARSE=OFF -DACCELERATESPARSE=OFF -DEIGENSPARSE=OFF \
    -DCUDA=OFF -DSCHUR_SPECIALIZATIONS=OFF \
    -DBUILD_TESTING=OFF -DBUILD_EXAMPLES=OFF -DBUILD_BENCHMARKS=OFF \
    -DBUILD_DOCUMENTATION=OFF -DPROVIDE_UNINSTALL_TARGET=OFF -DEXPORT_BUILD_DIR=OFF
cmake --build build --target install --parallel -- --quiet
cd /
rm -rf "$work"
echo "$script_sum" >"$stamp"
