// SPDX-License-Identifier: Apache-2.0
#include "file.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <memory>

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>

#include "trammel/core/error.hpp"

namespace trammel::io {

namespace {

// The one temporary file being written, for the interrupt handler: a handler may only touch lock-free
// atomics and plain memory that is never freed.
constexpr std::size_t kLongestPath = 4096;
std::array<char, kLongestPath> unfinished_path{};
std::atomic<bool> unfinished{false};

constexpr int kSignalExit = 128;  // shells report a death by signal n as 128 + n

extern "C" void on_interrupt(int signal_number) {
  if (unfinished.load()) {
    ::unlink(unfinished_path.data());
  }
  ::_exit(kSignalExit + signal_number);
}

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& expected) {
  throw Error({file.string(), std::strerror(errno), expected});
}

}  // namespace

std::string read_text(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    fail(file, "a readable file");
  }
  std::string content;
  constexpr std::size_t kChunk = std::size_t{1} << 16U;
  std::array<char, kChunk> buffer{};
  ssize_t count = 0;
  while ((count = ::read(descriptor, buffer.data(), buffer.size())) > 0) {
    content.append(buffer.data(), static_cast<std::size_t>(count));
  }
  const int error = errno;
  ::close(descriptor);
  if (count < 0) {
    errno = error;
    fail(file, "a readable file");
  }
  return content;
}

void write_atomically(const std::filesystem::path& file, std::string_view content, Durability durability) {
  std::filesystem::path temporary = file;
  temporary += ".unfinished." + std::to_string(::getpid());
  require(temporary.native().size() < kLongestPath, file.string(), "a path of over 4000 characters",
          "a shorter path");
  std::strcpy(unfinished_path.data(), temporary.c_str());
  unfinished = true;
  const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  bool good = descriptor >= 0;
  while (good && !content.empty()) {
    const ssize_t count = ::write(descriptor, content.data(), content.size());
    good = count > 0 || (count < 0 && errno == EINTR);
    content.remove_prefix(count > 0 ? static_cast<std::size_t>(count) : 0);
  }
  good = good && (durability == Durability::kKill || ::fsync(descriptor) == 0);
  good = (descriptor >= 0 && ::close(descriptor) == 0) && good;
  good = good && ::rename(temporary.c_str(), file.c_str()) == 0;
  if (!good) {
    const int error = errno;
    ::unlink(temporary.c_str());
    unfinished = false;
    errno = error;
    fail(file, "a place that can be written");
  }
  unfinished = false;
}

void create_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder)) {
    throw Error({folder.string(), error ? error.message() : "a file of that name", "a folder to write to"});
  }
}

void install_interrupt_handler() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

std::string sha256(std::string_view content) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  if (EVP_Digest(content.data(), content.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1) {
    throw Error({"sha256", "no digest from libcrypto", "a working libcrypto"});
  }
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (unsigned int i = 0; i < size; ++i) {
    text += kDigits[digest[i] >> 4U];
    text += kDigits[digest[i] & 15U];
  }
  return text;
}

}  // namespace trammel::io
