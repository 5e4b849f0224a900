#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "dataset/observations.h"
#include "dataset/truth.h"
#include "recon/preprocess/preprocess.h"
#include "recon/preprocess/reflections.h"
#include "render/radiance.h"
#include "studies/measure.h"
#include "studies/measure_parts.h"
#include "validate/mask_error.h"

namespace rugae {
namespace {

using nlohmann::json;

// The mean over those frames that have one.
class MeanScore {
 public:
  void add(const std::optional<double>& score) {
    if (!score) return;
    sum_ += *score;
    ++count_;
  }
  json to_json() const { return known(sum_ / static_cast<double>(count_), count_); }

 private:
  double sum_ = 0.0;
  std::size_t count_ = 0;
};

json scores(const MaskError& error) {
  return {{"precision", known(error.precision())},
          {"recall", known(error.recall())},
          {"f1", known(error.f1())},
          {"iou", known(error.iou())}};
}

json with_true_share(const MaskError& error) {
  json out = scores(error);
  out["true_share"] = known(
      static_cast<double>(error.truly()) / static_cast<double>(error.pixels()), error.pixels());
  return out;
}

struct FrameResult {
  MaskError all, saturated, unsaturated;
  std::vector<MaskError> by_share;
};

// The wet layer's share of every pixel's luminance; 0 where no light comes.
cv::Mat specular_share(const Truth& truth, int index, bool indirect) {
  const cv::Mat specular = truth.label("specular", index), diffuse = truth.label("diffuse", index);
  const cv::Mat more = indirect ? truth.label("indirect", index) : cv::Mat();
  cv::Mat share(specular.size(), CV_32F);
  for (int y = 0; y < share.rows; ++y)
    for (int x = 0; x < share.cols; ++x) {
      const auto s = specular.at<float>(y, x);
      cv::Vec3f all = diffuse.at<cv::Vec3f>(y, x) + cv::Vec3f(s, s, s);
      if (indirect) all += more.at<cv::Vec3f>(y, x);
      const float light = luminance(all[0], all[1], all[2]);
      share.at<float>(y, x) = light > 0.0f ? s / light : 0.0f;
    }
  return share;
}

std::string name_of_share(double share) { return fmt::format("above_{:g}_percent", 100.0 * share); }

}  // namespace

void ReflectionMeasureOptions::check() const {
  reflections.check();
  for (const double share : shares)
    rugae::check(share > 0.0 && share < 1.0, "reflections: a share is {}, expected within 0 and 1",
                 share);
}

json measure_reflections(const std::filesystem::path& dataset,
                         const ReflectionMeasureOptions& options, Progress& progress) {
  options.check();
  const Truth truth = Truth::open(dataset);
  const Observations observations = Observations::open(dataset);
  check(observations.size() == truth.size(), "{}: {} frames and {} true poses", dataset.string(),
        observations.size(), truth.size());
  const DatasetSettings made = dataset_settings(dataset);
  const bool indirect = made.render.light.bounces > 0;
  const bool split =
      made.labels.diffuse && made.labels.specular && (made.labels.indirect || !indirect);
  const cv::Mat field = FrameSource(observations, as_observed()).field();

  const auto frame = [&](int index) {
    FrameResult result;
    cv::Mat gray;
    cv::cvtColor(observations.image(index), gray, cv::COLOR_BGR2GRAY);
    const cv::Mat found = detect_reflections(gray, options.reflections, field);
    const cv::Mat masks = truth.masks(index);
    const cv::Mat specular = masks & kMaskSpecular, saturated = masks & kMaskSaturated;
    result.all = mask_error(found, specular, field);
    result.saturated = mask_error(found, specular, field & (saturated > 0));
    result.unsaturated = mask_error(found, specular, field & (saturated == 0));
    if (!split) return result;
    const cv::Mat share = specular_share(truth, index, indirect);
    for (const double least : options.shares)
      result.by_share.push_back(mask_error(found, share > least, field));
    return result;
  };

  progress.begin("reflections", static_cast<std::size_t>(truth.size()));
  FrameResult sum;
  sum.by_share.resize(options.shares.size());
  MeanScore precision, recall, f1, iou;
  int with_true = 0, with_found = 0;
  const auto add = [&](const FrameResult& result) {
    sum.all += result.all;
    sum.saturated += result.saturated;
    sum.unsaturated += result.unsaturated;
    for (std::size_t k = 0; k < result.by_share.size(); ++k) sum.by_share[k] += result.by_share[k];
    precision.add(result.all.precision());
    recall.add(result.all.recall());
    f1.add(result.all.f1());
    iou.add(result.all.iou());
    with_true += result.all.truly() > 0 ? 1 : 0;
    with_found += result.all.found() > 0 ? 1 : 0;
  };
  in_batches(truth.size(), progress, frame, add);
  progress.end();

  json curve;
  if (split)
    for (std::size_t k = 0; k < options.shares.size(); ++k)
      curve[name_of_share(options.shares[k])] = with_true_share(sum.by_share[k]);
  json out = with_true_share(sum.all);
  const json true_share = out["true_share"];
  out.erase("true_share");
  return {{"reflections",
           {{"frames", truth.size()},
            {"frames_with_true", with_true},
            {"frames_with_found", with_found},
            {"true_share", true_share},
            {"found_share",
             known(static_cast<double>(sum.all.found()) / static_cast<double>(sum.all.pixels()),
                   sum.all.pixels())},
            {"pooled", out},
            {"mean",
             {{"precision", precision.to_json()},
              {"recall", recall.to_json()},
              {"f1", f1.to_json()},
              {"iou", iou.to_json()}}},
            {"saturated", with_true_share(sum.saturated)},
            {"unsaturated", with_true_share(sum.unsaturated)},
            {"by_share", curve}}}};
}

}  // namespace rugae
