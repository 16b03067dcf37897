#!/bin/sh
# What a module for another machine's Python 3.11 is compiled and linked against. Usage: python.sh TARGET FOLDER.
# A folder that was already made by this very script is left alone.
set -eu

target=$1 folder=$2
here=$(cd "$(dirname "$0")" && pwd)
script_sum=$(sha256sum <"$0")
[ "$(cat "$folder/made-by" 2>/dev/null)" != "$script_sum" ] || exit 0

rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
. "$here/../third_party/debian.sh"

# Python itself too, to try the module under QEMU.
fetch_linux_arm64() {
    set -- -o APT::Architecture=arm64 -o APT::Architectures=arm64
    know_debian deb "$@"
    private_apt_get "$@" download libpython3.11-dev libpython3.11-minimal libpython3.11-stdlib \
        python3.11-minimal libexpat1 zlib1g
    for package in *.deb; do
        dpkg -x "$package" .
    done
}

# Windows has the same headers but for one, which the sources of Python have. Of python311.dll the linker
# is told what a Python for Linux exports: what Windows' lacks of these would show there alone.
fetch_windows_x64() {
    know_debian deb-src
    private_apt_get source --download-only python3.11
    cp -r /usr/include/python3.11 include
    tar -xf python3.11_*.orig.tar.* --strip-components 2 -C include --wildcards '*/PC/pyconfig.h'
    {
        echo 'LIBRARY python311.dll'
        echo 'EXPORTS'
        nm --dynamic --defined-only /usr/lib/x86_64-linux-gnu/libpython3.11.so.1.0 |
            sed -nE 's/^\S+ T (_?Py\S*)$/\1/p; s/^\S+ [BDR] (_?Py\S*)$/\1 DATA/p'
    } >python311.def
    x86_64-w64-mingw32-dlltool --input-def python311.def --output-lib libpython311.a
}

case $target in
linux-arm64) fetch_linux_arm64 ;;
windows-x64) fetch_windows_x64 ;;
esac
rm -rf cache lists ./*.deb python3.11_*
echo "$script_sum" >made-by
