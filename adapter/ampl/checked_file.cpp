#include "checked_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/output_file.hpp"

namespace ipminmax {
namespace {

/// errno of the first failure, 0 when all was written and closed.
int write_and_close(int descriptor, const std::string& content) {
  int error = 0;
  for (std::size_t at = 0; at < content.size() && error == 0;) {
    const ssize_t written = write(descriptor, content.data() + at, content.size() - at);
    if (written >= 0)
      at += static_cast<std::size_t>(written);
    else if (errno != EINTR)
      error = errno;
  }
  if (close(descriptor) != 0 && error == 0) error = errno;
  return error;
}

/// The file that a chain of links ends at, whether it exists or not.
std::filesystem::path resolved(std::filesystem::path file) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(file, error); ++i)
    file = file.parent_path() / std::filesystem::read_symlink(file, error);
  return file;
}

}  // namespace

void write_file(const std::string& file, const std::string& content) {
  struct stat status;
  const bool is_device = stat(file.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
  const std::string target = resolved(file).string();
  const std::string written = is_device ? file : concat(target, ".", getpid(), ".tmp");
  const int descriptor = open_to_write(written, is_device ? 0 : O_CREAT | O_TRUNC | O_NOFOLLOW);
  int error = descriptor < 0 ? errno : write_and_close(descriptor, content);
  if (error == 0 && !is_device && std::rename(written.c_str(), target.c_str()) != 0) error = errno;
  if (error == 0) return;
  if (descriptor >= 0 && !is_device) unlink(written.c_str());
  throw std::runtime_error(cannot_write(file, error));
}

void remove_stale_file(const std::string& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return;
  std::filesystem::remove(resolved(file), error);
  if (error) throw std::runtime_error("cannot remove the old " + file + ": " + error.message());
}

}  // namespace ipminmax
