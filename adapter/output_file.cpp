#include <cerrno>
#include <cstdarg>
#include <cstring>

#include "adapter/output_file.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

std::string cannot_write(const std::string& file, int error) {
  return "cannot write " + file + ": " + std::strerror(error);
}

}  // namespace

OutputFile::~OutputFile() {
  if (file_ != nullptr && !is_stream()) std::fclose(file_);
}

std::string OutputFile::open(const std::string& file_name, bool append) {
  file_name_ = file_name;
  file_ = file_name == "stdout"   ? stdout
          : file_name == "stderr" ? stderr
                                  : std::fopen(file_name.c_str(), append ? "a" : "w");
  return file_ == nullptr ? cannot_write(file_name, errno) : std::string();
}

std::string OutputFile::close() {
  if (file_ != nullptr) note_error((is_stream() ? std::fflush(file_) : std::fclose(file_)) != 0);
  file_ = nullptr;
  return error_ != 0 ? cannot_write(file_name_, error_) : std::string();
}

void OutputFile::note_error(bool failed) {
  if (failed && error_ == 0) error_ = errno;
}

void OutputFile::PrintImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* text) {
  if (file_ != nullptr) note_error(std::fputs(text, file_) < 0);
}

void OutputFile::PrintfImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* format,
                            va_list values) {
  if (file_ != nullptr) note_error(std::vfprintf(file_, format, values) < 0);
}

void OutputFile::FlushBufferImpl() {
  if (file_ != nullptr) note_error(std::fflush(file_) != 0);
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
