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
# source package.
folder=$(cd "$(dirname "$0")" && pwd)
source="$folder/ceres-solver.tar.xz"
cd "$work"
if ! [ -e "$source" ]; then
    . "$folder/debian.sh"
    know_debian deb-src
    private_apt_get source --download-only ceres-solver
    mv ceres-solver_*.orig.tar.xz "$source"
fi
tar -xf "$source"

# Only what a small dense problem needs. CUDA must be named, because Ceres links it where it finds
# it. At log level -3 the bundled miniglog prints nothing but the reason of an abort, with the source
# file, whose folder is left out: wheels are the same wherever they are built.
cmake -S ceres-solver-*/ -B build -G Ninja --log-level=WARNING -Wno-dev \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$prefix" -DCMAKE_INSTALL_LIBDIR=lib \
    -DCMAKE_CXX_STANDARD=17 -DCMAKE_CXX_FLAGS="-ffunction-sections -fdata-sections -w '-ffile-prefix-map=$work=.'" \
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
