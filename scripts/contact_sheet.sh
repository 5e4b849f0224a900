#!/usr/bin/env bash
# One frame of everything the simulator can do, on one sheet: contact_sheet.sh [OUT]; the sheets are OUT/contact_sheet.png
# and OUT/labels.png (default out/contact_sheet/).
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-out/contact_sheet}
scripts/build.sh release rugae
mkdir -p "$out/frames"
pictures=()

# frame NAME INDEX OPTION...: that frame of a path of 720 frames.
frame() {
  local name=$1 index=$2 data="$out/data"
  shift 2
  rm -rf "$data"
  build/release/apps/rugae simulate --frames 720 --only-frame "$index" --out "$data" "$@" >/dev/null
  mv "$data/observations/frames/$(printf %06d "$index").png" "$out/frames/$name.png"
  pictures+=("$out/frames/$name.png")
}

for camera in awaiba-naneye misumi-v3506 misumi-v5506 potensic-mini; do frame "$camera" 200 --camera "$camera" --no-labels; done
for trajectory in 1 2 3 4 5 6; do frame "trajectory $trajectory" 480 --trajectory "$trajectory" --no-labels; done
frame "without noise" 480 --clean --no-labels
frame "dirty" 480 --options scripts/contact_sheet/dirty.yaml --no-labels
frame "two bounces" 480 --set light.bounces=2 light.samples=64 --no-labels
frame "lesions" 300 --scene scripts/contact_sheet/lesions.yaml --no-labels
frame "bubbles, mucus, debris" 300 --scene scripts/contact_sheet/objects.yaml --no-labels
for time in 0 150 300 450; do
  frame "peristalsis, $((time / 30)) s" "$time" --scene stomach-moving --trajectory scripts/contact_sheet/antrum.yaml --no-labels
done

frame "all labels" 480 --scene scripts/contact_sheet/lesions.yaml --set labels=true
build/release/apps/rugae picture "$out/data" --frame 480 --labels --out "$out/labels.png"
build/release/apps/rugae picture "${pictures[@]}" --columns 4 --out "$out/contact_sheet.png"
echo "open $out/contact_sheet.png and $out/labels.png"
