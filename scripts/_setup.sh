# Sets the project up in .venv; sourced by the other scripts. Does nothing that is done already. With the environment
# variable PYTHON, an interpreter, it takes that one, and .venv-3.13 or as its version is.
# A fresh Debian with Python 3.11 to 3.14 is enough; what else is missing comes through apt if we may use it.

cd "$(dirname "${BASH_SOURCE[0]}")/.."

_note() { printf '%s\n' "$*" >&2; }

# Installs Debian packages; fails where we are neither root nor have sudo without a password.
_apt_install() {
    local root=()
    command -v apt-get >/dev/null || return 1
    if [ "$(id -u)" -ne 0 ]; then
        sudo -n true 2>/dev/null || return 1
        root=(sudo -n)
    fi
    _note "Installing $* with apt ..."
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq update >/dev/null &&
        "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends "$@" >/dev/null
}

# The version of an interpreter, if it is supported.
_version() {
    "$1" -c 'import sys; v = sys.version_info; (3, 11) <= v < (3, 15) and print(f"{v[0]}.{v[1]}")' 2>/dev/null
}

# The supported interpreters on the path and pyenv's, one a version, oldest first.
_pythons() {
    local version python
    for version in 3.11 3.12 3.13 3.14; do
        for python in "python$version" python3 "${PYENV_ROOT:-$HOME/.pyenv}/versions/$version".*/bin/python3; do
            if [ "$(_version "$python")" = "$version" ]; then
                echo "$python"
                break
            fi
        done
    done
}

_find_python() {
    local python
    python=${PYTHON:-$(_pythons | sed -n 1p)}
    if [ -z "$(_version "${python:-none}")" ]; then
        _note "Python must be 3.11, 3.12, 3.13 or 3.14, got ${python:-none}: install one, or name it in PYTHON"
        return 1
    fi
    echo "$python"
}

# Whether MuJoCo can draw without a display, by the means that it would choose.
_can_render() {
    local gl
    for gl in ${MUJOCO_GL:-egl osmesa}; do
        if MUJOCO_GL="$gl" "$_venv/bin/python" -c 'import mujoco; mujoco.GLContext(64, 64).make_current()' 2>/dev/null; then
            return 0
        fi
    done
    return 1
}

_set_up() {
    local python stamp wanted
    _venv=.venv
    if [ -n "${PYTHON:-}" ]; then
        python=$(_find_python) || return 1
        _venv=.venv-$(_version "$python")
    fi
    if [ -z "$(_version "$_venv/bin/python")" ] || ! "$_venv/bin/python" -c 'import pip' 2>/dev/null; then
        python=$(_find_python) || return 1
        # Debian keeps what venv needs in a package of its own.
        if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
            _apt_install python3-venv || { _note "Python has no venv: install python3-venv"; return 1; }
        fi
        _note "Making $_venv ..."
        "$python" -m venv --clear "$_venv"
    fi

    # The path is in the stamp for an editable installation knows where it was made.
    stamp=$_venv/installed
    wanted=$(pwd; "$_venv/bin/python" --version; cat pyproject.toml constraints.txt)
    if [ "$(cat "$stamp" 2>/dev/null)" != "$wanted" ]; then
        _note "Installing the packages ..."
        rm -f "$stamp"  # others may look for what is whole
        "$_venv/bin/python" -m pip install -qq --disable-pip-version-check -e ".[test]" -c constraints.txt
        # From Python 3.13 on it is no requirement: see pyproject.toml.
        "$_venv/bin/python" -m pip install -qq --disable-pip-version-check --no-deps dm_control -c constraints.txt
        printf '%s\n' "$wanted" > "$stamp"
    fi

    if ! _can_render; then
        _apt_install libegl1 libgl1-mesa-dri || true
        _can_render || _note "No OpenGL to draw with: install libegl1 and libgl1-mesa-dri"
    fi
}

_set_up
export PATH="$PWD/$_venv/bin:$PATH"
