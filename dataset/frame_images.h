#pragma once
// The pictures of a frame: the observation as displayed, and what may stand beside it.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "dataset/layout.h"

namespace rugae {

/// Which pictures a dataset has.
struct ImageFiles {
  bool jpeg = false;  // the frames; false: PNG
  int jpeg_quality = 90;
  bool adc = false, mosaic = false, radiance = false, clean = false;
};

/// Pictures of the frame's size, empty where the dataset has none.
struct ExtraImages {
  cv::Mat adc_bgr;   // CV_16UC3: the converter's numbers
  cv::Mat mosaic;    // CV_16U: the same, one a photosite
  cv::Mat radiance;  // CV_32FC3, RGB: linear light on the sensor, 1 = full scale of the converter
  cv::Mat clean;     // CV_8UC3: the frame from a sensor without faults
};

/// The files of one frame, the observation last.
std::vector<std::filesystem::path> image_files(const DatasetLayout& layout, const ImageFiles& files,
                                               int index);
/// Writes them in that order. Throws Error naming a picture that is not as it should be.
void write_images(const DatasetLayout& layout, const ImageFiles& files, int index,
                  const cv::Mat& bgr8, const ExtraImages& extra);

}  // namespace rugae
