#pragma once

#include <map>
#include <string>

#include <IpOptionsList.hpp>

#include "ipopt_version.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Ipopt's list of options, of whose numbers Ipopt keeps six digits as text in the C locale of the
/// moment. This one keeps the numbers too.
class ExactOptionsList : public Ipopt::OptionsList {
 public:
  using Ipopt::OptionsList::OptionsList;

  bool SetNumericValue(const std::string& tag, Ipopt::Number value, bool allow_clobber = true,
                       bool dont_print = false) override;
  bool GetNumericValue(const std::string& tag, Ipopt::Number& value,
                       const std::string& prefix) const override;

  /// Takes the other's options, registry and journalist.
  void copy(const Ipopt::OptionsList& other);

 private:
  /// Values set, with what the list made of them: a later value of another origin shows in that.
  struct Exact {
    Ipopt::Number value;
    Ipopt::Number rounded;
  };
  std::map<std::string, Exact> exact_;  ///< by lower-case name
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
