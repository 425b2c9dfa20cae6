#include <cstdarg>
#include <cstdio>

#include "adapter/output_file.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

class AppendJournal : public Ipopt::Journal {
 public:
  AppendJournal(const std::string& name, Ipopt::EJournalLevel level, std::FILE* file)
      : Journal(name, level), file_(file) {}
  ~AppendJournal() override { std::fclose(file_); }

 protected:
  void PrintImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* text) override {
    std::fputs(text, file_);
  }
  void PrintfImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* format,
                  std::va_list values) override {
    std::vfprintf(file_, format, values);
  }
  void FlushBufferImpl() override { std::fflush(file_); }

 private:
  std::FILE* file_;
};

}  // namespace

Ipopt::SmartPtr<Ipopt::Journal> open_journal(const std::string& name, const std::string& file_name,
                                             Ipopt::EJournalLevel level, bool append) {
  if (append && file_name != "stdout" && file_name != "stderr") {
    std::FILE* file = std::fopen(file_name.c_str(), "a");
    if (file == nullptr) return nullptr;
    return new AppendJournal(name, level, file);
  }
  const Ipopt::SmartPtr<Ipopt::FileJournal> journal = new Ipopt::FileJournal(name, level);
  if (!journal->Open(file_name.c_str())) return nullptr;
  return Ipopt::GetRawPtr(journal);
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
