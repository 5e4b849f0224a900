#!/usr/bin/env bash
# One frame of everything the simulator can do, on one sheet: contact_sheet.sh [OUT]; the sheets are OUT/contact_sheet.jpg
# and OUT/labels.jpg (default out/contact_sheet/).
set -euo pipefail
out=${1:+$(realpath -m "$1")}  # where the caller stands
cd "$(dirname "$0")/.."
out=${out:-out/contact_sheet}
scripts/build.sh release rugae
mkdir -p "$out/frames"
pictures=()

# frame NAME INDEX OPTION...: that frame of a path of 720 frames, with its labels in OUT/data.
frame() {
  local name=$1 index=$2 data="$out/data"
  shift 2
  rm -rf "$data"
  build/release/apps/rugae simulate --frames 720 --only-frame "$index" --out "$data" "$@" >/dev/null
  cp "$data/observations/frames/$(printf %06d "$index").png" "$out/frames/$name.png"
  pictures+=("$out/frames/$name.png")
}

for camera in awaiba-naneye misumi-v3506 misumi-v5506 potensic-mini; do frame "$camera" 200 --camera "$camera"; done
for trajectory in 1 2 3 4 5 6; do frame "trajectory $trajectory" 480 --trajectory "$trajectory"; done
frame "6 without oil and noise" 480 --trajectory scripts/contact_sheet/6-without-oil.yaml --clean
frame "lens, sensor, exposure" 480 --trajectory 4 --set lens.samples=16 lens.motion_blur=true lens.defocus=true \
  sensor.bayer=rggb sensor.prnu=true sensor.dsnu=true
frame "no interreflection" 350 --set light.bounces=0
frame "two bounces" 350 --set light.bounces=2 light.samples=64
frame "mucus, bubbles, debris" 200 --scene stomach-unclean
frame "lesions" 200 --scene stomach-lesions
for second in 0 5 10 15; do  # one wave passes every 20 s
  frame "peristalsis, $second s" $((30 * second)) --scene stomach-moving --trajectory scripts/contact_sheet/standing.yaml
done

frame "all labels" 200 --scene stomach-lesions --all-labels --set light.bounces=1 light.samples=64
build/release/apps/rugae picture "$out/data" --frame 200 --labels --out "$out/labels.jpg"
build/release/apps/rugae picture "${pictures[@]::${#pictures[@]}-1}" --columns 4 --out "$out/contact_sheet.jpg"
rm -rf "$out/data"
echo "open $out/contact_sheet.jpg and $out/labels.jpg"
