#!/usr/bin/env bash
# Gradescope runs this once, with a network, when the autograder is built.
set -euo pipefail
home=${AUTOGRADER:-/autograder}
cd "$(dirname "$0")"

command -v uv > /dev/null || python3 -m pip install uv || pip install --break-system-packages uv
uv venv --quiet --python 3.11 "$home/venv"
uv pip install --quiet --python "$home/venv" "$(echo crosscheck2d-*.whl)[js]"
# gl-matrix, which students' files may call: held to its version and SHA-512
CROSSCHECK_CACHE="$home/cache" "$home/venv/bin/python" -c "from crosscheck2d.adapters.npm_packages import fetch; fetch()"
