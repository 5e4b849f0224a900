#pragma once
// Semi-global matching: Hirschmueller, PAMI 2008, doi:10.1109/TPAMI.2007.1166.

#include "recon/dense/sweep.h"

namespace rugae {

struct SmoothnessCost {
  float one = 0.0f;   // neighbours one label apart
  float more = 0.0f;  // farther apart
};

/// Costs 1 - score, each summed with the cheapest way to it along eight straight paths; mean over
/// the paths. A label without a score costs as much as the mean of the known ones of its pixel, so
/// that it neither draws nor repels.
ScoreVolume path_costs(const ScoreVolume& scores, const SmoothnessCost& smoothness);

}  // namespace rugae
