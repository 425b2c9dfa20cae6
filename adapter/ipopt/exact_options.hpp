#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "option_registry.hpp"
#include "spelling.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Ipopt's list of options, of whose numbers Ipopt keeps six digits as text in the C locale of the
/// moment. This one keeps the numbers too.
class ExactOptionsList : public OptionsList {
 public:
  using Ipopt::OptionsList::OptionsList;

#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
  OptionsList& operator=(const OptionsList& source) override {
    note_other_list();
    return OptionsList::operator=(source);
  }
  bool UnsetValue(const std::string& tag) override {
    ++changes_;
    return OptionsList::UnsetValue(tag);
  }
#else
  void operator=(const OptionsList& source) override {
    note_other_list();
    OptionsList::operator=(source);
  }
#endif
  void clear() override {
    ++changes_;
    touched_.clear();
    all_touched_ = false;
    OptionsList::clear();
  }
  bool SetStringValue(const std::string& tag, const std::string& value, bool allow_clobber = true,
                      bool dont_print = false) override {
    touch(tag);
    return OptionsList::SetStringValue(tag, value, allow_clobber, dont_print);
  }
  bool SetIntegerValue(const std::string& tag, Ipopt::Index value, bool allow_clobber = true,
                       bool dont_print = false) override {
    touch(tag);
    return OptionsList::SetIntegerValue(tag, value, allow_clobber, dont_print);
  }
  bool SetNumericValue(const std::string& tag, double value, bool allow_clobber = true,
                       bool dont_print = false) override {
    touch(tag);
    if (!OptionsList::SetNumericValue(tag, value, allow_clobber, dont_print)) return false;
    // True also where an earlier value that must not be overwritten stays.
    double rounded = 0.0;
    if (OptionsList::GetNumericValue(tag, rounded, "") && rounded == as_listed(value))
      exact_[lower_case(tag)] = {value, rounded};
    return true;
  }
  bool GetNumericValue(const std::string& tag, double& value,
                       const std::string& prefix) const override {
    if (!OptionsList::GetNumericValue(tag, value, prefix)) return false;
    const auto found = exact_.find(lower_case(prefix + tag));
    if (found != exact_.end() && found->second.rounded == value) value = found->second.value;
    return true;
  }

  /// Grows with every call that may change an option.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }

  /// Whether the option, by its lower-case name, has ever been set: a look-up that is much cheaper
  /// than asking for the value. True also of what was unset again or came from another list.
  [[nodiscard]] bool may_be_set(std::string_view name) const {
    return all_touched_ || std::ranges::find(touched_, name) != touched_.end();
  }

  /// Takes the other's options, registry and journalist.
  void copy(const OptionsList& other) {
    static_cast<OptionsList&>(*this) = other;
    const auto* exact = dynamic_cast<const ExactOptionsList*>(&other);
    exact_ = exact != nullptr ? exact->exact_ : std::map<std::string, Exact>{};
    touched_ = exact != nullptr ? exact->touched_ : std::vector<std::string>{};
    all_touched_ = exact == nullptr || exact->all_touched_;
  }

 private:
  /// Values set, with what the list made of them: a later value of another origin shows in that.
  struct Exact {
    double value;
    double rounded;
  };
  /// What the list makes of a number: %g, in the C locale of the moment.
  static double as_listed(double value) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), "%g", value);
    return std::strtod(text.data(), nullptr);
  }
  void touch(const std::string& tag) {
    ++changes_;
    std::string name = lower_case(tag);
    if (std::ranges::find(touched_, name) == touched_.end()) touched_.push_back(std::move(name));
  }
  void note_other_list() {
    ++changes_;
    all_touched_ = true;
  }

  std::map<std::string, Exact> exact_;  ///< by lower-case name
  std::uint64_t changes_ = 0;
  std::vector<std::string> touched_;  ///< lower-case names, few
  bool all_touched_ = false;          ///< by a list of another class
};

/// Asks for the value of one option. False: it was not set, and the value is the default.
inline bool get_option(const OptionsList& list, const std::string& name, double& value) {
  return list.GetNumericValue(name, value, "");
}
inline bool get_option(const OptionsList& list, const std::string& name, Ipopt::Index& value) {
  return list.GetIntegerValue(name, value, "");
}
inline bool get_option(const OptionsList& list, const std::string& name, bool& value) {
  return list.GetBoolValue(name, value, "");
}
inline bool get_option(const OptionsList& list, const std::string& name, std::string& value) {
  return list.GetStringValue(name, value, "");
}

/// Whether an option may be set in a list: any in a list of another class.
inline bool may_be_set(const OptionsList& list, std::string_view name) {
  const auto* exact = dynamic_cast<const ExactOptionsList*>(&list);
  return exact == nullptr || exact->may_be_set(name);
}

/// Replaces the value by the one that was set, if one was. Returns whether.
template <class Value>
bool read_option(const OptionsList& list, std::string_view name, Value& value) {
  Value found{};
  if (!may_be_set(list, name) || !get_option(list, std::string(name), found)) return false;
  value = std::move(found);
  return true;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
