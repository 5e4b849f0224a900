// Simulates a small dataset: the program that another compiler builds and whose bytes must be the
// same (scripts/compare_compilers.sh).

#include <cstdio>

#include "core/check.h"
#include "core/progress.h"
#include "render/simulate.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: same_bytes TRAJECTORY OUT\n");
    return 2;
  }
  try {
    rugae::SimulateOptions options;
    options.resolution = "coarse";
    options.camera = "awaiba-naneye";
    options.trajectory = argv[1];
    options.frames = 12;
    rugae::Progress progress;
    rugae::simulate(options, argv[2], progress);
    return 0;
  } catch (const rugae::Error& error) {
    std::fprintf(stderr, "same_bytes: %s\n", error.what());
    return 1;
  }
}
