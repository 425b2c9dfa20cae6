#pragma once

#include <cstdio>
#include <string>

#include <IpJournalist.hpp>

namespace ipminmax {

/// Writes the file as a whole or not at all: into a temporary file beside it, which then takes its
/// name. Devices and pipes are written to directly. Every write and close is checked: throws
/// std::runtime_error, "cannot write FILE: no space left on device".
void write_file(const std::string& file, const std::string& content);

/// Removes a regular file, so that what a failed run leaves is not taken for its answer. Throws
/// std::runtime_error when it is there and cannot be removed.
void remove_stale_file(const std::string& file);

/// A log file that remembers whether all was written, which Ipopt's does not.
class CheckedJournal : public Ipopt::Journal {
 public:
  /// name: the journal's. Throws std::runtime_error when the file cannot be opened.
  CheckedJournal(const std::string& name, const std::string& file, Ipopt::EJournalLevel level);
  ~CheckedJournal() override;
  CheckedJournal(const CheckedJournal&) = delete;
  CheckedJournal& operator=(const CheckedJournal&) = delete;

  /// Throws std::runtime_error when something was not written. Nothing may be printed afterwards.
  void close();

 protected:
  void PrintImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* text) override;
  void PrintfImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* format,
                  va_list arguments) override;
  void FlushBufferImpl() override;

 private:
  void note_error(bool failed);

  std::string file_name_;
  std::FILE* file_ = nullptr;
  int error_ = 0;  ///< errno of the first failure
};

}  // namespace ipminmax
