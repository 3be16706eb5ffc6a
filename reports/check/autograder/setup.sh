#!/usr/bin/env bash
# Gradescope runs this once, with a network, when the autograder is built.
set -euo pipefail
home=${AUTOGRADER:-/autograder}
cd "$(dirname "$0")"

if ! command -v g++ > /dev/null; then  # box2d-py is built from source
  apt-get update
  apt-get install -y g++
fi
command -v uv > /dev/null || python3 -m pip install uv || pip install --break-system-packages uv
uv venv --quiet --python 3.11 "$home/venv"
# uv.toml names what the build of box2d-py needs
uv pip install --quiet --config-file uv.toml --python "$home/venv" "$(echo crosscheck2d-*.whl)[js]"
# gl-matrix, which students' files may call: held to its version and SHA-512
CROSSCHECK_CACHE="$home/cache" "$home/venv/bin/python" -c "from crosscheck2d.adapters.npm_packages import fetch; fetch()"
