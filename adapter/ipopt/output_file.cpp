#include <fcntl.h>

#include <cstring>

#include "adapter/ipopt/output_file.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

std::string cannot_write(const std::string& file, int error) {
  return "cannot write " + file + ": " + std::strerror(error);
}

int open_to_write(const std::string& file, int flags) {
  constexpr mode_t kMode = 0666;  // what the umask leaves
  const int descriptor = open(file.c_str(), flags | O_WRONLY | O_CLOEXEC | O_NONBLOCK, kMode);
  if (descriptor >= 0) fcntl(descriptor, F_SETFL, flags & O_APPEND);
  return descriptor;
}

OutputFile::~OutputFile() {
  if (file_ != nullptr && !is_stream()) std::fclose(file_);
}

std::string OutputFile::open(const std::string& file_name, bool append) {
  file_name_ = file_name;
  if (file_name == "stdout" || file_name == "stderr") {
    file_ = file_name == "stdout" ? stdout : stderr;
  } else {
    const int descriptor = open_to_write(file_name, O_CREAT | (append ? O_APPEND : O_TRUNC));
    if (descriptor >= 0) file_ = fdopen(descriptor, append ? "a" : "w");
  }
  return file_ == nullptr ? cannot_write(file_name, errno) : "";
}

std::string OutputFile::close() {
  if (file_ != nullptr) note_error((is_stream() ? std::fflush(file_) : std::fclose(file_)) != 0);
  file_ = nullptr;
  return error_ != 0 ? cannot_write(file_name_, error_) : "";
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
