#!/usr/bin/env bash
# Make .venv with everything the project needs; `make setup` calls this when something changed.
# Another Python: PYTHON=/path/to/python3.12 make setup
set -euo pipefail
cd "$(dirname "$0")/.."

started=$SECONDS
echo "Setting up .venv: one to three minutes, most of it downloads; 4 GB of disk."

fail() { echo "error: $*" >&2; exit 1; }

# apt WHY PACKAGE...: install packages where we may, else print the command and stop.
apt() {
    local why=$1 install="apt-get install -y --no-install-recommends ${*:2}"
    if ! command -v apt-get >/dev/null; then
        fail "$why: install what Debian calls ${*:2}, then run make again"
    elif [ "$(id -u)" != 0 ]; then
        fail "$why. Run: sudo sh -c 'apt-get update && $install', then make again"
    fi
    apt-get update -q >&2 && DEBIAN_FRONTEND=noninteractive $install >&2
}

# Shims answer to names that they cannot run, so each candidate is run.
python=""
for candidate in ${PYTHON:-python3.12 python3.11 python3}; do
    if "$candidate" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))' \
        2>/dev/null; then
        python=$candidate
        break
    fi
done
[ -n "$python" ] || fail "Python 3.11, 3.12 or 3.13 is needed and ${PYTHON:-python3} is not;" \
    "install one, or name it: PYTHON=/path/to/python3.12 make setup"

if [ ! -x .venv/bin/pip ]; then
    "$python" -c 'import ensurepip' 2>/dev/null ||
        apt "Python's venv is missing" "$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')"
    rm -rf .venv
    "$python" -m venv .venv
fi
# Python compiles what is imported, a small part of it; but where it may keep nothing, it would each time.
compile=()
[ -z "${PYTHONDONTWRITEBYTECODE:-}" ] || compile=(--compile-bytecode)
everything=(-q -e '.[dev]' -c constraints.txt)

# setting NAME: what pip's files and environment say of an option, else nothing.
setting() { sed -n "s/^[^=]*\.$1='\(.*\)'\$/\1/p" <<<"$settings" | head -n 1; }

# uv does in half a minute what takes pip two; it looks for packages where pip would. Which build of
# torch that is pip alone knows.
with_uv() {
    local settings index more links certificates
    .venv/bin/pip install --disable-pip-version-check -q -c constraints.txt "${compile[@]/#*/--compile}" torch uv ||
        return
    settings=$(.venv/bin/pip config list)
    index=$(setting index-url) more=$(setting extra-index-url)
    links=$(setting find-links) certificates=$(setting cert)
    env ${index:+UV_DEFAULT_INDEX="$index"} ${more:+UV_INDEX="$more"} \
        ${links:+UV_FIND_LINKS="${links// /,}"} ${certificates:+SSL_CERT_FILE="$certificates"} \
        .venv/bin/uv pip install --python .venv/bin/python --index-strategy unsafe-best-match \
        "${compile[@]}" "${everything[@]}"
}
with_uv || .venv/bin/pip install --disable-pip-version-check "${compile[@]/#*/--compile}" "${everything[@]}"

needs_libraries() { ! .venv/bin/python -c 'import open3d' >/dev/null 2>.venv/open3d.log; }
if needs_libraries; then
    grep -q 'cannot open shared object' .venv/open3d.log || fail "$(tail -n 1 .venv/open3d.log)"
    apt "Open3D needs system libraries" libgl1 libegl1 libgomp1 libidn2-0 libusb-1.0-0 libx11-6
    ! needs_libraries || fail "$(tail -n 1 .venv/open3d.log)"
fi
touch .venv/ready
took=$((SECONDS - started)) size=$(du -sh .venv | cut -f 1)
echo "Done in $((took / 60)) min $((took % 60)) s, .venv is $size. Next: make demo, or source .venv/bin/activate"
