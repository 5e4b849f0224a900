#!/usr/bin/env bash
# The whole loop: a stomach, a capsule's path through it, frames, a reconstruction, its errors, and a page to look at.
# demo.sh [OUT]; the page is OUT/report.html (default out/demo/report.html).
set -euo pipefail
out=${1:+$(realpath -m "$1")}  # where the caller stands
cd "$(dirname "$0")/.."
out=${out:-out/demo}
scripts/build.sh release rugae
begin=$(date +%s)
build/release/apps/rugae run studies/presets/demo.yaml --out "$out"
echo "the loop took $(($(date +%s) - begin)) s; open $out/report.html"
