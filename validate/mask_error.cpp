#include "validate/mask_error.h"

#include "core/check.h"

namespace rugae {
namespace {

std::optional<double> share(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

std::optional<double> MaskError::precision() const { return share(both, found()); }
std::optional<double> MaskError::recall() const { return share(both, truly()); }
std::optional<double> MaskError::f1() const { return share(2 * both, found() + truly()); }
std::optional<double> MaskError::iou() const { return share(both, found() + true_only); }

MaskError& MaskError::operator+=(const MaskError& other) {
  both += other.both;
  found_only += other.found_only;
  true_only += other.true_only;
  neither += other.neither;
  return *this;
}

MaskError mask_error(const cv::Mat& found, const cv::Mat& truly, const cv::Mat& where) {
  for (const cv::Mat* mask : {&found, &truly, &where})
    check((mask == &where && where.empty()) ||
              (mask->type() == CV_8U && mask->size() == found.size()),
          "mask error: a mask of {} x {} px of {}, expected {} x {} of CV_8UC1", mask->cols,
          mask->rows, cv::typeToString(mask->type()), found.cols, found.rows);
  MaskError error;
  for (int y = 0; y < found.rows; ++y) {
    const auto* f = found.ptr<unsigned char>(y);
    const auto* t = truly.ptr<unsigned char>(y);
    const auto* w = where.empty() ? nullptr : where.ptr<unsigned char>(y);
    for (int x = 0; x < found.cols; ++x) {
      if (w && !w[x]) continue;
      ++(f[x] ? (t[x] ? error.both : error.found_only) : (t[x] ? error.true_only : error.neither));
    }
  }
  return error;
}

}  // namespace rugae
