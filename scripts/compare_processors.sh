#!/usr/bin/env bash
# Does an older processor make the same frames? compare_processors.sh SAME_BYTES FOLDER
# FOLDER holds the manifests that SAME_BYTES made on this processor (same_bytes.sh, WHO "reference"). The C library and
# OpenCV choose their code by what the processor can do; here they are told that it can do less. (The ray tracer's
# instruction sets are compared by the tests of render/.)
set -euo pipefail
GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX512F OPENCV_CPU_DISABLE=AVX2,AVX,FP16 \
  "$(dirname "$0")/same_bytes.sh" "$1" "$2" older
