#pragma once

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <string>

#include <IpJournalist.hpp>

#include "ipopt_version.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// The message about it; error: an errno.
[[nodiscard]] std::string cannot_write(const std::string& file, int error);

/// A descriptor to write the file with; -1: none, see errno. A pipe has to have a reader already,
/// as opening would else wait for one.
[[nodiscard]] int open_to_write(const std::string& file, int flags);

/// A journal that writes to a file, from its end on where asked (Ipopt 3.11's cannot), and
/// remembers whether all was written, which Ipopt's do not. "stdout" and "stderr" are the streams.
class OutputFile : public Ipopt::Journal {
 public:
  /// name: the journal's.
  OutputFile(const std::string& name, Ipopt::EJournalLevel level) : Journal(name, level) {}
  ~OutputFile() override;

  /// Returns what is wrong ("cannot write FILE: permission denied"), empty when nothing is. append:
  /// what the file holds stays.
  [[nodiscard]] std::string open(const std::string& file_name, bool append);
  /// Returns the first error since it was opened, empty when all was written. Nothing is printed
  /// afterwards.
  [[nodiscard]] std::string close();

 protected:
  void PrintImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* text) override {
    if (file_ != nullptr) note_error(std::fputs(text, file_) < 0);
  }
  void PrintfImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* format,
                  va_list values) override {
    if (file_ != nullptr) note_error(std::vfprintf(file_, format, values) < 0);
  }
  void FlushBufferImpl() override {
    if (file_ != nullptr) note_error(std::fflush(file_) != 0);
  }

 private:
  void note_error(bool failed) {
    if (failed && error_ == 0) error_ = errno;
  }
  [[nodiscard]] bool is_stream() const { return file_ == stdout || file_ == stderr; }

  std::string file_name_;
  std::FILE* file_ = nullptr;
  int error_ = 0;  ///< errno of the first failure
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
