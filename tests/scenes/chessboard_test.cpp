#include "scenes/chessboard.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "scenes/scene.h"
#include "tests/message_of.h"
#include "tests/scenes/scene_files.h"

namespace rugae {
namespace {

constexpr double kSharp_mm = 1e-9;

ChessboardOptions small_board() {
  return {.columns = 4, .rows = 3, .square_mm = 2.0, .border_mm = 1.0, .white = 0.8, .black = 0.1};
}

// By the definition alone: squares from -2 to 8 and -2 to 6 mm, the first of them black.
double sharp_albedo(double x_mm, double y_mm) {
  const ChessboardOptions o = small_board();
  if (x_mm < -2.0 || y_mm < -2.0 || x_mm >= 8.0 || y_mm >= 6.0) return o.white;
  const int parity = static_cast<int>(std::floor(x_mm / 2.0) + std::floor(y_mm / 2.0));
  return parity % 2 == 0 ? o.black : o.white;
}

TEST(Chessboard, PrintIsThatOfItsSquaresAndBorder) {
  const Chessboard board(small_board());
  for (double y = -2.95; y < 7.0; y += 0.1)
    for (double x = -2.95; x < 9.0; x += 0.1)
      ASSERT_NEAR(board.albedo(x, y, kSharp_mm), sharp_albedo(x, y), 1e-6) << x << ' ' << y;
}

TEST(Chessboard, FootprintAverages) {
  const Chessboard board(small_board());
  constexpr int kCells = 200;
  for (std::uint64_t i = 0; i < 60; ++i) {
    const auto u = random_uniform(1, Purpose::test, 5, i);
    const double x = -3.0 + 12.0 * u[0], y = -3.0 + 10.0 * u[1], width = 0.05 + 5.0 * u[2];
    double sum = 0.0;
    for (int b = 0; b < kCells; ++b)
      for (int a = 0; a < kCells; ++a)
        sum += sharp_albedo(x + width * ((a + 0.5) / kCells - 0.5),
                            y + width * ((b + 0.5) / kCells - 0.5));
    // Each edge falls anywhere within a cell: half a cell's column of the sum, and few edges.
    EXPECT_NEAR(board.albedo(x, y, width), sum / (kCells * kCells), 0.7 * 3.0 / kCells)
        << x << ' ' << y << ' ' << width;
  }
}

TEST(Chessboard, CornersAreGreyAndSymmetricUnderAnyFootprint) {
  const Chessboard board(small_board());
  for (const double width : {1e-3, 0.3, 1.9})
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) {
        const Vec3 p = board.corner_mm(c, r);
        EXPECT_NEAR(board.albedo(p.x(), p.y(), width), 0.45, 1e-12);
        const double here = board.albedo(p.x() + 0.2, p.y() + 0.3, width);
        EXPECT_NEAR(here, board.albedo(p.x() - 0.2, p.y() - 0.3, width), 1e-12);
        EXPECT_NEAR(here, 0.9 - board.albedo(p.x() - 0.2, p.y() + 0.3, width), 1e-12);
      }
}

TEST(Chessboard, MeshIsTheSheet) {
  const Chessboard board(small_board());
  const TriangleMesh mesh = board.mesh();
  EXPECT_NEAR(area_mm2(mesh), 12.0 * 10.0, 1e-9);
  EXPECT_TRUE(board.extent_mm().min().isApprox(Vec2(-3.0, -3.0)));
  EXPECT_TRUE(board.extent_mm().max().isApprox(Vec2(9.0, 7.0)));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    EXPECT_TRUE(triangle_normal(mesh, t).isApprox(Vec3::UnitZ()));
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      EXPECT_EQ(std::ranges::count(mesh.vertices, board.corner_mm(c, r)), 1);
}

TEST(Chessboard, SamplesArePaperUnderAsMuchCoatAsAsked) {
  ChessboardOptions options = small_board();
  options.gloss = 0.3;
  const MucosaPlace place{Vec3f(1.0f, -1.0f, 0.0f), Vec3f::UnitZ(), Region::unknown, 0.05f};
  MucosaSample sample;
  Chessboard(options).sample({&place, 1}, {&sample, 1});
  EXPECT_TRUE(sample.albedo.isApprox(Vec3f::Constant(0.8f)));
  EXPECT_EQ(sample.coverage, 0.3f);
  EXPECT_TRUE(sample.coat_gradient.isZero());
}

TEST(Chessboard, SaysWhatIsOutOfRange) {
  ChessboardOptions options = small_board();
  options.columns = 2;
  EXPECT_EQ(message_of([&] { options.check("b"); }), "b: columns is 2, expected 3 to 100");
  options = small_board();
  options.square_mm = std::nan("");
  EXPECT_EQ(message_of([&] { options.check("b"); }), "b: square_mm is nan, expected 0.1 to 100");
  options = small_board();
  options.black = 0.8;
  EXPECT_EQ(message_of([&] { options.check("b"); }),
            "b: black is 0.8, expected below white, which is 0.8");
}

TEST_F(SceneFiles, AChessboardIsASceneWithoutMucosa) {
  const Scene scene = load("chessboard");
  ASSERT_TRUE(scene.board);
  EXPECT_EQ(scene.board->options().columns, 9);
  EXPECT_EQ(scene.board->options().rows, 7);
  EXPECT_EQ(scene.wall.triangles.size(), 2u * 12u * 10u);
  EXPECT_EQ(scene.regions.size(), scene.wall.vertices.size());
  EXPECT_EQ(scene.rest_positions, scene.wall.vertices);
  EXPECT_FALSE(load("stomach").board);
  const Scene wide = load(write("wide.yaml", std::string("like: chessboard\nboard: {rows: 5}\n")));
  EXPECT_EQ(wide.board->options().rows, 5);
  EXPECT_EQ(wide.board->options().columns, 9);
  EXPECT_EQ(error_of(write("a.yaml", std::string("kind: chessboard\nmucosa: {oil: 1}\n"))),
            path("a.yaml") + ":2:1: unknown key 'mucosa'");
  EXPECT_EQ(error_of(write("b.yaml", std::string("kind: chessboard\nboard: {colums: 9}\n"))),
            path("b.yaml") + ":2:9: unknown key 'colums'; did you mean 'columns'?");
}

}  // namespace
}  // namespace rugae
