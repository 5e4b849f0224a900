#pragma once
// The formats. Each writes the frames, then the lists that name them, and returns its notes.

#include <string>
#include <vector>

#include "dataset/export/parts.h"

namespace rugae {

/// rgb/, depth/ and the lists of the TUM RGB-D benchmark (Sturm et al., IROS 2012,
/// doi:10.1109/IROS.2012.6385773): metres, depth in 1/5000 m.
std::vector<std::string> export_tum(const ExportSource& source, Progress& progress);

/// images/ and a sparse model of COLMAP in text, sparse/0/ (Schoenberger and Frahm, CVPR 2016,
/// doi:10.1109/CVPR.2016.445): mm.
std::vector<std::string> export_colmap(const ExportSource& source, Progress& progress);

/// transforms.json of nerfstudio (Tancik et al., SIGGRAPH 2023, doi:10.1145/3588432.3591516):
/// metres, OpenGL camera axes.
std::vector<std::string> export_nerfstudio(const ExportSource& source, Progress& progress);

/// One folder of numbered files as in C3VD (Bobrow et al., Medical Image Analysis 90 (2023) 102956,
/// doi:10.1016/j.media.2023.102956): mm, depth up to 100 mm, flow up to 20 px.
std::vector<std::string> export_c3vd(const ExportSource& source, Progress& progress);

}  // namespace rugae
