#pragma once
// Small pieces of HTML: text, pictures inside the page, tables.

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace rugae::html {

/// Text with & < > and quotes written so that it shows as it is.
std::string escape(const std::string& text);

/// "#name" as an address within the page: RFC 3986, section 2.1.
std::string link_to(const std::string& id);

/// "data:image/jpeg;base64,...": 8-bit BGR or gray, made smaller where wider than `max_width_px`.
std::string jpeg(const cv::Mat& image, int max_width_px = 640, int quality = 86);
/// The same without loss; for pictures of few colours.
std::string png(const cv::Mat& image, int max_width_px = 640);

/// A picture that opens large when clicked; `caption` is HTML, `alt` plain text.
std::string figure(const std::string& data_uri, const std::string& alt, const std::string& caption);

struct Table {
  std::vector<std::string> head;  // HTML, as the cells are; the first column is left-aligned
  std::vector<std::vector<std::string>> rows;
  bool sortable = false;     // by a click on the head, where the page has its viewer
  std::string caption = {};  // HTML
  std::string str() const;
};

/// JSON text for the page's viewer: <script type="application/json" class="CSS_CLASS">. Throws
/// Error where it is empty.
std::string json_script(const std::string& css_class, const std::string& json);

/// Bytes as text: RFC 4648, section 4.
std::string base64(const std::vector<unsigned char>& bytes);

/// "12.3" with `digits` significant digits and without a useless exponent; a dash for NaN.
std::string number(double value, int digits = 3);

}  // namespace rugae::html
