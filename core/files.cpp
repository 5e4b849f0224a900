#include "core/files.h"

#include <openssl/evp.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <system_error>

#include "core/check.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr);
  }
  void add(const char* bytes, std::size_t size) { EVP_DigestUpdate(context_.get(), bytes, size); }
  std::string hex() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned int size = 0;
    EVP_DigestFinal_ex(context_.get(), digest.data(), &size);
    std::string text;
    for (unsigned int i = 0; i < size; ++i) text += fmt::format("{:02x}", digest[i]);
    return text;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

std::ifstream open_for_reading(const fs::path& file) {
  check(fs::exists(file), "{}: no such file", file.string());
  check(!fs::is_directory(file), "{}: is a folder, expected a file", file.string());
  std::ifstream in(file, std::ios::binary);
  check(in.good(), "{}: cannot be read: {}", file.string(), std::strerror(errno));
  return in;
}

}  // namespace

std::string read_text(const fs::path& file) {
  std::ifstream in = open_for_reading(file);
  // In blocks: the size of a pipe is not known before its end.
  constexpr std::size_t kBlock = std::size_t{1} << 18;
  std::string bytes;
  while (in) {
    const std::size_t known = bytes.size();
    bytes.resize(known + kBlock);
    in.read(bytes.data() + known, kBlock);
    bytes.resize(known + static_cast<std::size_t>(in.gcount()));
  }
  check(!in.bad(), "{}: reading failed: {}", file.string(), std::strerror(errno));
  return bytes;
}

fs::path temporary_for(const fs::path& file) {
  fs::path temporary = file;
  temporary.replace_filename(file.stem().string() + ".tmp" + file.extension().string());
  return temporary;
}

void publish(const fs::path& file) {
  std::error_code error;
  fs::rename(temporary_for(file), file, error);
  check(!error, "{}: cannot be written: {}", file.string(), error.message());
}

void write_atomic(const fs::path& file, std::string_view bytes) {
  const fs::path temporary = temporary_for(file);
  errno = 0;
  std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) {
    const int reason = errno;
    std::error_code ignored;
    fs::remove(temporary, ignored);
    fail("{}: cannot be written: {}", file.string(), std::strerror(reason));
  }
  publish(file);
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  check(!error && fs::is_directory(folder), "{}: output folder cannot be created: {}",
        folder.string(), error ? error.message() : "a file of that name exists");
  check(::access(folder.c_str(), W_OK) == 0, "{}: output folder is not writable", folder.string());
}

std::string sha256_of_bytes(std::string_view bytes) {
  Sha256 sha;
  sha.add(bytes.data(), bytes.size());
  return sha.hex();
}

std::string sha256_of_file(const fs::path& file) {
  std::ifstream in = open_for_reading(file);
  Sha256 sha;
  std::array<char, 1 << 16> buffer{};
  while (in.read(buffer.data(), buffer.size()) || in.gcount() > 0)
    sha.add(buffer.data(), static_cast<std::size_t>(in.gcount()));
  return sha.hex();
}

}  // namespace rugae
