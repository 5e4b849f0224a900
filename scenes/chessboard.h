#pragma once
// A printed chessboard, the target that cameras are calibrated with.

#include <span>
#include <string>

#include "core/mesh.h"
#include "core/types.h"

namespace rugae {

struct MucosaPlace;
struct MucosaSample;

/// A sheet with (columns + 1) x (rows + 1) squares and a white border around them.
struct ChessboardOptions {
  int columns = 9, rows = 7;  // inner corners, where four squares meet
  double square_mm = 2.5;
  double border_mm = 1.25;           // of white around the squares
  double white = 0.8, black = 0.04;  // albedo of paper and of toner
  double gloss = 0.0;                // 0 to 1: share of the sheet under a glossy coat
  /// Throws Error naming `where` and the field that is out of range.
  void check(const std::string& where) const;
};

/// The world's axes are the board's: the print lies in the plane z = 0, x runs across and y down,
/// the first inner corner is the origin, and who looks along +z from below it sees x to the right
/// and y downwards, as in a picture.
class Chessboard {
 public:
  explicit Chessboard(const ChessboardOptions& options);
  const ChessboardOptions& options() const { return options_; }

  /// Place of an inner corner, 0 <= column < columns, 0 <= row < rows.
  Vec3 corner_mm(int column, int row) const {
    return {column * options_.square_mm, row * options_.square_mm, 0.0};
  }
  /// The sheet's extent in x and y, border included.
  Eigen::AlignedBox2d extent_mm() const;
  /// Two triangles a square, open; normals along +z, away from who looks at the print.
  TriangleMesh mesh() const;
  /// The print's mean albedo over a square of `footprint_mm` around each place: sharp edges become
  /// as wide as a pixel, however few rays it has, and corners stay where they are.
  void sample(std::span<const MucosaPlace> places, std::span<MucosaSample> samples) const;
  /// Albedo at (x, y) mm of the print, averaged over a square of the given width.
  double albedo(double x_mm, double y_mm, double footprint_mm) const;

 private:
  ChessboardOptions options_;
};

}  // namespace rugae
