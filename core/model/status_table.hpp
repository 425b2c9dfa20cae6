#pragma once

#include <string_view>

#include "core/result.hpp"

namespace ipminmax {

/// What is to be known of a status, but for Ipopt's codes (adapter/status).
struct StatusRow {
  Status status = Status::InternalError;
  std::string_view name;      ///< as name_of gives it
  std::string_view sentence;  ///< at the end of the log
  int solve_result = 510;     ///< AMPL's solve_result_num
  enum class Group : std::uint8_t {
    Solution,  ///< is_success
    Failure,   ///< of a search; another starting point may do better
    End        ///< of the solve: a limit, the user, a refusal
  };
  Group group = Group::End;
  std::string_view advice = {};  ///< what the user can do; empty where the message says it
};

[[nodiscard]] const StatusRow& row_of(Status status);

}  // namespace ipminmax
