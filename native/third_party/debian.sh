# Sources and packages of Debian, for scripts to read (`.`): ceres.sh, ../cross/python.sh. The machine's own
# archive is asked, with private apt state in the working folder, so that no privilege is needed and the
# machine's package lists stay as they are.

private_apt_get() {
    apt-get -qq -o Dir::Etc::sourcelist="$PWD/sources.list" -o Dir::Etc::sourceparts=/dev/null \
        -o Dir::State::lists="$PWD/lists" -o Dir::State::status=/dev/null \
        -o Dir::Cache="$PWD/cache" -o APT::Sandbox::User=root "$@"
}

# know_debian TYPE [OPTION..]: what private_apt_get is to know, `deb` or `deb-src`; OPTION as apt-get's.
know_debian() {
    mkdir -p lists/partial cache/archives/partial
    . /etc/os-release
    keyring=/usr/share/keyrings/debian-archive-keyring.gpg
    line="$1 [signed-by=$keyring] \$(REPO_URI) \$(RELEASE) \$(COMPONENT)"
    shift
    apt-get indextargets --format "$line" \
        'Created-By: Packages' "Release: $VERSION_CODENAME" 'Component: main' | sort -u >sources.list
    if ! [ -s sources.list ]; then
        echo "debian.sh: expected an apt source of Debian $VERSION_CODENAME main, found none" >&2
        exit 1
    fi
    private_apt_get "$@" update
}
