#pragma once
// Reconstruction by any program: it is given the frames and leaves a path, and perhaps a map.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"

namespace rugae {

struct ExternalMethod {
  std::string name;
  std::vector<std::string> command;  // the program and its arguments

  /// Throws Error for no program, or for a word in braces that is none of
  ///   {frames}       folder of the images, 000000.png or .jpg and so on
  ///   {frame_list}   index,time_s,exposure_s,gain: a line a frame
  ///   {calibration}  the lens, YAML
  ///   {out}          folder for the results, empty at the start
  void check(const std::string& where) const;
};

/// Starts the program (no shell, the words above replaced), with its output in EST/command.log,
/// and makes an estimate of what it leaves in {out}:
///   trajectory.txt   TUM, world_from_camera, of the frames it could place, each at its time in
///                    frames.csv to within a twentieth of the time between frames
///   map.ply          optional, same world
/// Throws Error when it cannot be started, ends with an exit code other than 0, or leaves no
/// trajectory or one whose times are not the frames'.
/// `calibration` is a lens file in place of the dataset's own; empty: that.
void reconstruct_by(const ExternalMethod& method, const std::filesystem::path& dataset,
                    const std::filesystem::path& calibration, const std::filesystem::path& estimate,
                    Progress& progress);

}  // namespace rugae
