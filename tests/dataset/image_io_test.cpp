#include "dataset/image_io.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "core/files.h"
#include "core/random.h"
#include "dataset/image_whole.h"
#include "tests/dataset/plane_dataset.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;
using testing::error_of;
using testing::TemporaryFolder;

cv::Mat noise(int type, std::uint64_t seed) {
  cv::Mat image(37, 53, type);
  const std::size_t bytes = image.total() * image.elemSize();
  for (std::size_t i = 0; i < bytes; ++i)
    image.data[i] = static_cast<unsigned char>(random_words(seed, Purpose::test, 0, i)[0]);
  return image;
}

// Smooth float fields with NaN in a corner, as labels are.
cv::Mat field(int channels) {
  cv::Mat image(37, 53, CV_MAKETYPE(CV_32F, channels));
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols * channels; ++x)
      image.ptr<float>(y)[x] = x < 6 && y < 5
                                   ? NAN
                                   : 30.0f + 7.0f * std::sin(0.1f * static_cast<float>(x * y)) +
                                         0.1f * static_cast<float>(x % channels);
  return image;
}

bool same_bits(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && a.isContinuous() && b.isContinuous() &&
         std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

void cut(const fs::path& file, std::size_t keep) { fs::resize_file(file, keep); }

void flip_byte(const fs::path& file, std::size_t at) {
  std::string bytes = read_text(file);
  bytes.at(at) = static_cast<char>(bytes.at(at) ^ 0x20);
  write_atomic(file, bytes);
}

TEST(ImageIo, PngGivesBackTheSamePixels) {
  const TemporaryFolder folder("png");
  const fs::path file = folder.path() / "a.png";
  const cv::Mat colour = noise(CV_8UC3, 1), gray = noise(CV_8UC1, 2), deep = noise(CV_16UC3, 3);
  write_image(file, colour);
  EXPECT_TRUE(same_bits(read_image_bgr(file), colour));
  write_image(file, gray);
  EXPECT_TRUE(same_bits(read_image_gray(file), gray));
  EXPECT_TRUE(same_bits(read_image_as_stored(file), gray));
  write_image(file, deep);
  EXPECT_TRUE(same_bits(read_image_as_stored(file), deep));
}

TEST(ImageIo, ExrGivesBackTheSameBits) {
  const TemporaryFolder folder("exr");
  const fs::path file = folder.path() / "a.exr";
  for (const int channels : {1, 2, 3}) {
    const cv::Mat image = field(channels);
    write_exr(file, image);
    EXPECT_TRUE(same_bits(read_exr(file), image)) << channels << " channels";
  }
}

TEST(ImageIo, TheSamePixelsGiveTheSameBytes) {
  const TemporaryFolder folder("bytes");
  const auto twice = [&folder](const char* name, const auto& write) {
    const fs::path a = folder.path() / "a" / name, b = folder.path() / "b" / name;
    fs::create_directories(a.parent_path());
    fs::create_directories(b.parent_path());
    write(a);
    std::this_thread::sleep_for(std::chrono::milliseconds(1010));  // times are noted in seconds
    write(b);
    EXPECT_EQ(sha256_of_file(a), sha256_of_file(b)) << name;
    for (const char* word : {"rugae_test", "host", "OpenImageIO"})
      EXPECT_EQ(read_text(a).find(word), std::string::npos) << name << " holds " << word;
  };
  twice("x.png", [](const fs::path& f) { write_image(f, noise(CV_8UC3, 1)); });
  twice("x.jpg", [](const fs::path& f) { write_image(f, noise(CV_8UC3, 1)); });
  twice("x.exr", [](const fs::path& f) { write_exr(f, field(2)); });
}

TEST(ImageIo, PartOfAnotherImageIsWrittenAsItself) {
  const TemporaryFolder folder("roi");
  const cv::Mat whole = field(3), part = whole(cv::Rect(7, 9, 20, 11));
  write_exr(folder.path() / "a.exr", part);
  EXPECT_TRUE(same_bits(read_exr(folder.path() / "a.exr"), part.clone()));
}

TEST(ImageIo, NormalsKeepTheirDirection) {
  const TemporaryFolder folder("normals");
  const fs::path file = folder.path() / "n.png";
  cv::Mat normal(64, 64, CV_32FC3);
  for (int i = 0; i < 64 * 64; ++i) {
    const auto r = random_normal(4, Purpose::test, 0, static_cast<std::uint64_t>(i));
    const cv::Vec3d n(r[0], r[1], r[2]);
    normal.at<cv::Vec3f>(i / 64, i % 64) = n / cv::norm(n);
  }
  // The axes themselves are the ends of the code; a pixel without a normal stays without.
  normal.at<cv::Vec3f>(0, 0) = {0, 0, -1};
  normal.at<cv::Vec3f>(0, 1) = {1, 0, 0};
  normal.at<cv::Vec3f>(0, 2) = {NAN, NAN, NAN};
  write_normals(file, normal);
  const cv::Mat back = read_normals(file);
  constexpr double kRounding_rad = 2.8e-5;  // sqrt(3) half steps of 1/32767, and float32
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const cv::Vec3f a = normal.at<cv::Vec3f>(y, x), b = back.at<cv::Vec3f>(y, x);
      if (std::isnan(a[0])) {
        EXPECT_TRUE(std::isnan(b[0]) && std::isnan(b[1]) && std::isnan(b[2]));
        continue;
      }
      const cv::Vec3d cross = cv::Vec3d(a).cross(cv::Vec3d(b));
      EXPECT_TRUE(cv::norm(cross) <= kRounding_rad && a.dot(b) > 0) << x << " " << y;
      EXPECT_NEAR(cv::norm(cv::Vec3d(b)), 1.0, 1e-6);  // float32
    }
}

TEST(ImageIo, ATruncatedFileIsNamed) {
  const TemporaryFolder folder("cut");
  const cv::Mat image = noise(CV_8UC3, 5);
  const fs::path png = folder.path() / "a.png", jpg = folder.path() / "a.jpg",
                 bmp = folder.path() / "a.bmp", exr = folder.path() / "a.exr";
  const auto write_all = [&] {
    write_image(png, image);
    write_image(jpg, image);
    ASSERT_TRUE(cv::imwrite(bmp.string(), image));
    write_exr(exr, field(2));
  };
  write_all();
  for (const fs::path& file : {png, jpg, bmp}) {
    EXPECT_EQ(read_image_bgr(file).size(), image.size()) << file;
    const std::size_t size = fs::file_size(file);
    for (const std::size_t keep : {std::size_t{0}, std::size_t{1}, std::size_t{20}, size / 4,
                                   size / 2, size - 13, size - 1}) {
      write_all();
      cut(file, keep);
      const std::string expected = file.string() + ": truncated or not an image";
      EXPECT_EQ(error_of([&] { read_image_bgr(file); }), expected) << keep << " of " << size;
      EXPECT_EQ(error_of([&] { read_image_gray(file); }), expected) << keep << " of " << size;
    }
  }
  const std::size_t size = fs::file_size(exr);
  for (const std::size_t keep :
       {std::size_t{0}, std::size_t{1}, std::size_t{100}, size / 4, size / 2, size - 1}) {
    write_all();
    cut(exr, keep);
    EXPECT_EQ(error_of([&] { read_exr(exr); }), exr.string() + ": truncated or not an image")
        << keep << " of " << size;
  }
}

// The decoders behind read_image may or may not notice; the check of wholeness always does.
TEST(ImageIo, EveryCutOfAFileIsNoticedWithoutDecoding) {
  const TemporaryFolder folder("whole");
  const cv::Mat image = noise(CV_8UC3, 5);
  for (const char* name : {"a.png", "a.jpg", "a.bmp"}) {
    const fs::path file = folder.path() / name;
    ASSERT_TRUE(cv::imwrite(file.string(), image));
    const std::string bytes = read_text(file);
    EXPECT_EQ(error_of([&] { check_image_is_whole("f", bytes); }), "no error") << name;
    for (std::size_t keep = 0; keep < bytes.size(); ++keep)
      ASSERT_EQ(error_of([&] { check_image_is_whole("f", bytes.substr(0, keep)); }),
                "f: truncated or not an image")
          << name << " cut to " << keep << " of " << bytes.size();
  }
}

TEST(ImageIo, TheEndOfAThumbnailIsNotTheEndOfAJpeg) {
  const TemporaryFolder folder("thumbnail");
  const fs::path file = folder.path() / "a.jpg";
  write_image(file, noise(CV_8UC3, 5));
  const std::string whole = read_text(file);
  // A comment segment behind the start marker that holds a whole (empty) JPEG, as EXIF data do.
  const std::string with_thumbnail = whole.substr(0, 2) + "\xff\xfe" + std::string("\0\x06", 2) +
                                     "\xff\xd8\xff\xd9" + whole.substr(2);
  EXPECT_EQ(error_of([&] { check_image_is_whole("f", with_thumbnail); }), "no error");
  EXPECT_EQ(error_of([&] {
              check_image_is_whole("f", with_thumbnail.substr(0, with_thumbnail.size() / 2));
            }),
            "f: truncated or not an image");
}

TEST(ImageIo, ADamagedPngIsToldByItsChecksum) {
  const TemporaryFolder folder("crc");
  const fs::path file = folder.path() / "a.png";
  write_image(file, noise(CV_8UC3, 5));
  flip_byte(file, fs::file_size(file) / 2);
  // 8 bytes of signature, 25 of the IHDR chunk.
  EXPECT_EQ(error_of([&] { read_image_bgr(file); }),
            file.string() + ": damaged: the checksum of its IDAT chunk at byte 33 does not match");
}

TEST(ImageIo, AnExrOfOtherChannelsIsRefused) {
  const TemporaryFolder folder("channels");
  const fs::path file = folder.path() / "a.exr";
  OIIO::ImageSpec spec(4, 3, 3, OIIO::TypeDesc::FLOAT);  // R G B
  const auto out = OIIO::ImageOutput::create(file.string());
  const std::vector<float> pixels(4 * 3 * 3, 1.0f);
  ASSERT_TRUE(out->open(file.string(), spec) &&
              out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()) && out->close());
  EXPECT_EQ(error_of([&] { read_exr(file); }),
            file.string() +
                ": channels R G B of float in openexr, expected float32 OpenEXR with Y, or x y, or "
                "x y z");
}

TEST(ImageIo, AFileThatIsNoImageIsNamed) {
  const TemporaryFolder folder("noimage");
  const fs::path file = folder.path() / "a.png";
  EXPECT_EQ(error_of([&] { read_image_bgr(file); }), file.string() + ": no such file");
  write_atomic(file, "not an image at all");
  EXPECT_EQ(error_of([&] { read_image_bgr(file); }), file.string() + ": truncated or not an image");
  const fs::path exr = folder.path() / "a.exr";
  write_atomic(exr, "not an image at all");
  EXPECT_EQ(error_of([&] { read_exr(exr); }), exr.string() + ": truncated or not an image");
}

TEST(ImageIo, EveryDamagedByteOfAPngIsFound) {
  const TemporaryFolder folder("damage");
  const fs::path file = folder.path() / "a.png";
  write_image(file, noise(CV_8UC1, 6)(cv::Rect(0, 0, 8, 6)).clone());
  const std::string whole = read_text(file);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    write_atomic(file, whole);
    flip_byte(file, at);
    const std::string error = error_of([&] { read_image_bgr(file); });
    EXPECT_TRUE(error.starts_with(file.string() + ": truncated or not an image") ||
                error.starts_with(file.string() + ": damaged: the checksum of its"))
        << "byte " << at << ": " << error;
  }
}

TEST(ImageIo, AFolderThatCannotBeWrittenIsNamed) {
  const TemporaryFolder folder("unwritable");
  write_atomic(folder.path() / "file", "x");
  const fs::path below_a_file = folder.path() / "file" / "a.png";
  EXPECT_EQ(error_of([&] { write_image(below_a_file, noise(CV_8UC3, 1)); }),
            below_a_file.string() + ": cannot be written: Not a directory");
  const fs::path exr = folder.path() / "file" / "a.exr";
  EXPECT_EQ(error_of([&] { write_exr(exr, field(1)); }),
            exr.string() + ": cannot be written: Not a directory");
}

TEST(ImageIo, AFullDiskNamesTheFile) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const TemporaryFolder folder("full");
  const fs::path file = folder.path() / "a.exr";
  // The temporary neighbour is the full device: every write to it fails as on a full disk.
  fs::create_symlink("/dev/full", temporary_for(file));
  EXPECT_EQ(error_of([&] { write_exr(file, field(3)); }),
            file.string() + ": cannot be written: No space left on device");
  EXPECT_FALSE(fs::exists(file));
}

TEST(ImageIo, WrongTypesAreRefused) {
  const TemporaryFolder folder("types");
  EXPECT_EQ(error_of([&] { write_image(folder.path() / "a.png", field(3)); }),
            (folder.path() / "a.png").string() +
                ": image of type CV_32FC3, expected 8-bit (PNG and TIFF also 16-bit) with 1 or 3 "
                "channels");
  EXPECT_EQ(error_of([&] { write_exr(folder.path() / "a.exr", noise(CV_8UC1, 1)); }),
            (folder.path() / "a.exr").string() +
                ": image of type CV_8UC1, expected float32 of 1 to 3 channels");
  EXPECT_EQ(error_of([&] { write_image(folder.path() / "a.gif", noise(CV_8UC1, 1)); }),
            (folder.path() / "a.gif").string() + ": images are written as .png, .jpg or .tiff");
}

}  // namespace
}  // namespace rugae
