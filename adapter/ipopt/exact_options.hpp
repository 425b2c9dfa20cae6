#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <IpOptionsList.hpp>

#include "ipopt_version.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Ipopt's list of options, of whose numbers Ipopt keeps six digits as text in the C locale of the
/// moment. This one keeps the numbers too.
class ExactOptionsList : public Ipopt::OptionsList {
 public:
  using Ipopt::OptionsList::OptionsList;

#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
  Ipopt::OptionsList& operator=(const Ipopt::OptionsList& source) override;
  bool UnsetValue(const std::string& tag) override;
#else
  void operator=(const Ipopt::OptionsList& source) override;
#endif
  void clear() override;
  bool SetStringValue(const std::string& tag, const std::string& value, bool allow_clobber = true,
                      bool dont_print = false) override;
  bool SetIntegerValue(const std::string& tag, Ipopt::Index value, bool allow_clobber = true,
                       bool dont_print = false) override;
  bool SetNumericValue(const std::string& tag, Ipopt::Number value, bool allow_clobber = true,
                       bool dont_print = false) override;
  bool GetNumericValue(const std::string& tag, Ipopt::Number& value,
                       const std::string& prefix) const override;

  /// Grows with every call that may change an option.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }

  /// Whether the option, by its lower-case name, has ever been set: a look-up that is much cheaper
  /// than asking for the value. True also of what was unset again or came from another list.
  [[nodiscard]] bool may_be_set(std::string_view name) const {
    return all_touched_ || std::ranges::find(touched_, name) != touched_.end();
  }

  /// Takes the other's options, registry and journalist.
  void copy(const Ipopt::OptionsList& other);

 private:
  /// Values set, with what the list made of them: a later value of another origin shows in that.
  struct Exact {
    Ipopt::Number value;
    Ipopt::Number rounded;
  };
  void touch(const std::string& tag);

  std::map<std::string, Exact> exact_;  ///< by lower-case name
  std::uint64_t changes_ = 0;
  std::vector<std::string> touched_;  ///< lower-case names, few
  bool all_touched_ = false;          ///< by a list of another class
};

/// Which options may be set in a list: any in a list of another class.
class MayBeSet {
 public:
  explicit MayBeSet(const Ipopt::OptionsList& list)
      : exact_(dynamic_cast<const ExactOptionsList*>(&list)) {}
  [[nodiscard]] bool operator()(std::string_view name) const {
    return exact_ == nullptr || exact_->may_be_set(name);
  }

 private:
  const ExactOptionsList* exact_;
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
