# Sourced by the other scripts: find a Python, keep a virtual environment with fpmatch in it.

cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Print the path of a Python that can make environments: $PYTHON if set, else the first that suits.
find_python() {
    local candidate
    for candidate in ${PYTHON:-python3.13 python3.12 python3.11 python3 python3.14 python}; do
        if "$candidate" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' \
            >/dev/null 2>&1; then
            command -v "$candidate"
            return
        fi
    done
    echo "fpmatch needs Python 3.11 or newer with its venv module; none was found." >&2
    echo "Install one (on Debian or Ubuntu: apt install python3-venv) or name it: PYTHON=... $0" >&2
    return 1
}

# Print a fingerprint of this folder's path and of the given files.
fingerprint() {
    { pwd; cat "$@"; } | cksum
}

# make_venv FOLDER: make the virtual environment where it is missing or broken.
make_venv() {
    if ! "$1/bin/python" -m pip --version >/dev/null 2>&1; then
        local python
        python=$(find_python)
        echo "Making $1 with $python" >&2
        "$python" -m venv --clear "$1"
    fi
}

# installed FOLDER NAME STATE: whether FOLDER keeps a note NAME that says STATE.
installed() {
    [[ -f $1/.fpmatch-$2 && $(<"$1/.fpmatch-$2") == "$3" ]]
}

# is_editable: whether .venv runs the fpmatch of this folder; says where it is a copy, as `pip
# install .` makes it.
is_editable() {
    .venv/bin/python -I -c 'import sys
from importlib.util import find_spec
from pathlib import Path
found = find_spec("fpmatch")
if not found or not found.origin:
    sys.exit(1)
folder = Path(found.origin).parent
if not folder.samefile("fpmatch"):
    sys.exit(f"{folder} is a copy of fpmatch; this folder takes its place")'
}

# install FOLDER NAME STATE PIP-ARGUMENTS...: pip install, and leave the note NAME that says STATE.
install() {
    local folder=$1 name=$2 state=$3
    shift 3
    echo "Installing fpmatch into $folder (a minute or two the first time)" >&2
    FPMATCH_NO_COMPILE=1 "$folder/bin/python" -m pip install --quiet --disable-pip-version-check "$@"
    echo "$state" >"$folder/.fpmatch-$name"
}

# compile_kernels: compile the kernels that changed, in place, for .venv, where there is a compiler.
compile_kernels() {
    mkdir -p build
    if ! .venv/bin/python setup.py build_ext --inplace >build/kernels.log 2>&1; then
        tail -n 20 build/kernels.log >&2
        echo "The kernels could not be compiled; build/kernels.log has all of this output." >&2
        return 1
    fi
}

# install_editable run|plot|web|docs|test|dev: install this folder into .venv, compiled where there is
# a compiler, with what running, plotting, serving, documenting, testing or developing needs, unless
# it is there, or more.
install_editable() {
    make_venv .venv
    local state enough
    state=$(fingerprint pyproject.toml)
    case $1 in
    run) enough="run plot web docs test dev" ;;
    plot) enough="plot dev" ;;
    web) enough="web test dev" ;;
    docs) enough="docs dev" ;;
    test) enough="test dev" ;;
    *) enough=$1 ;;
    esac
    if ! is_editable; then
        enough=""
    fi
    for name in $enough; do
        if installed .venv "$name" "$state"; then
            compile_kernels
            return
        fi
    done
    local extra="[$1]" build
    if [[ $1 == run ]]; then extra=""; fi
    build=$(.venv/bin/python -c 'import tomllib
print(*tomllib.load(open("pyproject.toml", "rb"))["build-system"]["requires"])')
    # shellcheck disable=SC2086  # several requirements
    install .venv "$1" "$state" $build --editable ".$extra"
    compile_kernels
    # pip does this for what it copies; where Python may write no bytecode, every start would
    .venv/bin/python -m compileall -q fpmatch
}

# install_interpreted: install a copy of this folder into .venv-interpreted, with no kernel compiled.
install_interpreted() {
    make_venv .venv-interpreted
    local state
    # shellcheck disable=SC2046
    state=$(fingerprint pyproject.toml setup.py $(find fpmatch -name '*.p*' -not -name '*.pyc' | sort) \
        $(find fpmatch -name '*.json' -o -path '*/static/*' | sort))
    if ! installed .venv-interpreted test "$state"; then
        rm -rf build/lib # would carry files into the copy that are no longer here
        install .venv-interpreted test "$state" ".[test]"
    fi
}
