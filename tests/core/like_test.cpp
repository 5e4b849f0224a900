// Files that build on others, and likes that lead nowhere or in a circle.

#include "core/like.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/check.h"
#include "core/files.h"
#include "tests/message_of.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;

class Like : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("rugae_like_{}", getpid());
    fs::remove_all(folder_);
    make_folder(folder_ / "below");
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path write(const std::string& name, const std::string& text) const {
    write_atomic(folder_ / name, text);
    return folder_ / name;
  }
  // What `key` is over the chain of `file`, and the names of its files.
  static std::pair<int, std::string> read(const fs::path& file) {
    int value = 0;
    std::string names;
    for (LikeFile& at : read_like_chain("scenes", "scene", file)) {
      at.yaml.get("key", value);
      at.yaml.finish();
      names += at.file.stem().string();
    }
    return {value, names};
  }
  std::string error_of(const fs::path& file) const {
    return message_of([&] { read_like_chain("scenes", "scene", file); });
  }
  std::string text(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_;
};

TEST_F(Like, TheFileItselfComesLast) {
  const fs::path a = write("a.yaml", "key: 1\n");
  EXPECT_EQ(read(a), std::pair(1, std::string("a")));
  EXPECT_EQ(read(write("b.yaml", "like: a.yaml\nkey: 2\n")), std::pair(2, std::string("ab")));
  EXPECT_EQ(read(write("c.yaml", "like: b.yaml\n")), std::pair(2, std::string("abc")));
}

TEST_F(Like, APathGoesFromTheFileInWhichItStands) {
  write("a.yaml", "key: 1\n");
  write("below/b.yaml", "like: ../a.yaml\n");
  EXPECT_EQ(read(write("c.yaml", "like: below/b.yaml\n")), std::pair(1, std::string("abc")));
  EXPECT_EQ(read(write("below/d.yaml", "like: " + text("a.yaml") + "\n")).second, "ad");
}

TEST_F(Like, AChainMayBeLong) {
  write("0.yaml", "key: 7\n");
  for (int i = 1; i < 30; ++i)
    write(fmt::format("{}.yaml", i), fmt::format("like: {}.yaml\n", i - 1));
  EXPECT_EQ(read(folder_ / "29.yaml").first, 7);
}

TEST_F(Like, ANameIsAPreset) {
  const auto chain =
      read_like_chain("scenes", "scene", write("mine.yaml", "# mine\nlike: stomach-moving\n"));
  ASSERT_EQ(chain.size(), 3u);  // which is like `stomach` itself
  EXPECT_EQ(chain[0].file.filename(), "stomach.yaml");
  EXPECT_EQ(chain[1].file.filename(), "stomach-moving.yaml");
}

TEST_F(Like, CirclesAreRefusedWhereTheyClose) {
  EXPECT_EQ(error_of(write("a.yaml", "like: a.yaml\n")),
            text("a.yaml") + ":1:7: like goes in a circle");
  write("a.yaml", "key: 1\nlike: below/../b.yaml\n");
  write("b.yaml", "like: ./a.yaml\n");
  // a, b, and back: the line that leads back is named
  EXPECT_EQ(error_of(folder_ / "a.yaml"),
            (folder_ / "below/../b.yaml").string() + ":1:7: like goes in a circle");
  EXPECT_EQ(error_of(write("c.yaml", "like: b.yaml\n")),
            text("a.yaml").insert(folder_.string().size(), "/.") + ":2:7: like goes in a circle");
}

TEST_F(Like, LikesThatLeadNowhereAreNamedByLineAndColumn) {
  EXPECT_EQ(error_of(write("a.yaml", "key: 1\nlike: none.yaml\n")),
            text("a.yaml") + ":2:7: like: scene '" + text("none.yaml") + "': no such file");
  const std::string unknown = error_of(write("b.yaml", "like: stomch\n"));
  EXPECT_TRUE(unknown.starts_with(text("b.yaml") + ":1:7: like: scene 'stomch': no such preset; "
                                                   "did you mean 'stomach'?; known: "))
      << unknown;
  EXPECT_EQ(error_of(write("c.yaml", "like: [a, b]\n")),
            text("c.yaml") + ":1:7: like is a list, expected a text");
  write("broken.yaml", "key: [1\n");
  const std::string broken = error_of(write("d.yaml", "like: broken.yaml\n"));
  EXPECT_TRUE(broken.starts_with(text("broken.yaml") + ":")) << broken;
}

}  // namespace
}  // namespace rugae
