# Sets the project up in .venv; sourced by the other scripts. Does nothing that is done already.
# A fresh Debian with Python 3.11 is enough; what else is missing comes through apt if we may use it.

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

_find_python() {
    local python
    for python in python3.11 python3.12 python3; do
        if "$python" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 13))' 2>/dev/null; then
            echo "$python"
            return
        fi
    done
    _note "No Python 3.11 or 3.12 found: install python3.11"
    return 1
}

# Whether MuJoCo can draw without a display, by the means that it would choose.
_can_render() {
    local gl
    for gl in ${MUJOCO_GL:-egl osmesa}; do
        if MUJOCO_GL="$gl" .venv/bin/python -c 'import mujoco; mujoco.GLContext(64, 64).make_current()' 2>/dev/null; then
            return 0
        fi
    done
    return 1
}

_set_up() {
    local python stamp wanted
    if ! .venv/bin/python -c 'import pip' 2>/dev/null; then
        python=$(_find_python) || return 1
        # Debian keeps what venv needs in a package of its own.
        if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
            _apt_install python3-venv || { _note "Python has no venv: install python3-venv"; return 1; }
        fi
        _note "Making .venv ..."
        "$python" -m venv --clear .venv
    fi

    # The path is in the stamp for an editable installation knows where it was made.
    stamp=.venv/installed
    wanted=$(pwd; .venv/bin/python --version; cat pyproject.toml constraints.txt)
    if [ "$(cat "$stamp" 2>/dev/null)" != "$wanted" ]; then
        _note "Installing the packages ..."
        .venv/bin/python -m pip install -qq --disable-pip-version-check -e ".[test]" -c constraints.txt
        printf '%s\n' "$wanted" > "$stamp"
    fi

    if ! _can_render; then
        _apt_install libegl1 libgl1-mesa-dri || true
        _can_render || _note "No OpenGL to draw with: install libegl1 and libgl1-mesa-dri"
    fi
}

_set_up
export PATH="$PWD/.venv/bin:$PATH"
