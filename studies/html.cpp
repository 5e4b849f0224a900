#include "studies/html.h"

#include <array>
#include <cctype>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "core/check.h"

namespace rugae::html {
namespace {

std::string encoded(const cv::Mat& image, int max_width_px, const std::string& extension,
                    const std::vector<int>& parameters) {
  check(!image.empty() && image.depth() == CV_8U, "report: a picture is empty or not of 8 bits");
  cv::Mat shown = image;
  if (image.cols > max_width_px)
    cv::resize(image, shown, {max_width_px, image.rows * max_width_px / image.cols}, 0, 0,
               cv::INTER_AREA);
  std::vector<unsigned char> bytes;
  check(cv::imencode(extension, shown, bytes, parameters), "report: a picture cannot be encoded");
  return base64(bytes);
}

}  // namespace

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string link_to(const std::string& id) {
  std::string address = "#";
  for (const unsigned char c : id)
    address += std::isalnum(c) ||
                       std::string_view("-._~").find(static_cast<char>(c)) != std::string_view::npos
                   ? std::string(1, static_cast<char>(c))
                   : fmt::format("%{:02X}", c);
  return address;
}

std::string jpeg(const cv::Mat& image, int max_width_px, int quality) {
  return "data:image/jpeg;base64," +
         encoded(image, max_width_px, ".jpg", {cv::IMWRITE_JPEG_QUALITY, quality});
}

std::string png(const cv::Mat& image, int max_width_px) {
  return "data:image/png;base64," + encoded(image, max_width_px, ".png", {});
}

std::string figure(const std::string& data_uri, const std::string& alt,
                   const std::string& caption) {
  return fmt::format(
      "<figure><img class=\"zoom\" loading=\"lazy\" src=\"{}\" alt=\"{}\">"
      "<figcaption>{}</figcaption></figure>\n",
      data_uri, escape(alt), caption);
}

std::string base64(const std::vector<unsigned char>& bytes) {
  static constexpr char kLetters[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = bytes.size() - i;
    const unsigned triple =
        (bytes[i] << 16) | ((left > 1 ? bytes[i + 1] : 0) << 8) | (left > 2 ? bytes[i + 2] : 0);
    text += kLetters[(triple >> 18) & 63];
    text += kLetters[(triple >> 12) & 63];
    text += left > 1 ? kLetters[(triple >> 6) & 63] : '=';
    text += left > 2 ? kLetters[triple & 63] : '=';
  }
  return text;
}

std::string Table::str() const {
  std::string out =
      "<div class=\"table\"><table" + std::string(sortable ? " class=\"sortable\"" : "") + ">";
  if (!caption.empty()) out += "<caption>" + caption + "</caption>";
  out += "<thead><tr>";
  for (const std::string& cell : head) out += "<th>" + cell + "</th>";
  out += "</tr></thead><tbody>\n";
  for (const auto& row : rows) {
    out += "<tr>";
    for (const std::string& cell : row) out += "<td>" + cell + "</td>";
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string json_script(const std::string& css_class, const std::string& json) {
  check(!json.empty(), "report: no data for the page's {}", css_class);
  std::string out = "<script type=\"application/json\" class=\"" + css_class + "\">";
  // In JSON a < stands only inside strings, where it may be written otherwise: nothing then ends
  // the script early.
  for (const char c : json)
    if (c == '<')
      out += "\\u003c";
    else
      out += c;
  return out + "</script>\n";
}

std::string number(double value, int digits) {
  if (!std::isfinite(value)) return "&ndash;";
  if (value == 0.0) return "0";
  const int before = static_cast<int>(std::floor(std::log10(std::abs(value)))) + 1;
  const int after = std::max(0, digits - before);
  constexpr int kMostAfter = 6;
  return fmt::format("{:.{}f}", value, std::min(after, kMostAfter));
}

}  // namespace rugae::html
