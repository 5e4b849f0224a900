#include "dataset/frame_images.h"

#include "core/check.h"
#include "dataset/image_io.h"

namespace rugae {
namespace fs = std::filesystem;

std::vector<fs::path> image_files(const DatasetLayout& layout, const ImageFiles& files, int index) {
  std::vector<fs::path> paths;
  if (files.adc) paths.push_back(layout.adc(index));
  if (files.mosaic) paths.push_back(layout.mosaic(index));
  if (files.radiance) paths.push_back(layout.radiance(index));
  if (files.clean) paths.push_back(layout.clean(index));
  paths.push_back(files.jpeg ? layout.jpeg_frame(index) : layout.png_frame(index));
  return paths;
}

void write_images(const DatasetLayout& layout, const ImageFiles& files, int index,
                  const cv::Mat& bgr8, const ExtraImages& extra) {
  const auto checked = [&](const cv::Mat& image, int type, const char* name) {
    check(image.type() == type && image.size() == bgr8.size(),
          "frame {}: {} is {} x {} of {}, expected {} x {} of {}", index, name, image.cols,
          image.rows, cv::typeToString(image.type()), bgr8.cols, bgr8.rows, cv::typeToString(type));
    return image;
  };
  if (files.adc) write_image(layout.adc(index), checked(extra.adc_bgr, CV_16UC3, "adc"));
  if (files.mosaic) write_image(layout.mosaic(index), checked(extra.mosaic, CV_16UC1, "mosaic"));
  if (files.radiance)
    write_radiance(layout.radiance(index), checked(extra.radiance, CV_32FC3, "radiance"));
  if (files.clean) write_image(layout.clean(index), checked(extra.clean, CV_8UC3, "clean"));
  if (files.jpeg)
    write_image(layout.jpeg_frame(index), bgr8, files.jpeg_quality);
  else
    write_image(layout.png_frame(index), bgr8);
}

}  // namespace rugae
