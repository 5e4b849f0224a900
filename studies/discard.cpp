#include "studies/discard.h"

#include <algorithm>
#include <set>
#include <system_error>

#include "core/check.h"
#include "dataset/layout.h"
#include "dataset/writer.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

void remove_tree(const fs::path& what) {
  std::error_code error;
  fs::remove_all(what, error);
  check(!error, "{}: cannot be removed: {}", what.string(), error.message());
}

// What one cell needs; `frames` are the dataset itself for most.
std::vector<fs::path> parts_of(const CellJob& job) {
  std::vector<fs::path> parts{job.files.dataset, job.files.estimate};
  if (job.files.frames != job.files.dataset) parts.push_back(job.files.frames);
  if (!job.files.motion.empty()) parts.push_back(job.files.motion);
  return parts;
}

bool failed(const CellJob& job) { return read_json(job.files.metrics).contains("failed"); }

// The manifest goes first: what is left is then no finished dataset.
void strip(const fs::path& dataset) {
  const DatasetLayout layout{dataset};
  if (!fs::exists(layout.manifest())) return;
  const fs::path shown = layout.frame(frame_of_sheet(dataset));
  remove_tree(layout.manifest());
  const auto keep = [&](const fs::path& file) { return file == layout.info() || file == shown; };
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(dataset))
    if (!entry.is_directory() && !keep(entry.path())) files.push_back(entry.path());
  for (const fs::path& file : files) remove_tree(file);
}

}  // namespace

int frame_of_sheet(const fs::path& dataset) {
  return read_info(DatasetLayout{dataset}.info()).frames / 3;
}

void discard_finished(const std::vector<CellJob>& jobs) {
  const auto keeps_all = [](const CellJob& job) { return job.study->keep == Keep::all; };
  if (std::ranges::all_of(jobs, keeps_all)) return;
  const auto head = std::ranges::find_if(
      jobs, [](const CellJob& job) { return !job.files.finished() || !failed(job); });
  std::set<fs::path> wanted;
  for (auto job = jobs.begin(); job != jobs.end(); ++job)
    if (job == head || keeps_all(*job) || !job->files.finished())
      for (const fs::path& part : parts_of(*job)) wanted.insert(part);
  for (const CellJob& job : jobs) {
    for (const fs::path& part : parts_of(job)) {
      if (wanted.contains(part) || !fs::exists(part)) continue;
      if (part == job.files.dataset || part == job.files.frames)
        strip(part);
      else
        remove_tree(part);
    }
  }
}

}  // namespace rugae
